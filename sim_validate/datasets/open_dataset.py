"""Reads a finished dataset, or one split of it: its tables as arrays, or row by row.

All tables are sorted by the beginning of their rows' names, which are the first letters of the
object's hash, so that rows can be read grouped by object, with only one object in memory. Meshes
are files in metres that give exactly the same solid. A contact set can be taken out with how its
trials ended, to be simulated again.

The manifest names all files, and the versions that made them. A folder without one is no finished
dataset, as it is written last. It does not say when or with how many processes the dataset was
made: equal configuration, meshes and versions give equal bytes.
"""

import hashlib
import json
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from heapq import merge
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Interval
from pydantic import computed_field

from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.files.file_kinds import MANIFEST
from grasp_core.files.json_text import object_of
from grasp_core.files.records import Record, RecordFile, from_record, record_of
from grasp_core.files.text_files import read_text, write_text
from grasp_core.kinds import Number, one_of, path_of
from grasp_core.mesh_files.limits import MeshChoices
from grasp_core.mesh_files.reading import MeshFile, read_triangles
from grasp_core.messages import FieldError, shown
from grasp_core.objects.build import DEFAULT_LIMITS, content_hash
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from sim_validate.closure.replaying import Recorded, WantedTrial
from sim_validate.datasets.columns import (
    ROWS,
    GraspRow,
    ObjectRow,
    Rows,
    TrialRow,
    dataset_tables,
    groups_asked,
)
from sim_validate.datasets.config import (
    KEYS,
    SHORT,
    SPLITS,
    DatasetConfig,
    Name,
    SplitName,
    config_from_toml,
)
from sim_validate.datasets.parquet import Columns, Tables, each_batch, read_columns
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.files.named_paths import path_inside, require_inside
from sim_validate.planning.asked_objects import NAMED, some

CONFIG = "config.toml"
QUARANTINE = "quarantine.jsonl"
Size = Annotated[int, Interval(ge=0)]


@declared
class Listed(Declared):
    """One file of a dataset, as the manifest lists it."""

    path: str
    """Path of the file in the dataset's folder."""
    bytes: Size
    sha256: str
    table: Name | None = None
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
    """Number of units of work that were left out."""
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

    def of_table(self, name: Name, split: str | None = None) -> tuple[Listed, ...]:
        """List the files of a table, in one split or in all of them."""
        return tuple(
            each for each in self.files if each.table == name and split in (None, each.split)
        )

    def count(self, name: Name, split: str | None = None) -> int:
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


@declared
class LeftOut(Declared):
    """A unit of work without rows, with the reason."""

    object: str
    source_sha256: str
    friction: float
    given: tuple[str, ...]
    """Ids of the given grasps that have no rows, if the unit is about given grasps."""
    reason: str


def left_out_text(units: Iterable[LeftOut]) -> str:
    """Write the text of `quarantine.jsonl`, one line per unit of work without rows."""
    return "".join(json.dumps(record_of(each)) + "\n" for each in units)


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
            found.append(from_record(LeftOut, object_of(line, f"line of {QUARANTINE}")))
    return found


@dataclass(frozen=True)
class Dataset:
    """A finished dataset, or the objects of one of its splits."""

    folder: Path
    manifest: Manifest
    split: str | None = None

    @property
    def tables(self) -> Tables:
        """Tables of the dataset, with their columns."""
        return self.manifest.tables

    @cached_property
    def config(self) -> DatasetConfig:
        """Read the configuration of the dataset."""
        return config_from_toml(self.folder / CONFIG)

    def paths(self, name: Name) -> list[Path]:
        """List the files of a table, each checked to have the manifest's hash.

        Checksums of pages miss some bytes.
        """
        files = self.manifest.of_table(name, self.split)
        for each in files:
            if fault := each.fault(self.folder):
                raise InputError(f"{each.path}: {fault}; see `graspproof dataset verify`")
        return [path_inside(self.folder, each.path) for each in files]

    def rows(self, kind: type[Record], **cells: str | bool) -> Iterator[Record]:
        """Yield rows of a class, or those with some cells, without holding all in memory."""
        name: Name = next(name for name, each in ROWS.items() if each is kind)
        for each in self.manifest.of_table(name, self.split):
            found = 0
            for batch in each_batch(path_inside(self.folder, each.path), name, self.tables):
                for number, row in enumerate(batch.to_pylist(), start=found):
                    if cells == {column: row[column] for column in cells}:
                        yield from_record(kind, row, f"{each.path}: row {number}")
                found += batch.num_rows
            if found != each.rows:
                raise InputError(
                    f"{each.path}: the file has {found} rows, but the manifest lists {each.rows}; "
                    "see `graspproof dataset verify`"
                )

    def by_object(self) -> Iterator[Rows]:
        """Yield the rows of each object in turn."""
        streams = map(self._begun, self.tables)
        for _, same in groupby(merge(*streams, key=itemgetter(0)), key=itemgetter(0)):
            rows: dict[Name, list[Any]] = {}
            for _, name, row in same:
                rows.setdefault(name, []).append(row)
            yield Rows(**{name: tuple(each) for name, each in rows.items()})

    def _begun(self, name: Name) -> Iterator[tuple[str, Name, Any]]:
        """Yield rows with the part of their first key that all rows of an object share."""
        key = KEYS[name][0]
        for row in self.rows(ROWS[name]):
            yield str(getattr(row, key))[:SHORT], name, row

    def surface(self, object_id: str) -> MeshFile:
        """Read the triangles of an object [m]."""
        path = mesh_path(self.folder, object_id)
        mesh = read_triangles(path, DEFAULT_LIMITS)
        if (found := content_hash(mesh.vertices, mesh.triangles)) != object_id:
            raise InputError(
                f"{path}: this is the mesh of another object, whose hash is {found}; see "
                "`graspproof dataset verify`"
            )
        return mesh

    def body(self, object_id: str, name: str) -> Polyhedron:
        """Read an object from its canonical mesh."""
        mesh, known = self.surface(object_id), None
        said = mesh.data.partition(b"\n")[0].decode("utf-8", "replace")
        with about(mesh_path(self.folder, object_id)):
            if said.startswith(SURFACE):
                with about("first line"):
                    known = from_record(Surface, object_of(said.removeprefix(SURFACE), "surface"))
            return polyhedron_from_mesh(
                mesh.vertices, mesh.triangles, MeshChoices(faces=self.config.faces), name=name,
                source_sha256=hashlib.sha256(mesh.data).hexdigest(), known=known,
            )  # fmt: skip


