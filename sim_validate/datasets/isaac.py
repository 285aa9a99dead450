"""Exports grasps of a dataset as Isaac grasp files, version 1.0: one per object and friction.

The format describes a gripper by a pose and the positions of joints, so the four fingertips are
taken as one gripper: `fingerI_x`, `fingerI_y` and `fingerI_z` slide fingertip I along the axes of
the gripper's frame; with all three at zero, the fingertip's centre is at the frame's origin. The
gripper's frame is parallel to the object's, which is that of the mesh in metres, and its origin is
the mean of the contacts. All fingertips of a file have the radius that fits all of its grasps; the
centre of a fingertip lies one radius outside of its contact. Contact sets that are not in force
closure are left out.

Source:
    NVIDIA, "Isaac Grasp File", nvidia-isaac-ros.github.io/concepts/manipulation/isaac_grasp.html.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.fingertips import FingerSettings, fitting_radius
from scenes.layout import arrange
from sim_validate.datasets.config import quoted
from sim_validate.datasets.meshes import mesh_path, stored_body
from sim_validate.datasets.open_dataset import Selection, select
from sim_validate.datasets.parquet import pyarrow
from sim_validate.datasets.rows import GIVEN
from sim_validate.datasets.tables import SHORT, Name, SplitName
from sim_validate.files.writing import whole_folder, write_lines

AXES = "xyz"
HEAD = """\
# {source} at friction {friction:.12g}: grasps by four spherical fingertips of radius {radius!r} m.
# Object frame: that of {mesh}
# of the dataset, in metres. Gripper frame: turned like it, its origin midway between the contacts.
# Joints fingerI_x, fingerI_y, fingerI_z [m] slide the centre of fingertip I along the gripper's
# axes, from its origin where they are zero.
# cspace_position: touching; pregrasp_cspace_position: moved back along the contacts' normals.
# confidence: 1.0 if the object was held in every simulated trial, else 0.0.
"""
UNSAFE = re.compile(r"[^A-Za-z0-9._-]")
GRASPS = ("grasp", GIVEN)
"""Labels of rows that are grasps, not negative controls."""
LONGEST = 150
"""Largest number of characters in a file's name; every file system allows more."""


@dataclass(frozen=True, slots=True, eq=False)
class StoredGrasp:
    """A grasp as the tables of a dataset hold it."""

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


@dataclass(frozen=True, slots=True)
class Exported:
    """The result of an export."""

    files: int
    rows: dict[Name, int]
    """Number of objects and of grasps that were written."""


def export(
    folder: Path, out: Path, split: SplitName | None, report: Callable[[int, int], None]
) -> Exported:
    """Write the grasps of a dataset; the same dataset gives the same bytes.

    Takes `report` (written, total).
    """
    pyarrow()  # before any work, so that a missing library is named at once
    chosen = select(folder, split)
    if out.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f"{out}: this folder is inside the dataset to export; give an --out outside of it"
        )
    with whole_folder(out) as place:
        rows = _write(chosen, place, report)
        files = sum(1 for _ in place.iterdir())
    return Exported(files, rows)


def _write(chosen: Selection, folder: Path, report: Callable[[int, int], None]) -> dict[Name, int]:
    """Write one file for the grasps of each object at each friction."""
    facts, total = chosen.facts(), chosen.counts()["objects"]
    objects = grasps = 0
    for each in _grasped_objects(chosen):
        by_friction = sorted(each.grasps, key=lambda grasp: grasp.friction)
        for friction, same in groupby(by_friction, key=lambda grasp: grasp.friction):
            name = f"{each.object_id[:SHORT]}-{friction}-{each.body.name}"
            write_lines(_new_path(folder, name), _lines(each, list(same), facts))
        objects += 1
        grasps += len(each.grasps)
        report(objects, total)
    return {"objects": objects, "grasps": grasps}


def _grasped_objects(chosen: Selection) -> Iterator[GraspedObject]:
    """Yield all objects that have grasps, in the order of the tables."""
    names = {row["object_id"]: row["source_name"] for row in chosen.rows("objects")}
    faces = chosen.config().faces
    planned = (
        row for row in chosen.rows("grasps") if row["label"] in GRASPS and row["force_closed"]
    )
    for object_id, rows in groupby(planned, key=lambda row: row["object_id"]):
        if object_id not in names:
            raise InputError(
                f"{chosen.folder}: the object {object_id} has grasps, but its row is missing in "
                "the table of objects; see `graspproof dataset verify`"
            )
        body = stored_body(chosen.folder, object_id, names[object_id], faces)
        yield GraspedObject(object_id, body, tuple(map(_grasp, rows)))


def _grasp(row: Mapping[str, Any]) -> StoredGrasp:
    points, normals = row["contact_points_m"], row["contact_normals"]
    return StoredGrasp(
        name=row["name"],
        friction=row["friction"],
        held=row["held"],
        contacts=tuple(map(Contact, points, normals)),
    )


def _new_path(folder: Path, name: str) -> Path:
    """Make a path for a file with a given name, whatever characters the name has."""
    path = folder / f"{UNSAFE.sub('_', name).lstrip('.')[:LONGEST]}.yaml"
    if path.exists():
        raise InputError(
            f"{name}: two grasps would get the same file name, {path.name}; rename one of them"
        )
    return path


def _lines(
    of: GraspedObject, grasps: Sequence[StoredGrasp], facts: Mapping[str, str]
) -> Iterator[str]:
    radius = min(fitting_radius(of.body, *_contacts(grasp)) for grasp in grasps)
    source, mesh = quoted(of.body.name), mesh_path(Path(), of.object_id).as_posix()
    friction = grasps[0].friction
    yield HEAD.format(source=source, friction=friction, radius=radius, mesh=quoted(mesh))
    yield from (f"# {name}: {quoted(text)}\n" for name, text in facts.items())
    yield "format: isaac_grasp\nformat_version: 1.0\n\n"
    yield f'object_frame: {source}\ngripper_frame: "four_fingertips"\n\ngrasps:\n'
    for grasp in grasps:
        yield from _grasp_lines(of.body, grasp, radius)


def _grasp_lines(body: Polyhedron, grasp: StoredGrasp, radius: float) -> Iterator[str]:
    layout = arrange(body, grasp.contacts, grasp.friction, FingerSettings(radius_m=radius))
    points, normals = _contacts(grasp)
    origin = points.mean(axis=0)
    touching = points - radius * normals - origin
    yield f"  {quoted(grasp.name)}:\n"
    yield f"    confidence: {yaml_number(float(grasp.held))}\n"
    yield f"    position: {_list(origin)}\n"
    yield f"    orientation: {{w: 1.0, xyz: {_list(np.zeros(3))}}}\n"
    yield "    cspace_position:\n"
    yield from _joint_lines(touching)
    yield "    pregrasp_cspace_position:\n"
    yield from _joint_lines(touching + layout.approach)


def _contacts(grasp: StoredGrasp) -> tuple[Array, Array]:
    """Return positions (4, 3) [m] and normals (4, 3) of a grasp's contacts."""
    points = np.array([contact.position for contact in grasp.contacts])
    return points, np.array([contact.normal for contact in grasp.contacts])


def _joint_lines(places: Array) -> Iterator[str]:
    for finger, place in enumerate(places.tolist()):
        for axis, value in zip(AXES, place, strict=True):
            yield f"      finger{finger}_{axis}: {yaml_number(value)}\n"


def _list(values: Array) -> str:
    return f"[{', '.join(map(yaml_number, values.tolist()))}]"


def yaml_number(value: float) -> str:
    """Write a number for YAML 1.1, which takes one with an exponent and no point for text."""
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")
