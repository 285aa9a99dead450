"""Rows <-> Parquet files, equal for equal rows; the only module that uses pyarrow.

Every page carries a checksum, and reading checks it: without that, a flipped bit goes unnoticed.
Units and meanings are in the metadata of the columns.
"""

import importlib
import io
import itertools
import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.strict_json import shown
from sim_validate.datasets.columns import KEYS, TABLES, Column, Name

Columns: TypeAlias = dict[str, NDArray[Any]]
TYPES = {"text": "string", "bool": "bool_", "int": "int64", "float": "float64"}
MISSING: Mapping[str, float] = {"float": math.nan, "int": -1}
"""What stands for null in arrays."""
GROUP_ROWS = 20_000
"""Number of rows that are written at a time, some tens of megabytes in memory."""
FILE_ROWS = 500_000
"""Number of rows at which a file is ended and the next one begun, about 100 MB of grasps."""
MOST_ROWS, MOST_GROUP_BYTES = 10_000_000, 2**30
"""Largest number of rows of a file, and of bytes in a group, that are read: twenty times what is
written."""
PAGES: Mapping[str, Any] = {
    "compression": "zstd",
    "write_page_checksum": True,
    "write_page_index": True,
}


def require_pyarrow() -> None:
    """Check that tables can be written and read on this machine.

    Raises:
        InputError: pyarrow is not installed.
    """
    _pyarrow()


def parquet_bytes(name: Name, rows: Iterable[Mapping[str, Any]], about: Mapping[str, str]) -> bytes:
    """Encode one table as the bytes of a file.

    Args:
        name: Name of the table.
        rows: Rows as cells by column. Missing cells and numbers that are not finite become null.
            The rows are sorted here by the table's key.
        about: Metadata of the file: text by name.

    Raises:
        InputError: Two rows have the same key, or a cell is not of its column's type.
    """
    arrow, parquet = _pyarrow(), _parquet()
    listed = sorted(rows, key=lambda row: _key(name, row))
    for one, other in itertools.pairwise(listed):
        if _key(name, one) == _key(name, other):
            raise InputError(f"{name}: two rows have the key {_key(name, one)}")
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


