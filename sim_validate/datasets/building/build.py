"""Builds a dataset in a folder; work finished by an earlier, interrupted build is not repeated.

The manifest, which lists all files, is written last; then the staging folder is removed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.text_files import read_text, write_text
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
from sim_validate.datasets.manifest import MANIFEST, read_manifest
from sim_validate.datasets.parquet import pyarrow
from sim_validate.datasets.units import WorkUnit, units_of, units_sha256
from sim_validate.files.paths import path_inside
from sim_validate.files.result_folders import alone_in
from sim_validate.simulation.gate import require_faithful
from sim_validate.simulation.setup import Setup

OWN = ("staging", DATA, *EXTRAS, CONTACTS, CONFIG, QUARANTINE, CARD, MANIFEST)
"""Names of all files and folders that the folder of a dataset may hold."""


@dataclass(frozen=True, slots=True)
class Built:
    """The result of a build: how many units of work and rows the dataset has."""

    units: int
    made: int
    """Number of units of work that were computed in this run."""
    quarantined: int
    rows: dict[Name, int]


def build(
    config: DatasetConfig,
    folder: Path,
    engine: Engine,
    report: Callable[[int, int], None],
    limits: Limits | None = None,
) -> Built:
    """Build a dataset, or resume an interrupted build.

    Takes `report` (finished, total).
    """
    pyarrow()  # before any work, so that a missing library is named at once
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
            # a gate that fails at one object's size only leaves that object out
            require_faithful(Setup(), friction)
        drive(left, staging, engine, report, limits)
        finish(config, units, staging, folder)
        return _as_built(folder, units, len(left))


def _refuse_sources_inside(units: Sequence[WorkUnit], config: DatasetConfig, folder: Path) -> None:
    """Refuse an output folder that holds the meshes or contacts that the dataset is made of."""
    sources = [unit.path for unit in units if unit.path is not None]
    sources += [Path(config.contacts).resolve()] if config.contacts else []
    for path in sources:
        if path.is_relative_to(folder.resolve()):
            raise InputError(
                f"{path}: this input lies in the output folder {folder}; give another --out"
            )


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder with other files, and remove half-written files of a killed build."""
    stated = folder / CONFIG
    own = OWN if stated.is_file() else ()
    half_written = tuple(f".{name}." for name in OWN)
    for path in sorted(folder.iterdir()):
        if path.name.startswith(half_written):
            path.unlink()
        elif path.name not in own:
            raise InputError(
                f"{path}: this file is not part of the dataset to write; give an empty or new "
                "folder as --out"
            )
    if stated.is_file() and read_text(stated) != config_to_toml(config):
        raise InputError(
            f"{folder}: the folder holds a dataset made with other settings (see its {CONFIG}); "
            "give another --out, or the same settings to resume that dataset"
        )


def _as_built(folder: Path, units: Sequence[WorkUnit], made: int = 0) -> Built:
    """Describe a finished dataset, after a check that it is the one asked for."""
    manifest = read_manifest(folder)
    if manifest.units_sha256 != units_sha256(units):
        raise InputError(
            f"{folder}: this dataset is finished, but its meshes, contacts or package versions "
            "have changed since then; give another --out to make it again"
        )
    for each in manifest.files:
        path = path_inside(folder, each.path)
        if not path.is_file() or path.stat().st_size != each.bytes:
            raise InputError(
                f"{path}: this file of a finished dataset is missing or damaged (see `dataset "
                "verify`); give another --out to make it again"
            )
    return Built(len(units), made, manifest.quarantined, manifest.rows())
