"""The manifest of a dataset: what files there are, and what made them; written last.

A folder without one is no dataset yet. It does not know when or on how many processes it was
made: the same configuration, meshes and versions give the same bytes.
"""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from grasp_core.errors import InputError
from grasp_core.files.complaints import complaint
from grasp_core.files.strict_json import object_of, place
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.files.paths import require_inside
from sim_validate.files.reading import read_text, write_text

SCHEMA = 1
MANIFEST = "manifest.json"
STRICT = ConfigDict(strict=True, extra="forbid")
Count = Annotated[int, Field(ge=0)]


@dataclass(frozen=True, slots=True, config=STRICT)
class Listed:
    """One file of a dataset."""

    path: str
    """In the dataset's folder."""
    bytes: Count
    sha256: str
    table: Name | None = None
    """That it is a part of, if of any."""
    split: str | None = None
    """That its rows are of."""
    rows: Count | None = None


@dataclass(frozen=True, slots=True, config=STRICT)
class Manifest:
    """What a dataset consists of."""

    config_sha256: str
    versions: dict[str, str]
    """Of packages, of the interpreter, and the hash of our own code."""
    arithmetic: str
    """A hash of how the driver's processor rounds."""
    units: Count
    """Objects at frictions that were asked for; given grasps in parts."""
    units_sha256: str
    """Of the names of all units, which depend on all that decides rows."""
    quarantined: Count
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
    return write_text(folder / MANIFEST, manifest_to_json(manifest))


def manifest_to_json(manifest: Manifest) -> str:
    """The text of a manifest: the same for the same files."""
    record = asdict(manifest)
    record["files"] = [
        {name: value for name, value in asdict(each).items() if value is not None}
        for each in sorted(manifest.files, key=lambda each: each.path)
    ]
    return json.dumps(record, indent=1, sort_keys=True) + "\n"


def read_manifest(folder: Path) -> Manifest:
    """The manifest of a dataset.

    Raises:
        InputError: There is none, or it is not as this version writes them.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(f"{folder}: no dataset, or one that is not finished: no {MANIFEST}")
    text = read_text(path)
    try:
        return manifest_from_json(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def manifest_from_json(text: str) -> Manifest:
    """The manifest that a text is.

    Raises:
        InputError: It is not as this version writes them; the message names the field.
    """
    object_of(text, MANIFEST, schema=SCHEMA)
    try:
        found = TypeAdapter(Manifest).validate_json(text)
    except ValidationError as error:
        raise InputError(complaint(error, Manifest)) from error
    for i, each in enumerate(found.files):
        require_inside(each.path, place(["files", i, "path"]))
    if len({each.path for each in found.files}) < len(found.files):
        raise InputError("files: a path is there twice")
    return found
