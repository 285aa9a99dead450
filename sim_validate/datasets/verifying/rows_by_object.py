"""A dataset's rows, an object at a time: what its tables hold of it, and nothing else in memory.

All tables are sorted by what begins the names of their rows, the first letters of the object's
hash. Rows of no object come by themselves.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, TypeAlias

from sim_validate.datasets.columns import TABLES, Name
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.rows import SHORT

Row: TypeAlias = Mapping[str, Any]
ObjectRows: TypeAlias = Mapping[Name, Sequence[Row]]
Group: TypeAlias = tuple[str, list[Row]]
BEGINNINGS: Mapping[Name, Callable[[Row], str]] = {
    "objects": lambda row: str(row["object_id"])[:SHORT],
    "grasps": lambda row: str(row["object_id"])[:SHORT],
    "trials": lambda row: str(row["grasp_id"])[:SHORT],
}
"""What an object's rows have in common."""


def by_object(chosen: Selection) -> Iterator[ObjectRows]:
    """The rows of each object in turn.

    Raises:
        InputError: A file is damaged, or has not as many rows as the manifest says.
    """
    streams = {name: _groups(chosen, name) for name in TABLES}
    heads: dict[Name, Group | None] = {name: next(streams[name], None) for name in TABLES}
    while waiting := [head[0] for head in heads.values() if head is not None]:
        first = min(waiting)
        rows: dict[Name, list[Row]] = {name: [] for name in TABLES}
        for name, head in heads.items():
            if head is not None and head[0] == first:
                rows[name] = head[1]
                heads[name] = next(streams[name], None)
        yield rows


def _groups(chosen: Selection, name: Name) -> Iterator[Group]:
    for beginning, rows in groupby(chosen.rows(name), key=BEGINNINGS[name]):
        yield beginning, list(rows)
