"""The manifest of a dataset.

The manifest names all files, and the versions that made them. A folder without one is no finished
dataset, as it is written last. It does not say when or with how many processes the dataset was
made: equal configuration, meshes and versions give equal bytes.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path, PurePosixPath
from typing import Annotated

from annotated_types import Interval
from pydantic import computed_field

from grasp_core.allowed_values import Number
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import MANIFEST
from grasp_core.files.json_text import shown
from grasp_core.files.records import RecordFile
from grasp_core.files.text_files import write_text
from grasp_core.messages import FieldError
from sim_validate.datasets.columns import dataset_tables, groups_asked
from sim_validate.datasets.config import SplitName, TableName
from sim_validate.datasets.parquet import Tables

Size = Annotated[int, Interval(ge=0)]


@declared
class Listed(Declared):
    """One file of a dataset, as the manifest lists it."""

    path: str
    """Path of the file in the dataset's folder."""
    bytes: Size
    sha256: str
    table: TableName | None = None
    """Table that the file is a part of; None for other files."""
    split: SplitName | None = None
    """Split that the file's rows belong to; None for other files."""
    rows: Size | None = None

    def _check_together(self) -> None:
        require_inside(self.path, "path")

    def fault(self, folder: Path) -> str:
        """Say how the file of a folder is not as listed, by its hash; empty if it is."""
        path = path_inside(folder, self.path)
        if not path.is_file():
            return "this file is listed in the manifest, but missing"
        found = listed(folder, path)
        if found.bytes != self.bytes:
            return f"the file differs from what was written: {found.bytes} bytes, not {self.bytes}"
        if found.sha256 != self.sha256:
            return "the file differs from what was written (its sha256 differs)"
        return ""


@declared
class Manifest(RecordFile):
    """The files of a dataset, and all that decided their contents."""

    FILE = MANIFEST
    SCHEMA = 3

    config_sha256: str
    versions: Mapping[str, str]
    """Versions of the packages and of the interpreter, and the hash of this project's code."""
    arithmetic: str
    """Hash that tells how the processor rounded that ran the build."""
    units: Number
    """Number of units of work: objects at frictions; many given grasps make several units."""
    units_sha256: str
    """Hash of the names of all units of work, which depend on everything that decides rows."""
    quarantined: Number
    """Number of units of work that were quarantined."""
    files: tuple[Listed, ...]
    groups: Mapping[str, Number] = field(default_factory=dict[str, int])
    """Groups of columns that the dataset has on request, with their sizes."""

    def _check_together(self) -> None:
        known = tuple(groups_asked())
        if unknown := [name for name in self.groups if name not in known]:
            raise FieldError(
                "groups", f"must be some of {', '.join(known)}, got {shown(unknown[0])}"
            )
        if len({each.path for each in self.files}) < len(self.files):
            raise FieldError("files", "must have every path only once, got one path twice")

    @property
    def tables(self) -> Tables:
        """Tables of the dataset, with their columns."""
        return dataset_tables(self.groups)

    @computed_field
    @property
    def rows(self) -> Mapping[str, int]:
        """Number of rows of each table."""
        return {name: self.count(name) for name in self.tables}

    def of_table(self, name: TableName, split: str | None = None) -> tuple[Listed, ...]:
        """List the files of a table, in one split or in all of them."""
        return tuple(
            each for each in self.files if each.table == name and split in (None, each.split)
        )

    def count(self, name: TableName, split: str | None = None) -> int:
        """Count the rows of a table, in one split or in all of them."""
        return sum(each.rows or 0 for each in self.of_table(name, split))


def listed(folder: Path, path: Path) -> Listed:
    """Describe a file as the manifest lists it: path, size and hash."""
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
        size = stream.tell()
    return Listed(path.relative_to(folder).as_posix(), size, digest)


def write_manifest(folder: Path, manifest: Manifest) -> Path:
    """Write the manifest of a dataset, whose presence marks the dataset as finished."""
    files = tuple(sorted(manifest.files, key=lambda each: each.path))
    return write_text(folder / MANIFEST, replace(manifest, files=files).text())


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a dataset."""
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(
            f"{folder}: expected a finished dataset, but {MANIFEST} is missing; run `graspproof "
            "dataset build` to the end"
        )
    return Manifest.read(path)


LONGEST = 500


def require_inside(name: object, field: str) -> str:
    """Check that a path is relative and has no `..`."""
    if not isinstance(name, str) or not name or len(name) > LONGEST:
        raise InputError(f"{field}: expected the path of a file, got {shown(name)}")
    parts = PurePosixPath(name).parts
    plain = name.isprintable() and "\\" not in name and ":" not in name
    if name.startswith("/") or ".." in parts or not parts or not plain:
        raise InputError(
            f"{field}: expected a relative path that stays in the file's folder, got {shown(name)}"
        )
    return name


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder, after a check that no link leads out of it."""
    path = folder / require_inside(name, "path")
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{path}: this link leads out of {folder}; copy the file into the folder")
    return path
