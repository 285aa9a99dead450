"""From a configuration to a finished dataset in a folder; what was done before is not done again.

The manifest is written last; once it is there, the staging folder goes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from grasp_core.errors import InputError
from sim_validate.datasets.building.driver import Engine, drive
from sim_validate.datasets.building.staging import Staging
from sim_validate.datasets.building.worker import Limits
from sim_validate.datasets.building.write_tables import (
    CONFIG,
    CONTACTS,
    DATA,
    EXTRAS,
    QUARANTINE,
    finish,
)
from sim_validate.datasets.columns import Name
from sim_validate.datasets.config import DatasetConfig, config_to_toml
from sim_validate.datasets.describing.card import CARD
from sim_validate.datasets.describing.croissant import CROISSANT
from sim_validate.datasets.manifest import MANIFEST, read_manifest
from sim_validate.datasets.parquet import require_pyarrow
from sim_validate.datasets.units import WorkUnit, units_of, units_sha256
from sim_validate.files.folder_lock import alone_in
from sim_validate.files.paths import path_inside
from sim_validate.files.reading import read_text, write_text
from sim_validate.simulation.gate.gate import require_faithful
from sim_validate.simulation.setup import Setup

OWN = ("staging", DATA, *EXTRAS, CONTACTS, CONFIG, QUARANTINE, CARD, CROISSANT, MANIFEST)
"""What a dataset's folder holds, and nothing else."""


@dataclass(frozen=True, slots=True)
class Built:
    """What came of a build."""

    units: int
    made: int
    """Units that were not done before."""
    quarantined: int
    rows: dict[Name, int]


def build(
    config: DatasetConfig,
    folder: Path,
    engine: Engine,
    report: Callable[[int, int], None],
    limits: Limits | None = None,
) -> Built:
    """Make a dataset, or go on making it.

    Args:
        config: What it is made of.
        folder: Where; it may hold an unfinished or finished dataset of the same configuration.
        engine: Where units are done.
        report: Told how many units are finished, and of how many.
        limits: What each unit may take; only for engines with processes of their own.

    Raises:
        InputError: An object is nowhere, the folder holds something else, or another command is
            at work in it.
        UnfaithfulError: The simulator fails the gate.
        WorkerError: A worker cannot do units for this driver.
    """
    require_pyarrow()
    units = units_of(config)
    _refuse_sources_inside(units, config, folder)
    with alone_in(folder):
        _refuse_others(folder, config)
        staging = Staging(folder.resolve() / "staging")
        if (folder / MANIFEST).is_file():
            staging.remove()
            return _as_built(folder, units)
        write_text(folder / CONFIG, config_to_toml(config))
        staging.clear_unfinished()
        left = [unit for unit in units if not staging.done(unit)]
        for unit in left:
            staging.forget(unit)
        for friction in config.frictions if left else ():
            require_faithful(Setup(), friction)  # what fails at one object's size leaves it out
        drive(left, staging, engine, report, limits)
        finish(config, units, staging, folder)
        return _as_built(folder, units, len(left))


def _refuse_sources_inside(units: Sequence[WorkUnit], config: DatasetConfig, folder: Path) -> None:
    """Refuse to write over what the dataset is made of."""
    sources = [unit.path for unit in units if unit.path is not None]
    sources += [Path(config.contacts).resolve()] if config.contacts else []
    for path in sources:
        if path.is_relative_to(folder.resolve()):
            raise InputError(f"{path}: lies in {folder}; give an --out that holds nothing else")


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder of something else, and remove what a killed build had not finished writing.

    Raises:
        InputError: It holds other files, or a dataset of another configuration.
    """
    stated = folder / CONFIG
    own = OWN if stated.is_file() else ()
    half_written = tuple(f".{name}." for name in OWN)
    for path in sorted(folder.iterdir()):
        if path.name.startswith(half_written):
            path.unlink()
        elif path.name not in own:
            raise InputError(f"{path}: is there, and not of this dataset; give another --out")
    if stated.is_file() and read_text(stated) != config_to_toml(config):
        raise InputError(
            f"{folder}: holds a dataset of another configuration (see its {CONFIG}); give "
            "another --out, or the same settings to go on"
        )


def _as_built(folder: Path, units: Sequence[WorkUnit], made: int = 0) -> Built:
    """What a finished dataset holds.

    Raises:
        InputError: It was made from other meshes or contacts, or by other versions, or damaged.
    """
    manifest = read_manifest(folder)
    if manifest.units_sha256 != units_sha256(units):
        raise InputError(
            f"{folder}: is finished, but its meshes or contacts have changed since, or the "
            "versions of packages; give another --out to make it again"
        )
    for each in manifest.files:
        path = path_inside(folder, each.path)
        if not path.is_file() or path.stat().st_size != each.bytes:
            raise InputError(
                f"{path}: is missing or damaged, though the dataset was finished (see `dataset "
                "verify`); give another --out to make it again"
            )
    return Built(len(units), made, manifest.quarantined, manifest.rows())
