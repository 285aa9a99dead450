"""Makes the columns of a table of the fields of its row class, and reads and writes Parquet files.

A field is a column of its name. A record that is `FLAT` in the row gives a column for each of its
entries, also one that keeps the figures of another class, so that a new figure is a new column.
`InGroup` marks fields that a dataset only has on request.

Equal rows give equal bytes. Every page carries a checksum, and reading checks it: without that, a
flipped bit goes unnoticed. Units and meanings are in the metadata of the columns. A whole dataset
is written one group of rows after another, so that memory does not grow.
"""

import importlib
import io
import json
import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from functools import cache
from itertools import chain
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeAlias, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from grasp_core.allowed_values import OrInfinity
from grasp_core.arrays import Shape
from grasp_core.declared import rules, types
from grasp_core.errors import InputError
from grasp_core.figures import Figure, figures, meanings, unit_of
from grasp_core.files.json_text import shown
from grasp_core.files.records import entries, record_of
from grasp_core.time_spent import TIME_SPENT
from grasp_core.values import FINGERS
from sim_validate.datasets.config import KEYS, TableName

CellKind: TypeAlias = Literal["text", "bool", "int", "float"]
RowCells: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class InGroup:
    """The mark of a field that a dataset has only if it has a group of columns."""

    group: str


@dataclass(frozen=True, slots=True)
class Within:
    """How far a number may be from the one that is computed again; others must be the same."""

    relative: float
    absolute: float = 0.0


Known = OrInfinity | None
"""A number; None where it could not be measured. Tables have null for both, and for infinity."""


@dataclass(frozen=True, slots=True)
class TableColumn:
    """Name, type, unit and meaning of one column of a table."""

    name: str
    kind: CellKind
    meaning: str
    unit: str = ""
    shape: tuple[int, ...] = ()
    """Shape of each cell; () for a plain value."""
    names: tuple[str, ...] = ()
    """What the entries of each cell are about, in their order, where that is known."""


Tables: TypeAlias = Mapping[TableName, tuple[TableColumn, ...]]
Form: TypeAlias = tuple[CellKind, tuple[int, ...]]


NAMELESS: Mapping[str, tuple[str, ...]] = {}


def columns_of(
    kind: type, groups: Mapping[str, int], named: Mapping[str, tuple[str, ...]] = NAMELESS
) -> tuple[TableColumn, ...]:
    """Return the columns of a row class in a dataset with some groups of columns.

    A group's size is the length that has its name in the shape of an array; a length that is free
    is the number of fingers. Groups may say what the entries of such arrays are called.
    """
    found: list[TableColumn] = []
    for each in entries(kind):
        marks = rules(each.kind)
        if any(isinstance(mark, InGroup) and mark.group not in groups for mark in marks):
            continue
        if each.flat is not None:
            found += columns_of(each.flat, groups, named)
        else:
            form, meaning = _form(each.kind, groups), meanings(kind).get(each.name, "")
            assert form is not None, each.key  # noqa: S101 - all fields of row classes are cells
            unit = (unit_of(each.key) or "1") if form[0] == "float" else ""
            lengths = (n for mark in marks if isinstance(mark, Shape) for n in mark.shape)
            names = next((named[n] for n in lengths if isinstance(n, str) and n in named), ())
            found.append(TableColumn(
                each.key, form[0], meaning.replace("None", "null"), unit, form[1], names
            ))  # fmt: skip
    return tuple(found)


