"""The manifest of a dataset: its files, and the versions that made them; written last.

A folder without a manifest is no dataset yet. The manifest does not say when or with how many
processes the dataset was made: equal configuration, meshes and versions give equal bytes.
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
    """Path in the dataset's folder."""
    bytes: Count
    sha256: str
    table: Name | None = None
    """Table that the file is a part of, if any."""
    split: str | None = None
    """Split that its rows belong to, if any."""
    rows: Count | None = None


@dataclass(frozen=True, slots=True, config=STRICT)
class Manifest:
    """What a dataset consists of."""

    config_sha256: str
    versions: dict[str, str]
    """Versions of the packages and of the interpreter, and the hash of this project's code."""
    arithmetic: str
    """Hash of how the driver's processor rounds."""
    units: Count
    """Number of objects at frictions that were asked for; many given grasps count in parts."""
    units_sha256: str
    """Hash of the names of all units, which depend on everything that decides rows."""
    quarantined: Count
    """Number of units that were left out."""
    files: tuple[Listed, ...]
    schema: int = SCHEMA

    def rows(self) -> dict[Name, int]:
        """The number of rows of each table."""
        return {name: sum(each.rows or 0 for each in self.of_table(name)) for name in TABLES}

    def of_table(self, name: Name) -> tuple[Listed, ...]:
        """The files of a table."""
        return tuple(each for each in self.files if each.table == name)


def listed(folder: Path, path: Path) -> Listed:
    """Describe a file as the manifest lists it."""
    digest, size = hashlib.sha256(), 0
    with path.open("rb") as stream:
        while part := stream.read(2**20):
            digest.update(part)
            size += len(part)
    return Listed(path.relative_to(folder).as_posix(), size, digest.hexdigest())


def write_manifest(folder: Path, manifest: Manifest) -> Path:
    """Write the manifest, which makes a folder a dataset."""
    return write_text(folder / MANIFEST, manifest_to_json(manifest))


def manifest_to_json(manifest: Manifest) -> str:
    """The text of a manifest; equal manifests give equal texts."""
    record = asdict(manifest)
    record["files"] = [
        {name: value for name, value in asdict(each).items() if value is not None}
        for each in sorted(manifest.files, key=lambda each: each.path)
    ]
    return json.dumps(record, indent=1, sort_keys=True) + "\n"


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a dataset.

    Raises:
        InputError: The folder has none, or it is not as this version writes them.
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
    """Parse the text of a manifest.

    Raises:
        InputError: The text is not as this version writes it; the message names the field.
    """
    object_of(text, MANIFEST, schema=SCHEMA)
    try:
        found = TypeAdapter(Manifest).validate_json(text)
    except ValidationError as error:
        raise InputError(complaint(error, Manifest)) from error
    for i, each in enumerate(found.files):
        require_inside(each.path, place(["files", i, "path"]))
    if len({each.path for each in found.files}) < len(found.files):
        raise InputError("files: a path is listed twice")
    return found
