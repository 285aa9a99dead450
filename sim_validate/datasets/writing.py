"""Writes the rows of finished units into the tables of a dataset, and the manifest, which is last.

Rows are sorted by object, then by their table's key, so the files do not depend on when, where or
in which run each unit was computed. Only the rows of one object, and rows that wait to be written,
are in memory.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby, product
from pathlib import Path
from typing import TypeAlias

from grasp_core.files.file_kinds import QUARANTINE
from grasp_core.files.text_files import write_text
from grasp_core.provenance import arithmetic
from sim_validate.datasets.card import card_text
from sim_validate.datasets.columns import dataset_tables
from sim_validate.datasets.config import SPLITS, DatasetConfig
from sim_validate.datasets.given_grasps import given_text
from sim_validate.datasets.hand_files import joint_names, kept_hand
from sim_validate.datasets.layout import CARD, CONFIG, DATA, FILE_FOLDERS, GIVEN_CONTACTS
from sim_validate.datasets.manifest import Listed, Manifest, listed, write_manifest
from sim_validate.datasets.parquet import Tables, joined, write_files
from sim_validate.datasets.quarantine import TWIN, QuarantinedUnit, quarantine_text
from sim_validate.datasets.resuming import OTHER_FILES, Staging, UnitRecord
from sim_validate.datasets.work_units import WorkUnit, provenance, units_sha256

Finished: TypeAlias = tuple[WorkUnit, UnitRecord]


def write_rows(
    folder: Path, config: DatasetConfig, units: Sequence[WorkUnit], staging: Staging,
    hand: Path | None,
) -> Manifest:  # fmt: skip
    """Write the rows and files of all units, and list what is there."""
    for name in (DATA, *FILE_FOLDERS):
        shutil.rmtree(folder / name, ignore_errors=True)
    good, quarantined = _sorted_out(units, staging)
    joints = joint_names(hand)
    groups = config.groups(len(joints))
    about = {"schema": str(Manifest.SCHEMA), "config_sha256": config.sha256}
    tables = _write_tables(dataset_tables(groups, joints), about, good, staging, folder)
    for unit, _ in good:
        shutil.copytree(staging.of(unit) / OTHER_FILES, folder, dirs_exist_ok=True)
    others = [
        folder / CONFIG,
        write_text(folder / QUARANTINE, quarantine_text(quarantined)),
        *_write_given(folder, units),
        *(path for name in FILE_FOLDERS for path in sorted((folder / name).glob("*"))),
        *([] if hand is None else sorted(hand.iterdir())),
    ]
    return Manifest(
        config_sha256=config.sha256,
        versions=dict(provenance()),
        arithmetic=arithmetic(),
        units=len(units),
        units_sha256=units_sha256(units),
        quarantined=len(quarantined),
        groups=groups,
        files=(*tables, *(listed(folder, path) for path in others)),
    )


def _write_given(folder: Path, units: Sequence[WorkUnit]) -> list[Path]:
    given = {each.id: each for unit in units for each in unit.given}
    in_order = [given[name] for name in sorted(given)]
    return [write_text(folder / GIVEN_CONTACTS, given_text(in_order))] if given else []


def write_card_and_manifest(
    folder: Path, config: DatasetConfig, rows: Manifest, hand: Path | None
) -> None:
    """Write the README.md of a dataset, and then the manifest, which marks it as finished."""
    known = None if hand is None else kept_hand(hand)
    card = write_text(folder / CARD, card_text(config, rows, known))
    write_manifest(folder, replace(rows, files=(*rows.files, listed(folder, card))))


def _sorted_out(
    units: Sequence[WorkUnit], staging: Staging
) -> tuple[list[Finished], list[QuarantinedUnit]]:
    """List units with rows of their own, sorted by object, and the reasons why others have none."""
    good, quarantined = list[Finished](), list[QuarantinedUnit]()
    first: dict[tuple[str | None, float], WorkUnit] = {}
    for unit in sorted(units, key=lambda each: (each.label, each.source_sha256, each.friction)):
        record = staging.record(unit)
        reason = record.reason
        if reason is None:
            other = first.setdefault((record.object_id, unit.friction), unit)
            if other.object == unit.object:
                good.append((unit, record))
                continue
            reason = f"{TWIN} {other.label}"
        given = tuple(each.id for each in unit.given)
        quarantined.append(
            QuarantinedUnit(unit.label, unit.source_sha256, unit.friction, given, reason)
        )
    return sorted(good, key=lambda each: (str(each[1].object_id), each[0].friction)), quarantined


def _write_tables(
    tables: Tables,
    about: Mapping[str, str],
    good: Sequence[Finished],
    staging: Staging,
    folder: Path,
) -> list[Listed]:
    found = list[Listed]()
    objects = groupby(good, key=lambda each: (each[1].object_id, each[1].split))
    units = [(split, [unit for unit, _ in same]) for (_, split), same in objects]
    for name, (split, _) in product(tables, SPLITS):
        parts = (
            joined([staging.table(unit, name) for unit in chosen], name, tables)
            for own, of_object in units if own == split
            for chosen in [of_object[:1] if name == "objects" else of_object]
        )  # fmt: skip
        found += [
            replace(listed(folder, path), table=name, split=split, rows=rows)
            for path, rows in write_files(folder / DATA / name, split, parts, about)
        ]
    return found