def _form(kind: Any, groups: Mapping[str, int]) -> Form | None:
    """Return how cells hold values of a kind; None if no cell can."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        shape = next((rule for rule in parts[1:] if isinstance(rule, Shape)), None)
        if shape is None:
            return _form(parts[0], groups)
        lengths = (FINGERS if n is None else groups[n] if isinstance(n, str) else n
                   for n in shape.shape)  # fmt: skip
        return "int" if shape.whole else "float", tuple(lengths)
    if origin in (Union, UnionType):
        return _form(next(part for part in parts if part is not type(None)), groups)
    if origin is tuple:
        return _form_of_items(parts)
    if origin is Literal or (isinstance(kind, type) and issubclass(kind, Enum)):
        return "text", ()
    plain: Mapping[Any, CellKind] = {str: "text", bool: "bool", int: "int", float: "float"}
    return (plain[kind], ()) if kind in plain else None


def _form_of_items(parts: tuple[Any, ...]) -> Form | None:
    """Return how cells hold a tuple: some numbers, or how many texts there are."""
    inner = _form(parts[0], {})
    if inner is None or inner[1]:
        return None
    if parts[-1] is Ellipsis:
        return ("int", ()) if inner[0] == "text" else None
    return inner[0], (len(parts),)


def in_columns(kind: type, told: tuple[str, ...], beginning: str = "") -> Iterator[Figure]:
    """Yield the figures of a class that cells can hold, but for those that other columns tell.

    They may be null, and their columns may all begin alike. Of texts, the number is held.
    """
    for each in figures(kind):
        form = _form(each.kind, {})
        if form is not None and each.name not in told:
            held = int if form[0] == "int" else each.kind
            yield each._replace(kind=Annotated[held | None, Field(alias=f"{beginning}{each.name}")])


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def cells_of(row: object, columns: tuple[TableColumn, ...]) -> dict[str, Any]:
    """Return the cells of a row; where it has fewer fingers than a column, the last are null."""
    found = record_of(row)
    return {each.name: _filled(found.get(each.name), each) for each in columns}


def _filled(value: Any, column: TableColumn) -> Any:
    if value is None or not column.shape:
        return _plain(value)
    missing = np.full(column.shape[1:], None).tolist()
    return value + [missing] * (column.shape[0] - len(value))


def agrees(kind: type, name: str, stated: Any, value: Any) -> bool:
    """Return whether a cell is what was computed again, as far as its kind asks for it."""
    value = _plain(value)
    if stated is None or value is None:
        return stated is value
    within = next((mark for mark in rules(types(kind)[name]) if isinstance(mark, Within)), None)
    if within is None:
        return stated == value
    return np.allclose(stated, value, rtol=within.relative, atol=within.absolute)


Columns: TypeAlias = dict[str, NDArray[Any]]
TYPES: Mapping[CellKind, str] = {
    "text": "string",
    "bool": "bool_",
    "int": "int64",
    "float": "float64",
}
MISSING: Mapping[str, float] = {"float": math.nan, "int": -1}
"""Value that stands for null in arrays, by type of column."""
GROUP_ROWS = 20_000
"""Number of rows that are written or read at a time, some tens of megabytes in memory."""
MOST_FILE_ROWS, MOST_GROUP_BYTES = 10_000_000, 2**30
"""Largest number of rows of a file, and of bytes in a row group, that are read: twenty times what
is written."""
PARQUET_OPTIONS: Mapping[str, Any] = {
    "compression": "zstd",
    "write_page_checksum": True,
    "write_page_index": True,
}
FILE_ROWS = 500_000
"""Number of rows at which a file is closed and the next one begun, about 100 MB of grasps."""


def pyarrow() -> Any:
    """Import pyarrow, the library that reads and writes Parquet."""
    try:
        importlib.import_module("pyarrow.parquet")
        return importlib.import_module("pyarrow")
    except ImportError as error:
        raise InputError(
            "datasets are Parquet files, which need pyarrow: run pip install 'graspproof[dataset]' "
            "('.[dataset]' in a checkout)"
        ) from error


@TIME_SPENT.on("files")
def parquet_bytes(name: TableName, rows: Sequence[RowCells], tables: Tables) -> bytes:
    """Encode the cells of one table's rows as the bytes of a file, sorted by their keys."""
    return _bytes_of(_in_order(_as_table(name, rows, tables[name]), name))


def table_bytes(name: str, rows: Sequence[RowCells], columns: tuple[TableColumn, ...]) -> bytes:
    """Encode the cells of rows as the bytes of a file, in their order."""
    return _bytes_of(_as_table(name, rows, columns))


def _as_table(name: str, rows: Sequence[RowCells], columns: tuple[TableColumn, ...]) -> Any:
    arrow = pyarrow()
    try:
        return arrow.Table.from_pylist(list(rows), schema=schema_of(columns))
    except (arrow.ArrowInvalid, arrow.ArrowTypeError) as error:
        raise InputError(f"table {name}: a cell does not fit its column: {error}") from error


def _bytes_of(table: Any) -> bytes:
    held = io.BytesIO()
    pyarrow().parquet.write_table(table, held, **PARQUET_OPTIONS)
    return held.getvalue()


def _in_order(table: Any, name: TableName) -> Any:
    keys = list(KEYS[name])
    if table.group_by(keys).aggregate([]).num_rows < table.num_rows:
        raise InputError(
            f"table {name}: two rows have the same {' and '.join(keys)}; build the dataset again "
            "into an empty folder"
        )
    return table.sort_by([(key, "ascending") for key in keys])


def each_batch(path: Path, name: TableName, tables: Tables) -> Iterator[Any]:
    """Yield the rows of a file as Arrow's record batches, without holding all of them in memory."""
    with opened_table(path, name, tables[name]) as file:
        yield from file.iter_batches(GROUP_ROWS)


def joined(paths: Iterable[Path], name: TableName, tables: Tables) -> Any:
    """Read some files of one table as one Arrow table, sorted by its keys."""
    return _in_order(
        pyarrow().concat_tables([read_table(each, name, tables) for each in paths]), name
    )


def read_table(path: Path, name: TableName, tables: Tables) -> Any:
    """Read a file as an Arrow table and check all of its checksums."""
    with opened_table(path, name, tables[name]) as file:
        return file.read()


