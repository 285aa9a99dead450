"""Makes the columns of a table of the fields of its row class, and rows of cells and back.

A field is a column of its name. A record that is `FLAT` in the row gives a column for each of its
entries, and a mapping that is marked by `FiguresOf` one for each figure of a class of records, so
that a new figure is a new column. `Asked` marks fields that a dataset only has on request.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, Union, cast, get_args, get_origin

import numpy as np

from grasp_core.arrays import Shape
from grasp_core.declared import rules, types
from grasp_core.figures import Figure, figures, meanings, unit_of
from grasp_core.files.records import entries, from_record, keys, record_of
from grasp_core.kinds import OrInfinity
from grasp_core.values import FINGERS
from sim_validate.datasets.config import Name

CellKind: TypeAlias = Literal["text", "bool", "int", "float"]
Cells: TypeAlias = Mapping[str, Any]
"""The cells of a row as plain values, by column."""
RowOf = TypeVar("RowOf")


@dataclass(frozen=True, slots=True)
class Asked:
    """The mark of a field that a dataset has only if it has a group of columns."""

    group: str


@dataclass(frozen=True, slots=True)
class FiguresOf:
    """The mark of a mapping of figures by name: each figure of a class is a column."""

    kind: type
    beginning: str = ""
    """First letters of the names of these columns."""
    told: tuple[str, ...] = ()
    """Figures that other columns tell."""


@dataclass(frozen=True, slots=True)
class Within:
    """How far a number may be from the one that is computed again; others must be the same."""

    relative: float
    absolute: float = 0.0


Known = OrInfinity | None
"""A number; None where it could not be measured. Tables have null for both, and for infinity."""


@dataclass(frozen=True, slots=True)
class Column:
    """Name, type, unit and meaning of one column of a table."""

    name: str
    kind: CellKind
    meaning: str
    unit: str = ""
    shape: tuple[int, ...] = ()
    """Shape of each cell; () for a plain value."""


Tables: TypeAlias = Mapping[Name, tuple[Column, ...]]
"""The tables of a dataset, with their columns."""
Form: TypeAlias = tuple[CellKind, tuple[int, ...]]
"""Type and shape of a column's cells."""


def columns_of(kind: type, groups: Mapping[str, int]) -> tuple[Column, ...]:
    """Return the columns of a row class in a dataset with some groups of columns.

    A group's size is the length that has its name in the shape of an array; a length that is free
    is the number of fingers.
    """
    own, properties = entries(kind)
    found: list[Column] = []
    for each in (*own, *properties):
        marks = rules(each.kind)
        if any(isinstance(mark, Asked) and mark.group not in groups for mark in marks):
            continue
        if each.flat is not None:
            found += columns_of(each.flat, groups)
        elif each.name in _figures(kind):
            found += [
                _column(name, figure.kind, figure.meaning, groups)
                for name, figure in _figures(kind)[each.name].items()
            ]
        else:
            found.append(_column(each.key, each.kind, meanings(kind).get(each.name, ""), groups))
    return tuple(found)


def _column(name: str, kind: Any, meaning: str, groups: Mapping[str, int]) -> Column:
    form = _form(kind, groups)
    assert form is not None, name  # noqa: S101 - row classes only have fields that are cells
    unit = (unit_of(name) or "1") if form[0] == "float" else ""
    return Column(name, form[0], meaning.replace("None", "null"), unit, form[1])


def _form(kind: Any, groups: Mapping[str, int]) -> Form | None:
    """Return how cells hold values of a kind; None if no cell can."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        shape = next((rule for rule in parts[1:] if isinstance(rule, Shape)), None)
        return _form(parts[0], groups) if shape is None else _form_of_array(shape, groups)
    if origin in (Union, UnionType):
        return _form(next(part for part in parts if part is not type(None)), groups)
    if origin is tuple:
        return _form_of_items(parts)
    if origin is Literal:
        return "text", ()
    if isinstance(kind, type) and issubclass(kind, Enum | Path):
        return "text", ()
    plain: Mapping[Any, CellKind] = {str: "text", bool: "bool", int: "int", float: "float"}
    return (plain[kind], ()) if kind in plain else None


def _form_of_array(shape: Shape, groups: Mapping[str, int]) -> Form:
    lengths = (FINGERS if n is None else groups[n] if isinstance(n, str) else n
               for n in shape.shape)  # fmt: skip
    return "int" if shape.whole else "float", tuple(lengths)


def _form_of_items(parts: tuple[Any, ...]) -> Form | None:
    """Return how cells hold a tuple: some numbers, or how many texts there are."""
    inner = _form(parts[0], {})
    if inner is None or inner[1]:
        return None
    if parts[-1] is Ellipsis:
        return ("int", ()) if inner[0] == "text" else None
    return inner[0], (len(parts),)


@cache
def _figures(kind: type) -> Mapping[str, Mapping[str, Figure]]:
    """Return the figures that mappings of a row class hold: by field, then by name of the column.

    Where the row itself has a field of a figure's name, that field is the column.
    """
    own = entries(kind).fields
    names = {name for each in own for name in _names(each.key, each.flat)}
    found: dict[str, Mapping[str, Figure]] = {}
    for each in own:
        for mark in (rule for rule in rules(each.kind) if isinstance(rule, FiguresOf)):
            found[each.name] = {
                f"{mark.beginning}{figure.name}": figure
                for figure in figures(mark.kind)
                if figure.name not in mark.told and figure.name not in names
                and _form(figure.kind, {}) is not None
            }  # fmt: skip
    return found


def _names(key: str, flat: type | None) -> tuple[str, ...]:
    return (key,) if flat is None else keys(flat)


def figures_in(kind: type, holder: str, record: object | None) -> Cells:
    """Return the figures of a record by column, for a field of a row class that holds them."""
    if record is None:
        return {}
    return {name: _plain(figure.of(record)) for name, figure in _figures(kind)[holder].items()}


def _plain(value: Any) -> Any:
    """Return a figure as a cell: of texts how many there are, null for what is not finite."""
    if isinstance(value, Enum | Path):
        return str(value.value if isinstance(value, Enum) else value)
    if isinstance(value, tuple):
        items = cast("tuple[Any, ...]", value)
        texts = all(isinstance(item, str) for item in items)
        return len(items) if texts else [_plain(item) for item in items]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def cells_of(row: object, columns: tuple[Column, ...]) -> dict[str, Any]:
    """Return the cells of a row; where it has fewer fingers than a column, the last are null."""
    found = record_of(row)
    for holder in _figures(type(row)):
        found = {**found.pop(holder), **found}
    return {each.name: _filled(found.get(each.name), each) for each in columns}


def _filled(value: Any, column: Column) -> Any:
    if value is None or not column.shape:
        return _plain(value)
    missing = np.full(column.shape[1:], None).tolist()
    return value + [missing] * (column.shape[0] - len(value))


def row_of(kind: type[RowOf], cells: Cells, where: str = "") -> RowOf:
    """Make a row of its cells; `where` says which row it is, for errors."""
    given = dict(cells)
    for holder, held in _figures(kind).items():
        given[holder] = {name: given.pop(name) for name in held if name in given}
    return from_record(kind, given, where)


def agrees(kind: type, name: str, stated: Any, value: Any) -> bool:
    """Return whether a cell is what was computed again, as far as its kind asks for it."""
    value = _plain(value)
    if stated is None or value is None:
        return stated is value
    within = next((mark for mark in rules(types(kind)[name]) if isinstance(mark, Within)), None)
    if within is None:
        return stated == value
    return np.allclose(stated, value, rtol=within.relative, atol=within.absolute)
