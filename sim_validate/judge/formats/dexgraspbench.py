"""Reads records as DexGraspBench, Dexonomy and DexLearn write them: `..._qpos` in dictionaries.

A `.npy` file holds a dictionary with one grasp, one with a row for each of several, or a list of
dictionaries. Postures are `pregrasp_qpos`, `grasp_qpos` and `squeeze_qpos`, of which the grasp
must be there: pose of the root (position, quaternion w, x, y, z) in the record's world, then joints
in the order of the hand's file, or of `joint_names`, (7 + j,) or (n, 7 + j). Where Dexonomy has
several pregrasps on the way to one grasp, its tests begin at the first, and so does a record here.

`obj_path`, `obj_scale` and `obj_pose` say which object it is and where, once or for each row; else
a scene does (see `scenes`). `scene_scale` multiplies the scale of the scene.

Sources: github.com/JYChen18, DexGraspBench's README.md and src/task, Dexonomy's dexonomy/op, and
DexLearn's dexlearn/dataset and sample.py.
"""

from collections.abc import Iterator, Mapping
from typing import Any, cast

from grasp_core.errors import InputError
from sim_validate.hands.dexgraspbench import ROOT_POSE
from sim_validate.judge.formats.fields import Source, depth, entry, numbers, pose, scale
from sim_validate.judge.formats.scenes import object_of
from sim_validate.judge.records import GraspRecord, HandRecord, Posture

POSTURES = ("grasp_qpos", "pregrasp_qpos", "squeeze_qpos")
OF_ONE = {"obj_path": 0, "obj_scale": 0, "scene_scale": 0}
"""Number of indices of a field that is about one record, where it is not 1."""


def read(found: Any, source: Source) -> Iterator[GraspRecord]:
    """Read the records of an unpickled value."""
    if isinstance(found, list):
        tables = cast("list[Any]", found)
        yield from source.records(
            tables, len(tables), lambda table, name: _record(object_of(table, source), name)
        )
        return
    poses, told = entry(found, "grasp_qpos"), object_of(found, source)
    count = len(poses) if depth(poses) > 1 else 1
    yield from source.records(
        range(count), count, lambda place, name: _record(_row(told, place, count), name)
    )


def _row(table: Mapping[str, Any], place: int, count: int) -> Mapping[str, Any]:
    """Return the fields of one of several records."""
    row = dict(table)
    names = (*POSTURES, *OF_ONE, "obj_pose")
    for name in [name for name in names if depth(table.get(name)) > OF_ONE.get(name, 1)]:
        value = table[name]
        if len(value) == count:
            row[name] = value[place]
        elif not len(value) or (name in POSTURES and count > 1):
            raise InputError(f"{name} must have a row for each of the {count} grasps")
        elif name != "obj_scale":
            row[name] = value[0]
    return row


def _record(row: Mapping[str, Any], name: str) -> HandRecord:
    object_pose = pose(entry(row, "obj_pose"), "obj_pose")
    turn = object_pose[:3, :3].T

    def posture(stage: str) -> Posture | None:
        if row.get(stage) is None:
            return None
        found = numbers(row[stage], stage)
        root = pose(found[:ROOT_POSE], stage)
        root[:3, 3] = turn @ (root[:3, 3] - object_pose[:3, 3])
        root[:3, :3] = turn @ root[:3, :3]
        return Posture(root, found[ROOT_POSE:])

    grasp, pregrasp, squeeze = map(posture, POSTURES)
    larger = scale(row["scene_scale"], "scene_scale") if "scene_scale" in row else 1.0
    return HandRecord(
        name, entry(row, "obj_path"), larger * scale(entry(row, "obj_scale"), "obj_scale"),
        row.get("joint_names", ()), cast("Posture", grasp), pregrasp, squeeze, turn,
    )  # fmt: skip