@contextmanager
def opened_table(path: Path, name: str, columns: tuple[TableColumn, ...]) -> Generator[Any]:
    """Open a file of a table with some columns; any damage is raised as an `InputError`."""
    arrow = pyarrow()
    try:
        with arrow.parquet.ParquetFile(path, page_checksum_verification=True) as file:
            came, wanted = file.schema_arrow, schema_of(columns)
            if came.names != wanted.names or came.types != wanted.types:
                what = "column types" if came.names == wanted.names else "columns"
                raise InputError(
                    f"{path}: expected the {what} of the table {name} in this version of "
                    "graspproof, got others; build the dataset again"
                )
            _check_size(path, file.metadata)
            yield file
    # ValueError: also for names that are not valid text
    except (OSError, ValueError, arrow.ArrowException) as error:
        said = shown(" ".join(str(error).split()))
        raise InputError(
            f"{path}: this file is not Parquet, or is damaged ({said}); copy the dataset again"
        ) from error


def _check_size(path: Path, claimed: Any) -> None:
    groups = [claimed.row_group(i) for i in range(claimed.num_row_groups)]
    rows, largest = claimed.num_rows, max((each.total_byte_size for each in groups), default=0)
    if not 0 <= rows <= MOST_FILE_ROWS or not 0 <= largest <= MOST_GROUP_BYTES:
        raise InputError(
            f"{path}: the file claims {rows} rows, and {largest} bytes in one group of rows; the "
            f"limits are {MOST_FILE_ROWS} and {MOST_GROUP_BYTES}, so the file is not read"
        )


def read_columns(paths: Sequence[Path], name: TableName, tables: Tables) -> Columns:
    """Read the columns of a table's files, one after another, as arrays (rows, ..).

    Null is NaN in columns of floats, and -1 in columns of whole numbers. Text is an object, with
    None for null. Truth values are bool where none is null. Otherwise they are 1.0, 0.0 and NaN:
    floats refuse `~` and `&`, which would give wrong answers for objects without a word.
    """
    read = [read_table(path, name, tables) for path in paths]
    return {
        column.name: _as_array(
            column, [cell for one in read for cell in one[column.name].to_pylist()]
        )
        for column in tables[name]
    }


def _as_array(column: TableColumn, values: Sequence[Any]) -> NDArray[Any]:
    if column.kind == "text":
        return np.array(values, dtype=object)
    if column.kind == "bool":
        unknown = any(value is None for value in values)
        return np.array([math.nan if value is None else value for value in values],
                        dtype=np.float64 if unknown else np.bool_)  # fmt: skip
    missing = MISSING[column.kind]
    empty = np.full(column.shape, missing).tolist()
    filled = [empty if value is None else value for value in values]
    found = np.array(filled, dtype=object).reshape(len(values), *column.shape)
    found[found == None] = missing  # noqa: E711 - elementwise
    return found.astype(np.int64 if column.kind == "int" else np.float64)


@cache
def schema_of(columns: tuple[TableColumn, ...]) -> Any:
    """Return columns of a table as an Arrow schema, with units and meanings as metadata."""
    arrow = pyarrow()
    found = list[Any]()
    for column in columns:
        kind = getattr(arrow, TYPES[column.kind])()
        for size in reversed(column.shape):
            kind = arrow.list_(kind, size)
        about = {"meaning": column.meaning} | ({"unit": column.unit} if column.unit else {})
        about |= {"names": json.dumps(column.names)} if column.names else {}
        found.append(arrow.field(column.name, kind, metadata=about))
    return arrow.schema(found)


def write_files(
    folder: Path, split: str, parts: Iterable[Any], about: Mapping[str, str]
) -> list[tuple[Path, int]]:
    """Write tables, one after another, into files of a split; list these with their rows.

    Rows are kept back until there are enough for a group of rows, so memory does not grow. At the
    end no file is open, whatever happens.
    """
    found, groups = list[tuple[Path, int]](), _groups(parts, dict(sorted(about.items())))
    while (first := next(groups, None)) is not None:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f".{split}-{len(found):05}"
        found.append((path, _write_file(path, chain([first], groups), first.schema)))
    named = (f"{split}-{place:05}-of-{len(found):05}.parquet" for place in range(len(found)))
    return [
        (path.rename(folder / name), rows)
        for (path, rows), name in zip(found, named, strict=True)
    ]  # fmt: skip


def _groups(parts: Iterable[Any], about: Mapping[str, str]) -> Iterator[Any]:
    waiting = list[Any]()
    for part in parts:
        waiting += [part.replace_schema_metadata(about)] if part.num_rows else []
        if sum(each.num_rows for each in waiting) >= GROUP_ROWS:
            yield pyarrow().concat_tables(waiting)
            waiting.clear()
    if waiting:
        yield pyarrow().concat_tables(waiting)


def _write_file(path: Path, groups: Iterable[Any], schema: Any) -> int:
    rows = 0
    writer = pyarrow().parquet.ParquetWriter
    with path.open("wb") as stream, writer(stream, schema, **PARQUET_OPTIONS) as to:
        for group in groups:
            to.write_table(group, row_group_size=group.num_rows)
            rows += group.num_rows
            if rows >= FILE_ROWS:
                break
    return rows
