"""Names the tables of a dataset, their keys, and its splits.

The columns of a table are the fields of its class in `rows`. Nothing that is slow to import is
imported here, since command-line help waits for it.
"""

from collections.abc import Mapping
from typing import Literal, TypeAlias, get_args

Name: TypeAlias = Literal["objects", "grasps", "trials", "executions"]
NAMES: tuple[Name, ...] = get_args(Name)
SplitName: TypeAlias = Literal["train", "validation", "test"]
SPLITS: tuple[tuple[SplitName, float], ...] = (("test", 0.1), ("validation", 0.2), ("train", 1.0))
"""Upper ends of each split's share of hashes: an object is in the first split whose end is above
its hash."""
SHORT = 16
"""Number of digits of an object's hash in the names of its grasps."""
KEYS: Mapping[Name, tuple[str, ...]] = {
    "objects": ("object_id",), "grasps": ("object_id", "grasp_id"), "trials": ("grasp_id", "trial"),
    "executions": ("grasp_id", "trial"),
}  # fmt: skip
"""Columns by which the rows of a table are sorted; no two rows have the same values in them."""
REFERENCES: Mapping[tuple[Name, str], tuple[Name, str]] = {
    ("grasps", "object_id"): ("objects", "object_id"),
    ("trials", "grasp_id"): ("grasps", "grasp_id"),
    ("executions", "grasp_id"): ("grasps", "grasp_id"),
}
"""Columns whose cells name a row of another table, with the column there that holds the name."""
EXECUTED = "executed"
"""The group of columns of a dataset with executions, which has one table more."""


def id_beginning(object_id: str, friction: float) -> str:
    """Return the first part of the names of all grasps of one object at one friction."""
    return f"{object_id[:SHORT]}-{friction}-"
