"""From a configuration to a finished dataset in a folder; what was done before is not done again.

The manifest is written last; once it is there, the staging folder goes.
"""

import fcntl
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from grasp_core.errors import InputError
from sim_validate.datasets.card import CARD
from sim_validate.datasets.columns import Name
from sim_validate.datasets.config import DatasetConfig, config_to_toml
from sim_validate.datasets.croissant import CROISSANT
from sim_validate.datasets.driver import Engine, drive
from sim_validate.datasets.finish import CONTACTS, DATA, EXTRAS, finish
from sim_validate.datasets.manifest import MANIFEST, read_manifest
from sim_validate.datasets.staging import Staging
from sim_validate.datasets.tables import require_pyarrow
from sim_validate.datasets.tasks import Limits
from sim_validate.datasets.units import units_of
from sim_validate.files import read_text, write_text
from sim_validate.gate import require_faithful
from sim_validate.setup import Setup

OWN = (
    "staging", DATA, *EXTRAS, CONTACTS, "config.toml", "quarantine.jsonl", CARD, CROISSANT,
    MANIFEST, ".lock",
)  # fmt: skip
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
        InputError: An object is nowhere, the folder holds something else, or another build is at
            work in it.
        UnfaithfulError: The simulator fails the gate.
        WorkerError: A worker cannot do units for this driver.
    """
    require_pyarrow()
    units = units_of(config)
    with _alone(folder):
        _refuse_others(folder, config)
        if (folder / MANIFEST).is_file():
            return _as_built(folder, len(units))
        write_text(folder / "config.toml", config_to_toml(config))
        staging = Staging(folder.resolve() / "staging")
        staging.clear_unfinished()
        left = [unit for unit in units if not staging.done(unit)]
        for unit in left:
            staging.forget(unit)
        for friction in config.frictions if left else ():
            require_faithful(Setup(), friction)  # what fails at one object's size leaves it out
        drive(left, staging, engine, report, limits)
        finish(config, units, staging, folder)
        return _as_built(folder, len(units), len(left))


@contextmanager
def _alone(folder: Path) -> Generator[None]:
    """Keep other builds out of a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise InputError(f"{folder}: another build is at work in it") from error
        yield


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder of something else.

    Raises:
        InputError: It holds other files, or a dataset of another configuration.
    """
    if others := sorted({path.name for path in folder.iterdir()} - set(OWN)):
        raise InputError(f"{folder}: holds {others[0]}, which no dataset does; give another --out")
    stated = folder / "config.toml"
    if stated.is_file() and read_text(stated) != config_to_toml(config):
        raise InputError(
            f"{folder}: holds a dataset of another configuration (see its config.toml); give "
            "another --out, or the same settings to go on"
        )


def _as_built(folder: Path, units: int, made: int = 0) -> Built:
    manifest = read_manifest(folder)
    return Built(units, made, manifest.quarantined, manifest.rows())
