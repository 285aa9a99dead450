"""Counts what a dataset holds: rows by label, kind and outcome, and how its numbers spread."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from sim_validate.datasets.columns import Column, Name
from sim_validate.datasets.open_dataset import Selection

QUARTERS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares of the values that are at most each number of a spread."""
WORDS = ("label", "kind", "family", "outcome", "fate", "split", "shape_class", "region_kind")
"""Columns of text with few values, which are counted."""


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """The values of a column with one number per row."""

    table: Name
    column: Column
    values: Array
    """The numbers that are known, in ascending order, (n,)."""
    missing: int

    @property
    def quarters(self) -> list[float]:
        """Least value, quartiles and largest value; empty where none is known."""
        return np.quantile(self.values, QUARTERS).tolist() if len(self.values) else []


@dataclass(frozen=True, slots=True, eq=False)
class Stats:
    """What a dataset holds."""

    rows: Mapping[Name, int]
    counts: Mapping[str, Mapping[str, int]]
    """Number of rows by each value, by `table.column`; the value of a null is `null`."""
    survival: Mapping[str, Mapping[str, int]]
    """Number of grasps that survived, were lost, and are not known, by kind or label."""
    spreads: tuple[Spread, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain values, with the spread of each column by its quarters."""
        spreads = [
            {
                "table": each.table, "column": each.column.name, "unit": each.column.unit,
                "known": len(each.values), "missing": each.missing, "quarters": each.quarters,
            }
            for each in self.spreads
        ]  # fmt: skip
        return {
            "schema": 1,
            "rows": dict(self.rows),
            "counts": {name: dict(counts) for name, counts in self.counts.items()},
            "survival": {name: dict(counts) for name, counts in self.survival.items()},
            "spreads": spreads,
        }


def stats_of(chosen: Selection) -> Stats:
    """Count the rows of a dataset; memory holds one number per row and column."""
    counts: dict[str, Counter[str]] = {}
    survival: dict[str, Counter[str]] = {}
    spreads = list[Spread]()
    for name, columns in chosen.tables.items():
        numbers = {each.name: list[Array]() for each in columns if is_number(each)}
        counted = [each.name for each in columns if each.kind == "bool" or each.name in WORDS]
        for batch in chosen.batches(name):
            for column in counted:
                found = counts.setdefault(f"{name}.{column}", Counter())
                found.update(map(_word, batch.column(column).to_pylist()))
            for column, parts in numbers.items():
                values = batch.column(column).cast("float64").to_numpy(zero_copy_only=False)
                parts.append(np.asarray(values, dtype=np.float64))
            if name == "grasps":
                _count_survival(batch, survival)
        for column in columns:
            if column.name in numbers:
                every = np.concatenate([np.zeros(0), *numbers[column.name]])
                known = np.sort(every[np.isfinite(every)])
                spreads.append(Spread(name, column, known, len(every) - len(known)))
    return Stats(chosen.counts(), counts, survival, tuple(spreads))


def is_number(column: Column) -> bool:
    """Return whether a column has one measured number per row."""
    return column.kind in ("int", "float") and not column.shape and column.name != "trial"


def _word(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "null" if value is None else str(value)


def _count_survival(batch: Any, survival: dict[str, Counter[str]]) -> None:
    if "survived" not in batch.schema.names:
        return
    by = "kind" if "kind" in batch.schema.names else "label"
    words = {True: "survived", False: "lost", None: "not known"}
    for kind, survived in zip(
        batch.column(by).to_pylist(), batch.column("survived").to_pylist(), strict=True
    ):
        survival.setdefault(str(kind), Counter())[words[survived]] += 1