def as_read(name: Name, rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The rows as they come back from a file: sorted, with null for numbers that are not finite."""
    held = _pyarrow().BufferReader(parquet_bytes(name, rows, {}))
    return _parquet().ParquetFile(held).read().to_pylist()


def read_rows(path: Path, name: Name | None = None) -> list[dict[str, Any]]:
    """Read the rows of a file and check all of its checksums.

    Raises:
        InputError: The file is not that of a table, or is damaged.
    """
    return _read(path, name).to_pylist()


def each_row(path: Path, name: Name | None = None) -> Iterator[dict[str, Any]]:
    """Yield the rows of a file as `read_rows` does, without holding all of them in memory.

    Args:
        path: Path of the file.
        name: Name of its table; any table if None.

    Raises:
        InputError: The file is not that of a table, or is damaged.
    """
    with _opened(path, name) as file:
        for part in file.iter_batches(GROUP_ROWS):
            yield from part.to_pylist()


def _read(path: Path, name: Name | None = None) -> Any:
    with _opened(path, name) as file:
        return file.read()


@contextmanager
def _opened(path: Path, name: Name | None = None) -> Generator[Any]:
    """Open a file of one of the tables; any damage is raised as an `InputError`.

    Raises:
        InputError: The file is not that of a table, has other columns, or is damaged.
    """
    arrow, parquet = _pyarrow(), _parquet()
    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            _check_columns(path, file.schema_arrow, list(TABLES) if name is None else [name])
            _check_size(path, file.metadata)
            yield file
    # ValueError: also for names that are not valid text
    except (OSError, ValueError, arrow.ArrowException) as error:
        said = shown(" ".join(str(error).split()))
        raise InputError(f"{path}: cannot be read, or is damaged ({said})") from error


def _check_columns(path: Path, came: Any, names: Sequence[Name]) -> None:
    known = [[column.name for column in TABLES[name]] for name in names]
    if any(
        came.names == columns and came.types == _schema(name).types
        for name, columns in zip(names, known, strict=True)
    ):
        return
    what = "columns of other types" if came.names in known else "other columns"
    raise InputError(f"{path}: has {what} than {' or '.join(names)} of this version")


def _check_size(path: Path, claimed: Any) -> None:
    """Refuse a file that would not fit into memory, before anything is read."""
    groups = [claimed.row_group(i) for i in range(claimed.num_row_groups)]
    rows, largest = claimed.num_rows, max((each.total_byte_size for each in groups), default=0)
    if not 0 <= rows <= MOST_ROWS or not 0 <= largest <= MOST_GROUP_BYTES:
        raise InputError(
            f"{path}: claims {rows} rows, and {largest} bytes in one group of them; the limits are "
            f"{MOST_ROWS} and {MOST_GROUP_BYTES}"
        )


@dataclass(frozen=True, slots=True)
class WrittenTable:
    """A finished file of a table."""

    name: Name
    split: str
    path: Path
    rows: int


class TableFiles:
    """Writes the files of all tables, one after another for each table and split.

    Rows are kept back until there are enough for a group of rows, so memory does not grow. Use it
    in a `with` block; at its end no file is open, whatever happens.
    """

    def __init__(self, folder: Path, about: Mapping[str, str]) -> None:
        self._folder = folder
        self._about = dict(sorted(about.items()))
        self._parts: dict[tuple[Name, str], _Part] = {}

    def __enter__(self) -> "TableFiles":
        return self

    def __exit__(self, *_: object) -> None:
        for part in self._parts.values():
            part.abandon()

    def add(self, name: Name, split: str, paths: Iterable[Path]) -> None:
        """Add the rows of some files; their keys must come after all that were added before.

        Raises:
            InputError: A file is damaged, or two rows have the same key.
        """
        arrow, keys = _pyarrow(), list(KEYS[name])
        table = arrow.concat_tables([_read(path) for path in paths])
        table = table.sort_by([(key, "ascending") for key in keys])
        if table.group_by(keys).aggregate([]).num_rows < table.num_rows:
            raise InputError(f"{name}: two rows have the same {' and '.join(keys)}")
        if not table.num_rows:
            return
        part = self._parts.setdefault((name, split), _Part(self._folder / name, split))
        part.add(table.replace_schema_metadata(self._about))

    def close(self) -> list[WrittenTable]:
        """Write the rows that wait, and list the files."""
        return [
            WrittenTable(name, split, path, rows)
            for (name, split), part in sorted(self._parts.items())
            for path, rows in part.close()
        ]


class _Part:
    """Writes the files of one table and split."""

    def __init__(self, folder: Path, split: str) -> None:
        self._folder, self._split = folder, split
        self._waiting: list[Any] = []
        self._writer: Any = None
        self._stream: BinaryIO | None = None
        self._rows: list[int] = []
        folder.mkdir(parents=True, exist_ok=True)

    def add(self, table: Any) -> None:
        self._waiting.append(table)
        if sum(each.num_rows for each in self._waiting) >= GROUP_ROWS:
            self._flush()

    def close(self) -> list[tuple[Path, int]]:
        if self._waiting:
            self._flush()
        self._end_file()
        files = len(self._rows)
        named = [self._folder / f"{self._split}-{i:05}-of-{files:05}.parquet" for i in range(files)]
        return [
            (self._path(i).rename(path), rows)
            for i, (path, rows) in enumerate(zip(named, self._rows, strict=True))
        ]

    def _path(self, number: int) -> Path:
        return self._folder / f".{self._split}-{number:05}"

    def _flush(self) -> None:
        table = _pyarrow().concat_tables(self._waiting)
        self._waiting.clear()
        if self._writer is None:
            path = self._path(len(self._rows))
            self._stream = path.open("wb")
            self._writer = _parquet().ParquetWriter(self._stream, table.schema, **PAGES)
            self._rows.append(0)
        self._writer.write_table(table, row_group_size=table.num_rows)
        self._rows[-1] += table.num_rows
        if self._rows[-1] >= FILE_ROWS:
            self._end_file()

    def _end_file(self) -> None:
        if self._writer is not None and self._stream is not None:
            self._writer.close()
            self._stream.close()
            self._writer = self._stream = None

    def abandon(self) -> None:
        """Close the open file after a failure such as a full disk."""
        if self._stream is not None:
            with suppress(OSError):
                self._stream.close()


def read_columns(paths: Sequence[Path], name: Name) -> Columns:
    """Read the columns of a table's files, one after another, as arrays (rows, ..).

    Null is NaN in columns of floats, and -1 in columns of whole numbers. Text and truth values are
    objects, with None for null.

    Raises:
        InputError: A file is damaged.
    """
    rows = [row for path in paths for row in read_rows(path, name)]
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
    """Replace every number that is not finite by None."""
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
            "datasets are Parquet files, which need pyarrow: pip install 'graspproof[dataset]'"
        ) from error


def _parquet() -> Any:
    return importlib.import_module("pyarrow.parquet")
