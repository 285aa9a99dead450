"""Reads and writes DexGraspBench's records: a hand's pregrasp, grasp and squeeze at an object.

A record is a dictionary in a `.npy` file. A configuration of a hand (`..._qpos`) is the pose of the
hand's root, position and quaternion (w, x, y, z), then the joints in the order of the hand's file;
`obj_pose` is that of the object, `obj_scale` a factor on its mesh, and `obj_path` a folder that the
tool MeshProcess has filled. The root is the world of the hand's file: the palm has a pose in it.

Source: github.com/JYChen18/DexGraspBench at 1e7a5a6fce27cc92911080cbdc5ce9da56fddbf0, README.md,
src/task/eval_func/base.py, src/util/hand_util.py.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from grasp_core.arrays import Array, frozen, real_array
from grasp_core.by_value import ByValue, summary
from grasp_core.checked import instance, path_of, positive, text
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts
from sim_validate.peer_files.pickled_records import Numbers, read_pickled

FREE = 7
"""Numbers of a pose: position and quaternion."""
UNIT = 1e-3
"""How far the length of a quaternion may be from 1: records have numbers of single precision."""
CONFIGURATIONS = ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")
WANTED = ("obj_path", "obj_scale", "obj_pose", *CONFIGURATIONS)
"""Fields that a record must have."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DexRecord(ByValue):
    """A grasp of a hand as DexGraspBench records it."""

    object_path: str
    """Folder of the object, as the record names it."""
    object_scale: float
    """Factor on the lengths of the object's mesh."""
    object_pose: Array
    """Position and quaternion (w, x, y, z) of the object, (7,)."""
    pregrasp: Array
    """Pose of the hand's root, then joint angles, (7 + j,) [m, rad]."""
    grasp: Array
    """Pose of the root and joint angles where the hand touches, (7 + j,) [m, rad]."""
    squeeze: Array
    """Pose of the root and joint angles that servos are told to squeeze with, (7 + j,) [m, rad]."""

    def __post_init__(self) -> None:
        text(self.object_path, "object_path")
        positive(self.object_scale, "object_scale")
        object.__setattr__(self, "object_pose", _pose(self.object_pose, "object_pose", FREE))
        size = len(frozen(self.grasp, (None,), "grasp"))
        if size <= FREE:
            raise InputError(
                f"grasp must be a pose of {FREE} numbers and at least one joint, got {size} numbers"
            )
        for name in ("pregrasp", "grasp", "squeeze"):
            object.__setattr__(self, name, _pose(getattr(self, name), name, size))

    def __repr__(self) -> str:
        return summary("DexRecord", self.object_path, joints=len(self.grasp) - FREE)


def _pose(given: Any, name: str, size: int) -> Array:
    found = frozen(given, (size,), name)
    length = float(np.linalg.norm(found[3:FREE]))
    if abs(length - 1.0) > UNIT:
        raise InputError(
            f"{name} must have a quaternion (w, x, y, z) of length 1 in numbers 3 to 6, got "
            f"{length:.6g}"
        )
    return found


def load_dex_record(path: str | Path) -> DexRecord:
    """Read a record of DexGraspBench; nothing in the file is executed.

    Args:
        path: A `.npy` file with a dictionary.

    Raises:
        InputError: The file cannot be read, or lacks a field.
    """
    place = path_of(path, "path")
    found = read_pickled(place)
    try:
        return _record(found)
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def _record(found: Any) -> DexRecord:
    """Make a record of the fields of a dictionary; those that are not known are left alone."""
    if not isinstance(found, dict):
        raise InputError(_of_others(found))
    fields = cast("Mapping[str, Any]", found)
    for name in WANTED:
        if name not in fields:
            raise InputError(
                f"the dictionary has no {name}; records have {', '.join(WANTED)}. Records of arms "
                "(approach_qpos alone), and batches, are not read"
            )
    scale = _numbers(fields, "obj_scale")
    if scale.size != 1:
        raise InputError(f"obj_scale: expected one number, got {scale.size}")
    return DexRecord(
        fields["obj_path"], float(scale.item()),
        *(_numbers(fields, name) for name in ("obj_pose", *CONFIGURATIONS)),
    )  # fmt: skip


def _of_others(found: Any) -> str:
    """Say what a file holds that holds no record, and what to do."""
    several = cast("list[Any]", found if isinstance(found, list) else [])
    first: Any = several[0] if several else None
    if not isinstance(first, dict):
        return "expected a dictionary that was saved with numpy.save"
    known = " DexGraspNet's files are such lists, of one pose (qpos) each and none to squeeze with."
    kind = known if "qpos" in first else ""
    return (
        f"expected the dictionary of one grasp, got a list of {len(several)}.{kind} Save each "
        f"grasp as a file of its own with the fields {', '.join(WANTED)} (docs/protocols.md says "
        "what they are)"
    )


def _numbers(fields: Mapping[str, Any], name: str) -> Array:
    """Return a field's numbers: an array, one number, or a list of numbers."""
    found: Any = fields[name]
    found = found.values if isinstance(found, Numbers) else found
    every = cast("Sequence[Any]", found if isinstance(found, list | tuple) else [found])
    if not (isinstance(found, np.ndarray) or all(isinstance(each, int | float) for each in every)):
        raise InputError(f"{name}: expected an array of numbers, got something else")
    return real_array(cast("Any", found), name)


def write_dex_record(record: DexRecord, path: str | Path) -> Path:
    """Write a record so that DexGraspBench reads it; return its path.

    Numbers have double precision. The format is a pickle in a `.npy` file, which `numpy.load`
    reads only where it is told to trust it.

    Raises:
        InputError: `record` is no record, or `path` no path.
    """
    instance(record, DexRecord, "record")
    fields = {
        "obj_path": record.object_path,
        "obj_scale": record.object_scale,
        "obj_pose": np.array(record.object_pose),
        "pregrasp_qpos": np.array(record.pregrasp),
        "grasp_qpos": np.array(record.grasp),
        "squeeze_qpos": np.array(record.squeeze),
    }
    held = io.BytesIO()
    np.save(held, np.array(fields, dtype=object), allow_pickle=True)
    return write_parts(path_of(path, "path"), [held.getvalue()])
