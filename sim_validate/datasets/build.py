"""Builds a dataset in a folder; work finished by an earlier, interrupted build is not repeated."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from grasp_core.errors import InputError
from grasp_core.files.file_kinds import MANIFEST
from grasp_core.files.text_files import read_text, write_text
from grasp_core.names import HANDS
from sim_validate.datasets.computing import Engine, compute_all, compute_unit
from sim_validate.datasets.config import DatasetConfig, config_to_toml, settings_text
from sim_validate.datasets.hand_files import HandFiles
from sim_validate.datasets.layout import CONFIG, OWN_FILES, STAGING_FOLDER
from sim_validate.datasets.manifest import Manifest, path_inside, read_manifest
from sim_validate.datasets.parquet import pyarrow
from sim_validate.datasets.resuming import Staging
from sim_validate.datasets.work_units import WorkUnit, units_of, units_sha256
from sim_validate.datasets.writing import write_card_and_manifest, write_rows
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.setup import Setup
from sim_validate.files.locks import entries
from sim_validate.files.output_folders import alone_in


class Built(NamedTuple):
    """The result of a build."""

    manifest: Manifest
    made: int
    """Number of units of work that were computed in this run."""


def build(
    config: DatasetConfig,
    folder: Path,
    engine: Engine,
    report: Callable[[int, int], None],
    timeout_s: float | None = None,
) -> Built:
    """Build a dataset, or resume an interrupted build; `report` takes (finished, total)."""
    pyarrow()  # before any work, so that a missing library is named at once
    hand = None if config.hand is None else HandFiles.of(config.hand, folder)
    place = None if hand is None else hand.folder(folder)
    units = units_of(config, place)
    _refuse_sources_inside(units, config, folder)
    with alone_in(folder):
        _refuse_others(folder, config)
        staging, unfinished = Staging(folder.resolve() / STAGING_FOLDER), list[WorkUnit]()
        if not (folder / MANIFEST).is_file():
            write_text(folder / CONFIG, config_to_toml(config))
            if hand is not None:
                hand.keep(folder)
            unfinished = staging.unfinished(units)  # an interrupted build is resumed with these
            _check_simulator(config, unfinished)
            compute_all(unfinished, staging, engine, report, timeout_s, compute_unit)
            rows = write_rows(folder, config, units, staging, place)
            write_card_and_manifest(folder, config, rows, place)
        staging.remove()
        manifest = read_manifest(folder)
        _check_manifest(manifest, folder, units)
        return Built(manifest, len(unfinished))


def _refuse_sources_inside(units: Sequence[WorkUnit], config: DatasetConfig, folder: Path) -> None:
    sources = [unit.path for unit in units if unit.path is not None]
    sources += [Path(config.contacts).resolve()] if config.contacts else []
    if config.hand is not None and config.hand.hand not in HANDS:
        sources.append(Path(config.hand.hand).resolve())
    for path in sources:
        if path.is_relative_to(folder.resolve()):
            raise InputError(
                f"{path}: this input lies in the output folder {folder}; give another --out"
            )


SCHEMA_LINE = re.compile(r"\A#:schema .*\n")
"""Pattern of the first line of a configuration, which decides nothing."""


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder with other files, and remove half-written files of a killed build."""
    stated = folder / CONFIG
    own = OWN_FILES if stated.is_file() else ()
    half_written = tuple(f".{name}." for name in OWN_FILES)
    for path in entries(folder):
        if path.name.startswith(half_written):
            path.unlink()
        elif path.name not in own:
            raise InputError(
                f"{path}: this file is not part of the dataset to write; give an empty or new "
                "folder as --out"
            )
    if stated.is_file() and SCHEMA_LINE.sub("", read_text(stated)) != settings_text(config):
        raise InputError(
            f"{folder}: the folder holds a dataset made with other settings (see its {CONFIG}); "
            "give another --out, or the same settings to resume that dataset"
        )


def _check_simulator(config: DatasetConfig, units: Sequence[WorkUnit]) -> None:
    """Check the simulator on known cases; one that fails at an object's size leaves that out."""
    for friction in config.frictions if units else ():
        checked(ClosureCase.of(Setup(), friction))


def _check_manifest(manifest: Manifest, folder: Path, units: Sequence[WorkUnit]) -> None:
    if manifest.units_sha256 != units_sha256(units):
        raise InputError(
            f"{folder}: this dataset is finished, but its meshes, contacts, hand or package "
            "versions have changed since then; give another --out to make it again"
        )
    for each in manifest.files:
        path = path_inside(folder, each.path)
        if not path.is_file() or path.stat().st_size != each.bytes:
            raise InputError(
                f"{path}: this file of a finished dataset is missing or damaged (see `dataset "
                "verify`); give another --out to make it again"
            )