def select(folder: Path, split: str | None = None) -> Dataset:
    """Open a dataset or one of its splits."""
    if split is not None:
        one_of(split, [name for name, _ in SPLITS], "split")
    return Dataset(folder, read_manifest(folder), split)


def splits_in_words(manifest: Manifest) -> str:
    """Say how many objects each split has."""
    counts = [f"{split} {manifest.count('objects', split)}" for split, _ in reversed(SPLITS)]
    return f"{', '.join(counts)} objects"


def load_dataset(folder: str | Path, split: str | None = None) -> dict[Name, Columns]:
    """Read the tables of a dataset, each as a dictionary of its columns.

    Args:
        folder: Folder of the dataset.
        split: `train`, `validation` or `test`; all splits if not given.

    Returns:
        Arrays by table and column, with one entry per row: contact points, for example, are (n, 4,
        3) [m]. Missing numbers are NaN, or -1 in columns of whole numbers; missing text is None.
        Columns of truth values are bool; with missing values they are 1.0, 0.0 and NaN.

    Warns:
        UserWarning: The split has no objects, as splits of small datasets often do.

    Raises:
        InputError: The split is unknown, the dataset is not finished, or a file is damaged.
    """
    chosen = select(path_of(folder, "folder"), split)
    if split is not None and not chosen.manifest.count("objects", split):
        warnings.warn(
            f"{folder}: the split {split} has no objects; the dataset has "
            f"{splits_in_words(chosen.manifest)}. Load all of a small dataset, and split it "
            "by object as docs/datasets.md shows",
            stacklevel=2,
        )
    return {name: read_columns(chosen.paths(name), name, chosen.tables) for name in chosen.tables}


FOLDER = "meshes"
SURFACE = "# surface "
"""Beginning of the first line, a comment that says what is known of the triangles."""


def mesh_text(body: Polyhedron) -> str:
    """Write a solid as an OBJ file in metres, whose numbers read back unchanged.

    Its first line is a comment with what is known of its surface, as in a `grasps.json`.
    """
    said = SURFACE + json.dumps(record_of(body.surface), sort_keys=True)
    points = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in body.vertices.tolist()]
    triangles = [f"f {i} {j} {k}\n" for i, j, k in (body.triangles + 1).tolist()]
    return "".join([said, "\n", *points, *triangles])


def mesh_path(folder: Path, object_id: str) -> Path:
    """Return the path of an object's mesh in a dataset."""
    return path_inside(folder, f"{FOLDER}/{object_id}.obj")


def recorded_in_dataset(folder: Path, wanted: WantedTrial) -> Recorded:
    """Read a grasp or a negative control from the tables of a dataset."""
    chosen = select(folder)
    if wanted.grasp is None or wanted.trial is not None or wanted.grasps is not None:
        raise InputError(
            f"{folder} is a dataset: name a grasp with --grasp GRASP_ID, and give neither --trial "
            "nor --grasps"
        )
    name = wanted.grasp if wanted.control is None else f"{wanted.grasp}:{wanted.control}"
    row = next(chosen.rows(GraspRow, grasp_id=name), None)
    if row is None or not row.was_tried:
        there = some(row.grasp_id for row in islice(chosen.rows(GraspRow), NAMED))
        raise InputError(
            f"{folder}: no simulated grasp is named {name}; the dataset has {there}, ..."
        )
    objects = chosen.rows(ObjectRow, object_id=row.object_id)
    source = next((each.source_name for each in objects), row.object_id)
    return Recorded(
        name=name,
        body=row.held_on(chosen.body(row.object_id, source)),
        contacts=row.placed,
        friction=row.friction,
        setup=Setup(),
        agenda=Agenda(random_wrenches=chosen.config.random_wrenches, seed=chosen.config.seed),
        control=None if row.force_closed else row.label,
        outcomes={
            each.name: each.hold.outcome.value for each in chosen.rows(TrialRow, grasp_id=name)
        },
        mujoco=chosen.manifest.versions.get("mujoco"),
    )
