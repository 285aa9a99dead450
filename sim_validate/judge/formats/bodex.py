"""Reads what BODex writes: `robot_pose` with pregrasp, grasp and squeeze of several grasps.

A `.npy` file holds a dictionary about one object. `robot_pose` is (1, n, 3, 7 + j): pose of the
root and joints as in `dexgraspbench`, in the order of `joint_names`. The root is that of the URDF
file of the hand in BODex. DexGraspBench's converter moves the records to its own files of the
hands, whose palms have another place. The object is in `world_cfg` under the name `manip_name`, in
older files in fields `obj_...`; each is in a list of one. Paths of arms have other shapes, and are
not read.

Sources: github.com/JYChen18, BODex's example_grasp and src/curobo/util, and DexGraspBench's
src/task/convert_format.py.
"""

from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from grasp_core.errors import InputError
from grasp_core.files.json_text import shown
from sim_validate.judge.formats import dexgraspbench
from sim_validate.judge.formats.fields import Source, depth, entry
from sim_validate.judge.records import GraspRecord

AXES, STAGES = 4, ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")
LISTED = ("world_cfg", "manip_name", "scene_path", "obj_path", "obj_scale", "obj_pose")
"""Fields that are in lists or arrays of one."""


def read(found: Any, source: Source) -> Iterator[GraspRecord]:
    """Read the records of an unpickled value."""
    poses = entry(found, "robot_pose")
    shape: tuple[int, ...] = getattr(poses, "shape", ())
    if len(shape) != AXES or shape[0] != 1 or shape[2] != len(STAGES):
        raise InputError(
            f"robot_pose must be an array (1, n, 3, 7 + j), got {shown(poses)}; paths are not read"
        )
    table = dict(cast("dict[str, Any]", found))
    for name in LISTED:
        if depth(table.get(name)) and len(table[name]) == 1:
            table[name] = table[name][0]
    table |= dict(zip(STAGES, np.moveaxis(poses[0], 1, 0), strict=True))
    yield from dexgraspbench.read(table, source)
