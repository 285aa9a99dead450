"""Reads a finished dataset, or one split of it: its tables as arrays, or row by row.

All tables are sorted by the beginning of their rows' names, which are the first letters of the
object's hash, so that rows can be read grouped by object, with only one object in memory. Meshes
are files in metres that give exactly the same solid. A contact set can be taken out with how its
trials ended, to be simulated again.
"""

import hashlib
import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from heapq import merge
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Any

from grasp_core.allowed_values import one_of, path_of
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import object_of
from grasp_core.files.records import Record, from_record, record_of
from grasp_core.hands.hand import Hand
from grasp_core.mesh_files.limits import MeshChoices
from grasp_core.mesh_files.reading import FileSurface, read_triangles
from grasp_core.objects.build import DEFAULT_LIMITS, content_hash
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from sim_validate.closure.replaying import Recorded, WantedTrial
from sim_validate.datasets.columns import ROW_CLASSES, DatasetRows, GraspRow, ObjectRow, TrialRow
from sim_validate.datasets.config import (
    ID_DIGITS,
    KEYS,
    SPLITS,
    DatasetConfig,
    TableName,
    config_from_toml,
)
from sim_validate.datasets.hand_files import kept_hand
from sim_validate.datasets.layout import CONFIG, HAND_FOLDER, HAND_RECORD, MESH_FOLDER
from sim_validate.datasets.manifest import Manifest, path_inside, read_manifest
from sim_validate.datasets.parquet import Columns, each_batch, read_columns
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.planning.asked_objects import NAMES_LISTED, some


@dataclass(frozen=True)
class Dataset:
    """A finished dataset, or the objects of one of its splits."""

    folder: Path
    manifest: Manifest
    split: str | None = None

    @cached_property
    def config(self) -> DatasetConfig:
        """Read the configuration of the dataset."""
        return config_from_toml(self.folder / CONFIG)

    @cached_property
    def hand_folder(self) -> Path | None:
        """The folder with the files of the hand, each checked; None where there is no hand."""
        own = [each for each in self.manifest.files if each.path.startswith(f"{HAND_FOLDER}/")]
        for each in own:
            if fault := each.fault(self.folder):
                raise InputError(f"{each.path}: {fault}; see `graspproof dataset verify`")
        records = (each.path for each in own if each.path.endswith(f"/{HAND_RECORD}"))
        record = next(records, None)
        return None if record is None else path_inside(self.folder, record).resolve().parent

    @cached_property
    def hand(self) -> Hand | None:
        """The hand whose poses the dataset holds, with its torque limits; None for none."""
        return None if self.hand_folder is None else kept_hand(self.hand_folder)

    def paths(self, name: TableName) -> list[Path]:
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
        name: TableName = next(name for name, each in ROW_CLASSES.items() if each is kind)
        for each in self.manifest.of_table(name, self.split):
            found = 0
            for batch in each_batch(
                path_inside(self.folder, each.path), name, self.manifest.tables
            ):
                for number, row in enumerate(batch.to_pylist(), start=found):
                    if cells == {column: row[column] for column in cells}:
                        yield from_record(kind, row, f"{each.path}: row {number}")
                found += batch.num_rows
            if found != each.rows:
                raise InputError(
                    f"{each.path}: the file has {found} rows, but the manifest lists {each.rows}; "
                    "see `graspproof dataset verify`"
                )

    def by_object(self) -> Iterator[DatasetRows]:
        """Yield the rows of each object in turn."""
        streams = map(self._begun, self.manifest.tables)
        for _, same in groupby(merge(*streams, key=itemgetter(0)), key=itemgetter(0)):
            rows: dict[TableName, list[Any]] = {}
            for _, name, row in same:
                rows.setdefault(name, []).append(row)
            yield DatasetRows(**{name: tuple(each) for name, each in rows.items()})

    def _begun(self, name: TableName) -> Iterator[tuple[str, TableName, Any]]:
        """Yield rows with the part of their first key that all rows of an object share."""
        key = KEYS[name][0]
        for row in self.rows(ROW_CLASSES[name]):
            yield str(getattr(row, key))[:ID_DIGITS], name, row

    def surface(self, object_id: str) -> FileSurface:
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
            if said.startswith(SURFACE_LINE):
                with about("first line"):
                    known = from_record(
                        Surface, object_of(said.removeprefix(SURFACE_LINE), "surface")
                    )
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


def load_dataset(folder: str | Path, split: str | None = None) -> dict[TableName, Columns]:
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
    tables = chosen.manifest.tables
    return {name: read_columns(chosen.paths(name), name, tables) for name in tables}


def load_dataset_hand(folder: str | Path) -> Hand | None:
    """Return the hand whose poses a dataset holds; None for a dataset without one.

    Columns with a number for each joint have them in the order of `Hand.joints`.

    Raises:
        InputError: The dataset is not finished, or a file of the hand is damaged.
    """
    return select(path_of(folder, "folder")).hand


SURFACE_LINE = "# surface "
"""Beginning of the first line, a comment that says what is known of the triangles."""


def mesh_text(body: Polyhedron) -> str:
    """Write a solid as an OBJ file in metres, whose numbers read back unchanged.

    Its first line is a comment with what is known of its surface, as in a `grasps.json`.
    """
    said = SURFACE_LINE + json.dumps(record_of(body.surface), sort_keys=True)
    points = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in body.vertices.tolist()]
    triangles = [f"f {i} {j} {k}\n" for i, j, k in (body.triangles + 1).tolist()]
    return "".join([said, "\n", *points, *triangles])


def mesh_path(folder: Path, object_id: str) -> Path:
    """Return the path of an object's mesh in a dataset."""
    return path_inside(folder, f"{MESH_FOLDER}/{object_id}.obj")


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
        there = some(row.grasp_id for row in islice(chosen.rows(GraspRow), NAMES_LISTED))
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
