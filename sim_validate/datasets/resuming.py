"""Keeps finished units of work in a staging folder, from which an interrupted build is resumed.

Each unit has a subfolder, renamed in one step, so every subfolder is complete, and a resumed build
repeats only the units that were under way.
"""

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import UNIT
from grasp_core.files.records import RecordFile
from grasp_core.messages import FieldError, shown
from sim_validate.datasets.columns import dataset_tables
from sim_validate.datasets.config import SplitName, TableName
from sim_validate.datasets.hand_files import joint_names
from sim_validate.datasets.making_rows import UnitRows
from sim_validate.datasets.manifest import Listed, listed
from sim_validate.datasets.parquet import parquet_bytes
from sim_validate.datasets.work_units import WorkUnit
from sim_validate.files.output_folders import whole_folder

HASH = re.compile(r"[0-9a-f]{64}")
OTHER_FILES = "others"


@declared
class UnitRecord(RecordFile):
    """Record of a finished unit of work: where its rows belong, or why it has none."""

    FILE = UNIT
    SCHEMA = 2

    object: str
    friction: float
    files: tuple[Listed, ...]
    """Files of the unit's folder."""
    object_id: str | None = None
    """Hash of the object's mesh, in whose table its row is; None if there are no rows."""
    split: SplitName | None = None
    reason: str | None = None
    """Why there are no rows; None if there are."""

    def _check_together(self) -> None:
        there = (self.object_id is not None, self.split is not None, self.reason is None)
        if len(set(there)) > 1:
            raise InputError(
                "expected an object_id and a split, or else a reason for having no rows; remove "
                "the folder and build again"
            )
        if self.object_id is not None and not HASH.fullmatch(self.object_id):
            raise FieldError("object_id", f"must be a SHA-256 hash, got {shown(self.object_id)}")


@dataclass(frozen=True, slots=True)
class Staging:
    """The folder that holds finished units of work until the dataset is complete."""

    folder: Path

    def remove(self) -> None:
        """Remove the whole staging folder, once a finished dataset holds its contents."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, unit: WorkUnit, made: UnitRows) -> None:
        """Keep the rows and files of a finished unit."""
        kinds, rows = dataset_tables(unit.groups, joint_names(unit.hand)), made.rows
        tables = {
            f"{name}.parquet": parquet_bytes(name, rows.cells(name, columns), kinds)
            for name, columns in kinds.items()
        }
        others = {f"{OTHER_FILES}/{path}": text.encode() for path, text in made.files.items()}
        (row,) = rows.objects
        self._put(unit, {**tables, **others}, object_id=row.object_id, split=row.split)

    def quarantine(self, unit: WorkUnit, reason: str) -> None:
        """Record that a unit cannot be computed, with the reason, which names no folder."""
        self._put(unit, {}, reason=reason.replace(str(unit.path or unit.label), unit.label))

    def record(self, unit: WorkUnit) -> UnitRecord:
        """Look up how a unit ended: with its object and split, or with a reason for no rows."""
        return UnitRecord.read(self.of(unit) / UnitRecord.FILE)

    def unfinished(self, units: Sequence[WorkUnit]) -> list[WorkUnit]:
        """List the units that no earlier build has finished, and remove damaged rests of them."""
        self.folder.mkdir(exist_ok=True)
        found = [unit for unit in units if not self.is_finished(unit)]
        for unit in found:
            shutil.rmtree(self.of(unit), ignore_errors=True)
        return found

    def is_finished(self, unit: WorkUnit) -> bool:
        """Tell whether a unit is finished or quarantined, and all its files are as written."""
        try:
            return not any(each.fault(self.of(unit)) for each in self.record(unit).files)
        except (OSError, InputError):
            return False

    def table(self, unit: WorkUnit, name: TableName) -> Path:
        """Return the path of a finished unit's rows in one of the tables."""
        return self.of(unit) / f"{name}.parquet"

    def of(self, unit: WorkUnit) -> Path:
        """Return the folder of a finished unit, with its rows or the reason why it has none."""
        return self.folder / unit.id

    def _put(self, unit: WorkUnit, files: Mapping[str, bytes], **more: Any) -> None:
        try:
            with whole_folder(self.of(unit)) as made:
                kept = tuple(listed(made, _kept(made / name, data)) for name, data in files.items())
                record = UnitRecord(unit.object, unit.friction, kept, **more)
                _kept(made / record.FILE, record.text().encode())
        except (OSError, InputError):
            if not self.is_finished(unit):
                raise  # otherwise another attempt was faster and wrote the same rows


def _kept(path: Path, data: bytes) -> Path:
    """Write a file so that it outlasts a loss of power."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    return path
