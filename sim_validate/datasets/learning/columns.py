"""Columns that tables have only on request, in groups; a dataset's manifest names its groups."""

from collections.abc import Mapping

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
GROUPS: Mapping[str, tuple[Name, tuple[Column, ...]]] = {"kinds": ("grasps", KINDS)}
"""Table that a group's columns belong to, and its columns."""


def dataset_tables(*, executed: bool, groups: Mapping[str, int] | None = None) -> Tables:
    """Return the tables of a dataset with their columns.

    Args:
        executed: Whether the dataset has executions.
        groups: Groups of columns on request, with their sizes.
    """
    tables = dict(base_tables(executed=executed))
    for group in groups or {}:
        name, columns = GROUPS[group]
        tables[name] = (*tables.get(name, ()), *columns)
    return tables
