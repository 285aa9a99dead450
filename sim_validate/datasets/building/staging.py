"""What is done so far, in a folder: a subfolder for each finished unit, put there in one step.

A unit that was killed leaves nothing but a temporary folder, which the next run removes. So what is
there is whole, and a run that is started again redoes no more than what was under way.
"""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from grasp_core.errors import InputError
from grasp_core.files.complaints import record_of
from sim_validate.datasets.building.make_unit import Made
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.datasets.parquet import parquet_bytes
from sim_validate.datasets.units import WorkUnit
from sim_validate.files.paths import path_inside
from sim_validate.files.reading import read_bytes, read_text

RECORD = "unit.json"
OTHERS = "others"
"""Folder of what is no table."""
UNFINISHED = "."
"""First letter of the names of temporary folders."""


MOST_BYTES = 2**31
"""Of one file of a unit."""


class UnitRecord(BaseModel):
    """What is noted of a unit: where its rows belong, or why it has none."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    object: str
    friction: float
    files: dict[str, str]
    """Hashes, by path in the unit's folder."""
    object_id: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None
    split: Literal["train", "validation", "test"] | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class Finished:
    """A unit that has rows."""

    unit: WorkUnit
    object_id: str
    split: str


@dataclass(frozen=True, slots=True)
class Staging:
    """The folder of finished units."""

    folder: Path

    def clear_unfinished(self) -> None:
        """Remove what killed units left; only when none is under way."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for path in self.folder.iterdir():
            if path.name.startswith(UNFINISHED):
                shutil.rmtree(path, ignore_errors=True)  # a worker of a killed driver may be at it

    def remove(self) -> None:
        """Remove everything, when it is in a finished dataset."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, unit: WorkUnit, made: Made) -> None:
        """Keep what came of a finished unit."""
        tables = {_file(name): parquet_bytes(name, made.rows[name], {}) for name in TABLES}
        others = {f"{OTHERS}/{path}": text.encode() for path, text in made.files.items()}
        about = {"object_id": made.object_id, "split": made.split}
        self._put(unit, {**tables, **others}, about)

    def quarantine(self, unit: WorkUnit, reason: str) -> None:
        """Note that a unit cannot be done."""
        self._put(unit, {}, {"reason": reason})

    def result(self, unit: WorkUnit) -> Finished | str:
        """What a unit came to, or why it cannot be done.

        Raises:
            InputError: Its record is damaged.
        """
        record = self._record(unit)
        if record.reason is not None:
            return record.reason
        if record.object_id is None or record.split is None:
            raise InputError(f"{self._of(unit) / RECORD}: neither rows nor a reason; build again")
        return Finished(unit, record.object_id, record.split)

    def done(self, unit: WorkUnit) -> bool:
        """Whether a unit is finished or quarantined, and all its files are as they were written."""
        try:
            record = self._record(unit)
            self.result(unit)  # or it says nothing
            return all(
                _sha256(read_bytes(path_inside(self._of(unit), name), MOST_BYTES)) == sha256
                for name, sha256 in record.files.items()
            )
        except (OSError, InputError):
            return False

    def finished(self, unit: WorkUnit) -> bool:
        """Whether there is anything of a unit: its rows, or why there are none."""
        return self._of(unit).is_dir()

    def table(self, unit: WorkUnit, name: Name) -> Path:
        """The file of a finished unit's rows in one of the tables."""
        return self._of(unit) / _file(name)

    def copy_files(self, unit: WorkUnit, folder: Path) -> None:
        """Put what a finished unit made beside its rows into the dataset."""
        shutil.copytree(self._of(unit) / OTHERS, folder, dirs_exist_ok=True)

    def forget(self, unit: WorkUnit) -> None:
        """Remove what there is of a unit that is not done: damaged files."""
        shutil.rmtree(self._of(unit), ignore_errors=True)

    def _of(self, unit: WorkUnit) -> Path:
        return self.folder / unit.id

    def _record(self, unit: WorkUnit) -> "UnitRecord":
        path = self._of(unit) / RECORD
        text = read_text(path)
        try:
            return record_of(UnitRecord, text, RECORD)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def _put(self, unit: WorkUnit, files: Mapping[str, bytes], more: Mapping[str, str]) -> None:
        record = {
            "object": unit.object,
            "friction": unit.friction,
            "files": {name: _sha256(data) for name, data in files.items()},
            **more,
        }
        made = Path(tempfile.mkdtemp(dir=self.folder, prefix=f"{UNFINISHED}{unit.id}."))
        try:
            for name, data in {**files, RECORD: json.dumps(record).encode()}.items():
                path = made / name
                path.parent.mkdir(parents=True, exist_ok=True)
                with path.open("wb") as stream:
                    stream.write(data)
                    stream.flush()
                    os.fsync(stream.fileno())
            made.rename(self._of(unit))
        except OSError:
            shutil.rmtree(made, ignore_errors=True)
            if not self.done(unit):  # else another attempt was faster, with the same rows
                raise


def _file(name: Name) -> str:
    return f"{name}.parquet"


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
