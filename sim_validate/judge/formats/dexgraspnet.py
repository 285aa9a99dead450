"""Reads what DexGraspNet publishes: a list of {`qpos`: angles by name, `scale`} for each object.

The file is named for the object. `qpos` has the angle of each joint under its name in the hand's
file, and the pose of the hand's root in the object's frame: translation `WRJTx`, `WRJTy`, `WRJTz`
[m], and Euler angles `WRJRx`, `WRJRy`, `WRJRz` about fixed axes, first x, then y, then z:

    R = Rz Ry Rx                                                                         (1)

Other fields, such as the start of the search and energies, are left alone.

Source: github.com/PKU-EPIC/DexGraspNet, grasp_generation/README.md and main.py.
"""

from collections.abc import Iterator
from math import cos, sin
from typing import Any, cast

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.frames import POSE_SIZE
from sim_validate.judge.formats.fields import MOST_NUMBERS, Source, entry, numbers, scale
from sim_validate.judge.records import GraspRecord, HandRecord, Posture

ROOT = ("WRJTx", "WRJTy", "WRJTz", "WRJRx", "WRJRy", "WRJRz")


def read(found: Any, source: Source) -> Iterator[GraspRecord]:
    """Read the records of an unpickled value."""
    tables = cast("list[Any]", found if isinstance(found, list) else [found])

    def record(table: Any, name: str) -> HandRecord:
        angles = entry(table, "qpos")
        x, y, z, *turns = _row(angles, ROOT).tolist()
        if len(angles) > MOST_NUMBERS:
            raise InputError(f"qpos has {len(angles)} names, expected those of a hand's joints")
        root = np.eye(POSE_SIZE)
        root[:3, :3], root[:3, 3] = euler_rotation(*turns), (x, y, z)
        names = tuple(name for name in angles if name not in ROOT)
        return HandRecord(
            name, source.path.stem, scale(entry(table, "scale"), "scale"), names,
            Posture(root, _row(angles, names)), None, None, np.eye(3),
        )  # fmt: skip

    yield from source.records(tables, len(tables), record)


def _row(angles: Any, names: tuple[str, ...]) -> Array:
    found = numbers([entry(angles, name) for name in names], "qpos")
    if len(found) != len(names):
        raise InputError("qpos must have one number under each name")
    return found


def euler_rotation(x: float, y: float, z: float) -> Array:
    """Return the rotation (1) by angles about the fixed axes x, y and z [rad], (3, 3)."""
    about_x = np.array([[1, 0, 0], [0, cos(x), -sin(x)], [0, sin(x), cos(x)]])
    about_y = np.array([[cos(y), 0, sin(y)], [0, 1, 0], [-sin(y), 0, cos(y)]])
    about_z = np.array([[cos(z), -sin(z), 0], [sin(z), cos(z), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x
