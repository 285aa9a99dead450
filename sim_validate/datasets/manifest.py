"""Reads and writes the manifest of a dataset, and the list of what was left out of it.

The manifest names all files, and the versions that made them. A folder without one is no finished
dataset, as it is written last. It does not say when or with how many processes the dataset was
made: equal configuration, meshes and versions give equal bytes.
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, field
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import complaint, object_of, place, record_of, shown
from grasp_core.files.text_files import read_text, write_text
from sim_validate.datasets.tables import GROUPS, Name, Tables, dataset_tables
from sim_validate.kit.paths import require_inside

SCHEMA = 2
MANIFEST = "manifest.json"
STRICT = ConfigDict(strict=True, extra="forbid")
Count = Annotated[int, Field(ge=0)]


@dataclass(frozen=True, slots=True, config=STRICT)
class Listed:
    """One file of a dataset, as the manifest lists it."""

    path: str
    """Path of the file in the dataset's folder."""
    bytes: Count
    sha256: str
    table: Name | None = None
    """Table that the file is a part of; None for other files."""
    split: str | None = None
    """Split that the file's rows belong to; None for other files."""
    rows: Count | None = None


@dataclass(frozen=True, slots=True, config=STRICT)
class Manifest:
    """The files of a dataset, and all that decided their contents."""

    config_sha256: str
    versions: dict[str, str]
    """Versions of the packages and of the interpreter, and the hash of this project's code."""
    arithmetic: str
    """Hash that tells how the processor rounded that ran the build."""
    units: Count
    """Number of units of work: objects at frictions; many given grasps make several units."""
    units_sha256: str
    """Hash of the names of all units of work, which depend on everything that decides rows."""
    quarantined: Count
    """Number of units of work that were left out."""
    files: tuple[Listed, ...]
    schema: int = SCHEMA
    executed: bool = False
    """Whether the dataset has executions; a manifest without them does not mention this."""

    groups: dict[str, Count] = field(default_factory=dict[str, Count])
    """Groups of columns that the dataset has on request, with their sizes; a manifest without any
    does not mention this."""

    def __post_init__(self) -> None:
        if unknown := [name for name in self.groups if name not in GROUPS]:
            raise InputError(
                f"groups: expected some of {', '.join(GROUPS)}, got {shown(unknown[0])}"
            )

    @property
    def tables(self) -> Tables:
        """Tables of the dataset, with their columns."""
        return dataset_tables(executed=self.executed, groups=self.groups)

    def rows(self) -> dict[Name, int]:
        """Number of rows of each table."""
        return {name: sum(each.rows or 0 for each in self.of_table(name)) for name in self.tables}

    def of_table(self, name: Name) -> tuple[Listed, ...]:
        """List the files of a table."""
        return tuple(each for each in self.files if each.table == name)


def listed(folder: Path, path: Path) -> Listed:
    """Describe a file as the manifest lists it: path, size and hash."""
    digest, size = hashlib.sha256(), 0
    with path.open("rb") as stream:
        while part := stream.read(2**20):
            digest.update(part)
            size += len(part)
    return Listed(path.relative_to(folder).as_posix(), size, digest.hexdigest())


def write_manifest(folder: Path, manifest: Manifest) -> Path:
    """Write the manifest of a dataset, whose presence marks the dataset as finished."""
    return write_text(folder / MANIFEST, manifest_to_json(manifest))


def manifest_to_json(manifest: Manifest) -> str:
    """Write the text of a manifest; equal manifests give equal texts."""
    record = asdict(manifest)
    if not manifest.executed:
        del record["executed"]
    if not manifest.groups:
        del record["groups"]
    record["files"] = [
        {name: value for name, value in asdict(each).items() if value is not None}
        for each in sorted(manifest.files, key=lambda each: each.path)
    ]
    return json.dumps(record, indent=1, sort_keys=True) + "\n"


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a dataset."""
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(
            f"{folder}: expected a finished dataset, but {MANIFEST} is missing; run `graspproof "
            "dataset build` to the end"
        )
    text = read_text(path)
    with about(path):
        return manifest_from_json(text)


def manifest_from_json(text: str) -> Manifest:
    """Parse the text of a manifest."""
    object_of(text, MANIFEST, schema=SCHEMA)
    try:
        found = TypeAdapter(Manifest).validate_json(text)
    except ValidationError as error:
        raise InputError(complaint(error, Manifest)) from error
    for i, each in enumerate(found.files):
        require_inside(each.path, place(["files", i, "path"]))
    if len({each.path for each in found.files}) < len(found.files):
        raise InputError("files: expected every path only once, got one path twice")
    return found


class LeftOut(BaseModel):
    """A unit of work without rows, with the reason."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    object: str
    source_sha256: str
    friction: float
    given: list[str]
    """Ids of the given grasps that have no rows, if the unit is about given grasps."""
    reason: str


def left_out_text(units: Iterable[LeftOut]) -> str:
    """Write the text of `quarantine.jsonl`, one line per unit of work without rows."""
    return "".join(json.dumps(each.model_dump(), sort_keys=True) + "\n" for each in units)


def read_left_out(path: Path) -> list[LeftOut]:
    """Read `quarantine.jsonl`: the units of work that have no rows."""
    text = read_text(path)
    with about(path):
        return left_out_from(text)


def left_out_from(text: str) -> list[LeftOut]:
    """Parse the text of `quarantine.jsonl`."""
    found = list[LeftOut]()
    lines = text.removesuffix("\n").split("\n") if text else []
    for number, line in enumerate(lines, start=1):
        with about(f"line {number}"):
            found.append(record_of(LeftOut, line, "line of quarantine.jsonl"))
    return found
