"""Reads the rows of a dataset grouped by object, with only one object in memory.

All tables are sorted by the beginning of their rows' names, which are the first letters of the
object's hash. Rows whose object is missing form groups of their own.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, TypeAlias

from sim_validate.datasets.columns import Name
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.rows import SHORT

Row: TypeAlias = Mapping[str, Any]
ObjectRows: TypeAlias = Mapping[Name, Sequence[Row]]
Group: TypeAlias = tuple[str, list[Row]]
BEGINNINGS: Mapping[Name, Callable[[Row], str]] = {
    "objects": lambda row: str(row["object_id"])[:SHORT],
    "grasps": lambda row: str(row["object_id"])[:SHORT],
    "trials": lambda row: str(row["grasp_id"])[:SHORT],
    "executions": lambda row: str(row["grasp_id"])[:SHORT],
}
"""Functions that return the part of a row's name that all rows of its object share."""


def by_object(chosen: Selection) -> Iterator[ObjectRows]:
    """Yield the rows of each object in turn."""
    streams = {name: _groups(chosen, name) for name in chosen.tables}
    heads: dict[Name, Group | None] = {name: next(streams[name], None) for name in chosen.tables}
    while waiting := [head[0] for head in heads.values() if head is not None]:
        first = min(waiting)
        rows: dict[Name, list[Row]] = {name: [] for name in chosen.tables}
        for name, head in heads.items():
            if head is not None and head[0] == first:
                rows[name] = head[1]
                heads[name] = next(streams[name], None)
        yield rows


def _groups(chosen: Selection, name: Name) -> Iterator[Group]:
    for beginning, rows in groupby(chosen.rows(name), key=BEGINNINGS[name]):
        yield beginning, list(rows)
