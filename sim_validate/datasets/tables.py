"""Rows <-> Parquet files that are the same for the same rows; the door to pyarrow.

Every page carries a checksum, which reading asks for: without it a flipped bit is read without
complaint. Units and meanings are in the metadata of the columns.
"""

import importlib
import io
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from sim_validate.datasets.columns import KEYS, TABLES, Column, Name

Columns: TypeAlias = dict[str, NDArray[Any]]
TYPES = {"text": "string", "bool": "bool_", "int": "int64", "float": "float64"}
MISSING: Mapping[str, float] = {"float": math.nan, "int": 0}
"""What stands for null in arrays."""
PAGES: Mapping[str, Any] = {
    "compression": "zstd",
    "write_page_checksum": True,
    "write_page_index": True,
}


def require_pyarrow() -> None:
    """Check that tables can be written and read here.

    Raises:
        InputError: pyarrow is not installed.
    """
    _pyarrow()


def parquet_bytes(name: Name, rows: Iterable[Mapping[str, Any]], about: Mapping[str, str]) -> bytes:
    """The file of one table.

    Args:
        name: Of the table.
        rows: By column; what is missing or not a number is null. Sorted here by the table's key.
        about: What the file is to say of itself: text by name.

    Raises:
        InputError: Two rows have the same key, or a cell is not of its column's type.
    """
    arrow, parquet = _pyarrow(), _parquet()
    listed = sorted(rows, key=lambda row: _key(name, row))
    for one, other in itertools.pairwise(listed):
        if _key(name, one) == _key(name, other):
            raise InputError(f"{name}: two rows are called {_key(name, one)}")
    schema = _schema(name).with_metadata(dict(sorted(about.items())))
    columns = [[_cell(row.get(column.name)) for row in listed] for column in TABLES[name]]
    try:
        arrays = [arrow.array(values, type=each.type)
                  for values, each in zip(columns, schema, strict=True)]  # fmt: skip
        table = arrow.Table.from_arrays(arrays, schema=schema)
    except (arrow.ArrowInvalid, arrow.ArrowTypeError) as error:
        raise InputError(f"{name}: {error}") from error
    held = io.BytesIO()
    parquet.write_table(table, held, **PAGES)
    return held.getvalue()


def read_rows(path: Path) -> list[dict[str, Any]]:
    """The rows of a file, all checksums checked.

    Raises:
        InputError: It is no such file, or damaged.
    """
    arrow, parquet = _pyarrow(), _parquet()
    try:
        table = parquet.ParquetFile(path, page_checksum_verification=True).read()
    except (OSError, arrow.ArrowException) as error:
        raise InputError(f"{path}: cannot be read, or is damaged ({error})") from error
    return table.to_pylist()


def read_columns(paths: Sequence[Path], name: Name) -> Columns:
    """The columns of a table's files, one after another, as arrays (rows, ..).

    Numbers that are null are NaN in columns of floats, and 0 in columns of whole numbers; text and
    truth values are objects, None where they are null.

    Raises:
        InputError: A file is damaged.
    """
    rows = [row for path in paths for row in read_rows(path)]
    return {column.name: _as_array(column, rows) for column in TABLES[name]}


def _as_array(column: Column, rows: Sequence[Mapping[str, Any]]) -> NDArray[Any]:
    values = [row[column.name] for row in rows]
    if column.kind not in MISSING:
        return np.array(values, dtype=object)
    missing = MISSING[column.kind]
    empty = np.full(column.shape, missing).tolist()
    filled = [empty if value is None else value for value in values]
    found = np.array(filled, dtype=object).reshape(len(rows), *column.shape)
    found[found == None] = missing  # noqa: E711 - elementwise
    return found.astype(np.int64 if column.kind == "int" else np.float64)


def _key(name: Name, row: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(row[column] for column in KEYS[name])


def _cell(value: Any) -> Any:
    """A value with null for each number that is none."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_cell(part) for part in value]  # pyright: ignore[reportUnknownVariableType]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@cache
def _schema(name: Name) -> Any:
    arrow = _pyarrow()
    return arrow.schema([_field(column) for column in TABLES[name]])


def _field(column: Column) -> Any:
    arrow = _pyarrow()
    kind = getattr(arrow, TYPES[column.kind])()
    for size in reversed(column.shape):
        kind = arrow.list_(kind, size)
    about = {"meaning": column.meaning} | ({"unit": column.unit} if column.unit else {})
    return arrow.field(column.name, kind, metadata=about)


def _pyarrow() -> Any:
    try:
        return importlib.import_module("pyarrow")
    except ImportError as error:
        raise InputError(
            "datasets are Parquet files, which take pyarrow: pip install 'graspproof[dataset]'"
        ) from error


def _parquet() -> Any:
    return importlib.import_module("pyarrow.parquet")
