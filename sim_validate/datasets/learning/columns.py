"""Columns that tables have only on request, in groups; a dataset's manifest names its groups."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

from sim_validate.datasets.columns import Column, Name, Tables, base_tables

KINDS = (
    Column("kind", "text", "planned, given, the name of a negative control, or how it is varied"),
    Column("made_from", "text", "the grasp that a varied one was made from; null for others"),
    Column("friction_ratio", "float", "friction over critical friction; null if not known", "1"),
    Column("displaced_m", "float", "distance of each contact from that of `made_from`", "m", (4,)),
    Column("region_exit_m", "float", "how far the region reached that way; null if unmoved", "m",
           (4,)),
    Column("mass_ratio", "float", "mass over that at which `made_from` is predicted to fail", "1"),
)  # fmt: skip
CLOSURE = (
    Column("span_angle_rad", "float", "half-angle below which cones positively span", "rad"),
    Column("smallest_singular_value", "float", "least singular value of the grasp map", "1"),
    Column("witness_forces_n", "float", "balanced forces on the object, normal parts sum to one",
           "N", (4, 3)),
)  # fmt: skip
MARGINS = (
    Column("predicted_loss", "float", "least multiple of a trial's load that loses it", "1"),
    Column("payload_kg", "float", "mass that the squeeze is proved to carry", "kg"),
    Column("tip_radius_m", "float", "radius of the fingertips of the execution", "m"),
)
LEAST_SQUEEZE = (
    Column("least_push_n", "float", "least largest push that carries the weight any way", "N"),
    Column("least_squeeze_n", "float", "contact forces at rest with that push", "N", (4, 3)),
)
TRIAL_MARGINS = (
    Column("predicted_loss", "float", "multiple of the load that loses it; null if none", "1"),
    Column("seed", "int", "seed that a misplaced trial was drawn by; null for others"),
)
SIZED = -1
"""Length that stands in a column's shape for the size of its group."""
HAND = (
    Column("hand_reached", "bool", "whether a pose of the hand was found; null if not closed"),
    Column("hand_reason", "text", "why no pose was found; empty where one was"),
    Column("hand_fingers", "int", "number of the hand's finger at each contact", shape=(4,)),
    Column("hand_joints_rad", "float", "joint angles, finger by finger from the palm", "rad",
           (SIZED,)),
    Column("T_object_palm_m", "float", "pose of the palm in the object's frame", "m", (4, 4)),
    Column("hand_points_m", "float", "contacts of the fingertips", "m", (4, 3)),
    Column("hand_normals", "float", "inward unit normals at these", "1", (4, 3)),
    Column("hand_open_joints_rad", "float", "joint angles with open fingers; null if none found",
           "rad", (SIZED,)),
    Column("hand_approach", "float", "direction of the palm's straight way in; null if none", "1",
           (3,)),
)  # fmt: skip
Group: TypeAlias = Mapping[Name, tuple[Column, ...]]
GROUPS: Mapping[str, Group] = {
    "kinds": {"grasps": KINDS},
    "closure": {"grasps": CLOSURE},
    "margins": {"grasps": MARGINS, "executions": TRIAL_MARGINS},
    "least_squeeze": {"grasps": LEAST_SQUEEZE},
    "hand": {"grasps": HAND},
}
"""Columns of each group, by the table that they belong to."""


def dataset_tables(*, executed: bool, groups: Mapping[str, int] | None = None) -> Tables:
    """Return the tables of a dataset with their columns."""
    tables = dict(base_tables(executed=executed))
    sizes = groups or {}
    for group, size in ((group, sizes[group]) for group in GROUPS if group in sizes):
        for name, columns in GROUPS[group].items():
            tables[name] = (*tables[name], *(_sized(each, size) for each in columns))
    return tables


def _sized(column: Column, size: int) -> Column:
    shape = tuple(size if length == SIZED else length for length in column.shape)
    return replace(column, shape=shape)
