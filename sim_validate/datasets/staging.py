"""Keeps finished units of work in a staging folder: one subfolder per unit, renamed in one step.

A unit that was killed leaves only a temporary folder, which the next run removes. So every
subfolder is complete, and a resumed build repeats only the units that were under way.
"""

import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grasp_core.checked import shown
from grasp_core.declared import FieldError
from grasp_core.errors import InputError
from grasp_core.files.records import RecordFile
from grasp_core.files.text_files import read_bytes
from sim_validate.datasets.make_unit import Made
from sim_validate.datasets.parquet import parquet_bytes
from sim_validate.datasets.rows import dataset_tables
from sim_validate.datasets.tables import Name, SplitName
from sim_validate.datasets.units import WorkUnit
from sim_validate.kit.files import path_inside

HASH = re.compile(r"[0-9a-f]{64}")
OTHERS = "others"
"""Subfolder for those files of a unit that are not tables."""
UNFINISHED = "."
"""First character of the names of temporary folders."""
MOST_BYTES = 2**31
"""Largest size of one file of a unit."""


@dataclass(frozen=True, slots=True)
class UnitRecord(RecordFile):
    """Record of a finished unit of work: where its rows belong, or why it has none."""

    FILE = "unit.json"
    SCHEMA = 1

    object: str
    friction: float
    files: Mapping[str, str]
    """SHA-256 of each file, by its path in the unit's folder."""
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
class Finished:
    """A finished unit of work that has rows."""

    unit: WorkUnit
    object_id: str
    split: SplitName


@dataclass(frozen=True, slots=True)
class Staging:
    """The folder that holds finished units of work until the dataset is complete."""

    folder: Path

    def clear_unfinished(self) -> None:
        """Remove what killed units left; this is safe only when no unit is under way."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for path in self.folder.iterdir():
            if path.name.startswith(UNFINISHED):
                # a worker process of a killed build may still write here
                shutil.rmtree(path, ignore_errors=True)

    def remove(self) -> None:
        """Remove the whole staging folder, once a finished dataset holds its contents."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, unit: WorkUnit, made: Made) -> None:
        """Keep the rows and files of a finished unit."""
        kinds = dataset_tables(unit.config.groups)
        tables = {
            _file(name): parquet_bytes(name, made.rows.cells(name, columns), {}, kinds)
            for name, columns in kinds.items()
        }
        others = {f"{OTHERS}/{path}": text.encode() for path, text in made.files.items()}
        (row,) = made.rows.objects
        self._put(unit, {**tables, **others}, object_id=row.object_id, split=row.split)

    def quarantine(self, unit: WorkUnit, reason: str) -> None:
        """Record that a unit cannot be computed, with the reason."""
        self._put(unit, {}, reason=reason)

    def result(self, unit: WorkUnit) -> Finished | str:
        """Look up how a unit ended: with its object and split, or with a reason for no rows."""
        record = self._record(unit)
        if record.object_id is None or record.split is None:
            return record.reason or ""
        return Finished(unit, record.object_id, record.split)

    def done(self, unit: WorkUnit) -> bool:
        """Tell whether a unit is finished or quarantined, and all its files are as written."""
        try:
            record = self._record(unit)
            return all(
                _sha256(read_bytes(path_inside(self._of(unit), name), MOST_BYTES)) == sha256
                for name, sha256 in record.files.items()
            )
        except (OSError, InputError):
            return False

    def finished(self, unit: WorkUnit) -> bool:
        """Tell whether a unit has a folder, with its rows or the reason why it has none."""
        return self._of(unit).is_dir()

    def table(self, unit: WorkUnit, name: Name) -> Path:
        """Return the path of a finished unit's rows in one of the tables."""
        return self._of(unit) / _file(name)

    def copy_files(self, unit: WorkUnit, folder: Path) -> None:
        """Copy the files that a finished unit made besides its rows into the dataset."""
        shutil.copytree(self._of(unit) / OTHERS, folder, dirs_exist_ok=True)

    def forget(self, unit: WorkUnit) -> None:
        """Remove the results of a unit whose files are damaged."""
        shutil.rmtree(self._of(unit), ignore_errors=True)

    def _of(self, unit: WorkUnit) -> Path:
        return self.folder / unit.id

    def _record(self, unit: WorkUnit) -> UnitRecord:
        return UnitRecord.read(self._of(unit) / UnitRecord.FILE)

    def _put(self, unit: WorkUnit, files: Mapping[str, bytes], **more: Any) -> None:
        hashes = {name: _sha256(data) for name, data in files.items()}
        record = UnitRecord(unit.object, unit.friction, hashes, **more)
        made = Path(tempfile.mkdtemp(dir=self.folder, prefix=f"{UNFINISHED}{unit.id}."))
        try:
            for name, data in {**files, record.FILE: record.text().encode()}.items():
                path = made / name
                path.parent.mkdir(parents=True, exist_ok=True)
                with path.open("wb") as stream:
                    stream.write(data)
                    stream.flush()
                    os.fsync(stream.fileno())
            made.rename(self._of(unit))
        except OSError:
            shutil.rmtree(made, ignore_errors=True)
            if not self.done(unit):  # otherwise another attempt was faster and wrote the same rows
                raise


def _file(name: Name) -> str:
    return f"{name}.parquet"


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
