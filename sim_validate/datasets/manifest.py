"""The manifest of a dataset: what files there are, and what made them; written last.

A folder without one is no dataset yet. It does not know when or on how many processes it was
made: the same configuration, meshes and versions give the same bytes.
"""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.files import read_text, write_text

SCHEMA = 1
MANIFEST = "manifest.json"


@dataclass(frozen=True, slots=True)
class Listed:
    """One file of a dataset."""

    path: str
    """In the dataset's folder."""
    bytes: int
    sha256: str
    table: Name | None = None
    """That it is a part of, if of any."""
    split: str | None = None
    """That its rows are of."""
    rows: int | None = None


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a dataset consists of."""

    config_sha256: str
    versions: dict[str, str]
    """Of packages, of the interpreter, and the hash of our own code."""
    arithmetic: str
    """A hash of how the driver's processor rounds."""
    units: int
    """Objects at frictions that were asked for; given grasps in parts."""
    units_sha256: str
    """Of the names of all units, which depend on all that decides rows."""
    quarantined: int
    """Of them, those that were left out."""
    files: tuple[Listed, ...]
    schema: int = SCHEMA

    def rows(self) -> dict[Name, int]:
        """How many rows each table has."""
        return {name: sum(each.rows or 0 for each in self.of_table(name)) for name in TABLES}

    def of_table(self, name: Name) -> tuple[Listed, ...]:
        """The files of a table."""
        return tuple(each for each in self.files if each.table == name)


def listed(folder: Path, path: Path) -> Listed:
    """A file as the manifest has it."""
    digest, size = hashlib.sha256(), 0
    with path.open("rb") as stream:
        while part := stream.read(2**20):
            digest.update(part)
            size += len(part)
    return Listed(path.relative_to(folder).as_posix(), size, digest.hexdigest())


def write_manifest(folder: Path, manifest: Manifest) -> Path:
    """Make a folder a dataset."""
    record = asdict(manifest)
    record["files"] = [
        {name: value for name, value in asdict(each).items() if value is not None}
        for each in sorted(manifest.files, key=lambda each: each.path)
    ]
    text = json.dumps(record, indent=1, sort_keys=True) + "\n"
    return write_text(folder / MANIFEST, text)


def read_manifest(folder: Path) -> Manifest:
    """The manifest of a dataset.

    Raises:
        InputError: There is none, or it is not as this version writes them.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(f"{folder}: no dataset, or one that is not finished: no {MANIFEST}")
    try:
        found: object = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON ({error})") from error
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected an object")
    record = cast("dict[str, Any]", found)
    if record.get("schema") != SCHEMA or not isinstance(record.get("files"), list):
        raise InputError(f"{path}: expected schema {SCHEMA}, got {record.get('schema')!r}")
    try:
        files = tuple(Listed(**each) for each in record["files"])
        return Manifest(**cast("dict[str, Any]", {**record, "files": files}))
    except TypeError as error:
        raise InputError(f"{path}: not a manifest of schema {SCHEMA} ({error})") from error
