"""Reads the force-closed grasps of a dataset and their objects, one object at a time."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.rows import GIVEN

UNSAFE = re.compile(r"[^A-Za-z0-9._-]")
GRASPS = ("grasp", GIVEN)
"""Labels of rows that are grasps, not negative controls."""
LONGEST = 150
"""Largest number of characters in a file's name; every file system allows more."""


@dataclass(frozen=True, slots=True, eq=False)
class StoredGrasp:
    """A grasp as the tables of a dataset hold it."""

    id: str
    """Name of the grasp, which no other grasp of the dataset has."""
    name: str
    """Family and faces of the grasp, or the name that its file gave it."""
    friction: float
    held: bool
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, slots=True, eq=False)
class GraspedObject:
    """An object with all of its force-closed grasps."""

    object_id: str
    body: Polyhedron
    grasps: tuple[StoredGrasp, ...]


def grasped_objects(chosen: Selection) -> Iterator[GraspedObject]:
    """Yield all objects that have grasps, in the order of the tables."""
    names = {row["object_id"]: row["source_name"] for row in chosen.rows("objects")}
    faces = chosen.config().faces
    planned = (row for row in chosen.rows("grasps") if is_grasp(row))
    for object_id, rows in groupby(planned, key=lambda row: row["object_id"]):
        if object_id not in names:
            raise InputError(
                f"{chosen.folder}: the object {object_id} has grasps, but its row is missing in "
                "the table of objects; see `graspproof dataset verify`"
            )
        body = stored_body(chosen.folder, object_id, names[object_id], faces)
        yield GraspedObject(object_id, body, tuple(map(_grasp, rows)))


def is_grasp(row: Mapping[str, Any]) -> bool:
    """Tell whether a row is a planned or given grasp that is proved to be force-closed."""
    return row["label"] in GRASPS and bool(row["force_closed"])


def _grasp(row: Mapping[str, Any]) -> StoredGrasp:
    points, normals = row["contact_points_m"], row["contact_normals"]
    return StoredGrasp(
        id=row["grasp_id"],
        name=row["name"],
        friction=row["friction"],
        held=row["held"],
        contacts=tuple(map(Contact, points, normals)),
    )


def new_path(folder: Path, name: str, ending: str) -> Path:
    """Make a path for a file with a given name, whatever characters the name has."""
    path = folder / f"{UNSAFE.sub('_', name).lstrip('.')[:LONGEST]}.{ending}"
    if path.exists():
        raise InputError(
            f"{name}: two grasps would get the same file name, {path.name}; rename one of them"
        )
    return path
