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

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.closure_scene import arrange
from scenes.mujoco.fingertip_room import fitting_radius
from scenes.settings import FingerSettings
from sim_validate.datasets.columns import GIVEN, GraspRow, ObjectRow
from sim_validate.datasets.config import CREDITS, SHORT, Name, SplitName, quoted
from sim_validate.datasets.open_dataset import Dataset, mesh_path, select
from sim_validate.datasets.parquet import pyarrow
from sim_validate.files.output_folders import whole_folder

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
    facts, total = _facts(chosen), chosen.manifest.count("objects", chosen.split)
    files = objects = grasps = 0
    with whole_folder(out) as place:
        for object_id, body, rows in _grasped_objects(chosen):
            of_object = sorted(rows, key=lambda row: row.friction)
            for friction, same in groupby(of_object, key=lambda row: row.friction):
                # the object's hash tells files apart, whatever of its name they can keep
                name = UNSAFE.sub("_", f"{object_id[:SHORT]}-{friction}-{body.name}")[:LONGEST]
                lines = _lines(object_id, body, list(same), facts)
                write_parts(place / f"{name}.yaml", (line.encode() for line in lines))
                files += 1
            objects += 1
            grasps += len(rows)
            report(objects, total)
    return Exported(files, {"objects": objects, "grasps": grasps})


def _grasped_objects(chosen: Dataset) -> Iterator[tuple[str, Polyhedron, list[GraspRow]]]:
    """Yield the id of each object that has grasps, the object, and their rows."""
    names = {row.object_id: row.source_name for row in chosen.rows(ObjectRow)}
    planned = (row for row in chosen.rows(GraspRow, force_closed=True) if row.label in GRASPS)
    for object_id, rows in groupby(planned, key=lambda row: row.object_id):
        if object_id not in names:
            raise InputError(
                f"{chosen.folder}: the object {object_id} has grasps, but its row is missing in "
                "the table of objects; see `graspproof dataset verify`"
            )
        yield object_id, chosen.body(object_id, names[object_id]), list(rows)


def _facts(chosen: Dataset) -> dict[str, str]:
    """Versions and settings that made the dataset, and statements on its origin, by name."""
    config, manifest = chosen.config, chosen.manifest
    stated = {name: str(getattr(config, name)) for name in CREDITS}
    return {
        **{name: text for name, text in stated.items() if text},
        "split": chosen.split or "all",
        "schema": str(manifest.SCHEMA),
        "config_sha256": manifest.config_sha256,
        **{f"version_{name}": text for name, text in sorted(manifest.versions.items())},
    }


def _lines(
    object_id: str, body: Polyhedron, rows: Sequence[GraspRow], facts: Mapping[str, str]
) -> Iterator[str]:
    radius = min(fitting_radius(body, row.points, row.normals) for row in rows)
    source, mesh = quoted(body.name), mesh_path(Path(), object_id).as_posix()
    friction = rows[0].friction
    yield HEAD.format(source=source, friction=friction, radius=radius, mesh=quoted(mesh))
    yield from (f"# {name}: {quoted(text)}\n" for name, text in facts.items())
    yield "format: isaac_grasp\nformat_version: 1.0\n\n"
    yield f'object_frame: {source}\ngripper_frame: "four_fingertips"\n\ngrasps:\n'
    for row in rows:
        fingers = FingerSettings(fingertip_radius_m=radius)
        layout = arrange(body, row.placed, friction, fingers)
        origin = row.points.mean(axis=0)
        touching = row.points - radius * row.normals - origin
        yield f"  {quoted(row.name)}:\n"
        yield f"    confidence: {yaml_number(float(bool(row.held)))}\n"
        yield f"    position: {_list(origin)}\n"
        yield f"    orientation: {{w: 1.0, xyz: {_list(np.zeros(3))}}}\n"
        yield "    cspace_position:\n"
        yield from _joint_lines(touching)
        yield "    pregrasp_cspace_position:\n"
        yield from _joint_lines(touching + layout.approach)


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
