"""Takes numbers, texts and poses from the fields of records, whatever a file has there.

Lists of a pickle may contain each other in any way: nothing here looks deeper than lists of lists.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from grasp_core.allowed_values import LARGEST, value_of
from grasp_core.arrays import Array, frozen
from grasp_core.errors import InputError
from grasp_core.files.json_text import shown
from grasp_core.frames import POSE_SIZE
from grasp_core.planning.grasps_json import MOST_GRASPS
from sim_validate.hands.dexgraspbench import ROOT_POSE, UNIT_QUATERNION, pose_of
from sim_validate.judge.records import BadRecord, GraspRecord, RecordText

MOST_NUMBERS = 1000
"""Most numbers of one field of a record."""
SAME_SCALE = 1e-6
"""Largest relative difference of scales that are equal: the rounding of single precision."""
Item = TypeVar("Item")


@dataclass(frozen=True, slots=True)
class Source:
    """A file of records, and where the objects are that its records name."""

    path: Path
    name: str
    """Name of the file in the ids of records."""
    objects: Path | None = None

    def records(
        self, items: Iterable[Item], count: int, make: Callable[[Item, str], GraspRecord]
    ) -> Iterator[GraspRecord]:
        """Make a record of each item and its id; one of which none can be made is a `BadRecord`."""
        if count > MOST_GRASPS:
            raise InputError(f"the file has {count} records; give at most {MOST_GRASPS} in one")
        for place, item in enumerate(items):
            name = self.name if count == 1 else f"{self.name}#{place}"
            try:
                yield make(item, name)
            except InputError as error:
                yield BadRecord(name, str(error))


def entry(table: Any, name: str) -> Any:
    """Return what a dictionary of a file has under a name, where it may have anything."""
    if not isinstance(table, dict):
        raise InputError(f"expected a dictionary with {name}, got {shown(table)}")
    found = cast("dict[str, Any]", table).get(name)
    if found is None:
        raise InputError(f"{name}: missing; add it to the record")
    return found


def text(table: Any, name: str) -> str:
    """Return a printable text that a dictionary of a file has under a name."""
    return value_of(RecordText, entry(table, name), name)


def depth(value: Any) -> int:
    """Return how many indices lead to a number or text of a field; 2 for any more."""
    if isinstance(value, np.ndarray):
        return min(value.ndim, 2)
    items = cast("list[Any]", value) if isinstance(value, list | tuple) else []
    return 0 if not items else 2 if isinstance(items[0], list | tuple | np.ndarray) else 1


def numbers(value: Any, name: str) -> Array:
    """Return the numbers of an array, or of lists of numbers, in one row."""
    found: list[Any] = []
    for row in _items(value):
        found += _items(row)
    if not 0 < len(found) <= MOST_NUMBERS or not all(type(each) in (int, float) for each in found):
        raise InputError(f"{name} must be up to {MOST_NUMBERS} numbers, got {shown(value)}")
    return frozen(found, (None,), name, most=LARGEST)


def _items(value: Any) -> list[Any]:
    """Return the first entries of an array or a list, one more than may be."""
    if isinstance(value, np.ndarray | np.generic):
        return np.asarray(cast("NDArray[Any]", value)).flat[: MOST_NUMBERS + 1].tolist()
    listed = isinstance(value, list | tuple)
    return [*cast("list[Any]", value)[: MOST_NUMBERS + 1]] if listed else [value]


def scale(value: Any, name: str) -> float:
    """Return the factor on an object's lengths: one number, or three equal ones."""
    found = numbers(value, name)
    if len(found) not in (1, 3) or np.ptp(found) > SAME_SCALE * np.abs(found).max():
        raise InputError(
            f"{name} must be one number, or three equal ones, got {shown(found.tolist())}; "
            "stretched objects are not judged"
        )
    return float(found[0])


def pose(value: Any, name: str) -> Array:
    """Return a pose (4, 4) of a matrix, or of a position and a quaternion (w, x, y, z)."""
    found = numbers(value, name)
    if len(found) == ROOT_POSE:
        if abs(float(np.linalg.norm(found[3:])) - 1.0) > UNIT_QUATERNION:
            raise InputError(f"{name} must have a quaternion (w, x, y, z) of length 1")
        return pose_of(found)
    if len(found) != POSE_SIZE * POSE_SIZE:
        raise InputError(f"{name} must be a matrix (4, 4), or 7 numbers, got {len(found)}")
    matrix = found.reshape(POSE_SIZE, POSE_SIZE).copy()
    left, sizes, right = np.linalg.svd(matrix[:3, :3])
    off = float(np.abs(sizes - 1.0).max())
    matrix[:3, :3] = left @ right  # a rotation to more digits than those of the file
    if off > UNIT_QUATERNION or np.linalg.det(matrix) < 0.0 or matrix[3].tolist() != [0, 0, 0, 1]:
        raise InputError(f"{name} must be a rotation and a position above a row of 0, 0, 0, 1")
    return matrix
