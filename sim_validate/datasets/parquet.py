"""Reads and writes the Parquet files of a dataset.

Equal rows give equal bytes. Every page carries a checksum, and reading checks it: without that, a
flipped bit goes unnoticed. Units and meanings are in the metadata of the columns. A whole dataset
is written one group of rows after another, so that memory does not grow.
"""

import importlib
import io
import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.json_text import shown
from sim_validate.datasets.columns import CellKind, Cells, Column
from sim_validate.datasets.config import KEYS, Name
from sim_validate.datasets.rows import TABLES, Tables

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
MOST_ROWS, MOST_GROUP_BYTES = 10_000_000, 2**30
"""Largest number of rows of a file, and of bytes in a row group, that are read: twenty times what
is written."""
PAGES: Mapping[str, Any] = {
    "compression": "zstd",
    "write_page_checksum": True,
    "write_page_index": True,
}
FILE_ROWS = 500_000
"""Number of rows at which a file is closed and the next one begun, about 100 MB of grasps."""


def pyarrow() -> Any:
    """Import pyarrow, the library that reads and writes Parquet."""
    try:
        return importlib.import_module("pyarrow")
    except ImportError as error:
        raise InputError(
            "datasets are Parquet files, which need pyarrow: run pip install 'graspproof[dataset]' "
            "('.[dataset]' in a checkout)"
        ) from error


def pyarrow_parquet() -> Any:
    """Import the part of pyarrow that reads and writes Parquet."""
    return importlib.import_module("pyarrow.parquet")


def parquet_bytes(
    name: Name, rows: Sequence[Cells], about: Mapping[str, str], tables: Tables = TABLES
) -> bytes:
    """Encode the cells of one table's rows as the bytes of a file, sorted by their keys."""
    arrow, held = pyarrow(), io.BytesIO()
    schema = schema_of(tables[name]).with_metadata(dict(sorted(about.items())))
    try:
        table = arrow.Table.from_pylist(list(rows), schema=schema)
    except (arrow.ArrowInvalid, arrow.ArrowTypeError) as error:
        raise InputError(f"table {name}: a cell does not fit its column: {error}") from error
    pyarrow_parquet().write_table(_in_order(table, name), held, **PAGES)
    return held.getvalue()


def _in_order(table: Any, name: Name) -> Any:
    """Return a table sorted by its keys, which no two rows may share."""
    keys = list(KEYS[name])
    if table.group_by(keys).aggregate([]).num_rows < table.num_rows:
        raise InputError(
            f"table {name}: two rows have the same {' and '.join(keys)}; build the dataset again "
            "into an empty folder"
        )
    return table.sort_by([(key, "ascending") for key in keys])


def each_batch(path: Path, name: Name, tables: Tables = TABLES) -> Iterator[Any]:
    """Yield the rows of a file as Arrow's record batches, without holding all of them in memory."""
    with _opened(path, name, tables) as file:
        yield from file.iter_batches(GROUP_ROWS)


def read_table(path: Path, name: Name, tables: Tables) -> Any:
    """Read a file as an Arrow table and check all of its checksums."""
    with _opened(path, name, tables) as file:
        return file.read()


@contextmanager
def _opened(path: Path, name: Name, tables: Tables) -> Generator[Any]:
    """Open a file of one of the tables; any damage is raised as an `InputError`."""
    arrow, parquet = pyarrow(), pyarrow_parquet()
    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            came, wanted = file.schema_arrow, schema_of(tables[name])
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
    """Refuse a file that would not fit into memory, before anything is read."""
    groups = [claimed.row_group(i) for i in range(claimed.num_row_groups)]
    rows, largest = claimed.num_rows, max((each.total_byte_size for each in groups), default=0)
    if not 0 <= rows <= MOST_ROWS or not 0 <= largest <= MOST_GROUP_BYTES:
        raise InputError(
            f"{path}: the file claims {rows} rows, and {largest} bytes in one group of rows; the "
            f"limits are {MOST_ROWS} and {MOST_GROUP_BYTES}, so the file is not read"
        )


def read_columns(paths: Sequence[Path], name: Name, tables: Tables = TABLES) -> Columns:
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


def _as_array(column: Column, values: Sequence[Any]) -> NDArray[Any]:
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
def schema_of(columns: tuple[Column, ...]) -> Any:
    """Return columns of a table as an Arrow schema, with units and meanings as metadata."""
    arrow = pyarrow()
    found = list[Any]()
    for column in columns:
        kind = getattr(arrow, TYPES[column.kind])()
        for size in reversed(column.shape):
            kind = arrow.list_(kind, size)
        about = {"meaning": column.meaning} | ({"unit": column.unit} if column.unit else {})
        found.append(arrow.field(column.name, kind, metadata=about))
    return arrow.schema(found)


class TableFiles:
    """Writes the files of all tables, one after another for each table and split.

    Rows are kept back until there are enough for a group of rows, so memory does not grow. Use it
    in a `with` block; at its end no file is open, whatever happens.
    """

    def __init__(self, folder: Path, about: Mapping[str, str], tables: Tables = TABLES) -> None:
        self._folder, self._tables = folder, tables
        self._about = dict(sorted(about.items()))
        self._parts: dict[tuple[Name, str], _Part] = {}

    def __enter__(self) -> "TableFiles":
        return self

    def __exit__(self, *_: object) -> None:
        for part in self._parts.values():
            part.abandon()

    def add(self, name: Name, split: str, paths: Iterable[Path]) -> None:
        """Add the rows of some files; their keys must come after all that were added before."""
        tables = [read_table(path, name, self._tables) for path in paths]
        table = _in_order(pyarrow().concat_tables(tables), name)
        if table.num_rows:
            part = self._parts.setdefault((name, split), _Part(self._folder / name, split))
            part.add(table.replace_schema_metadata(self._about))

    def close(self) -> list[tuple[Name, str, Path, int]]:
        """Write the rows that still wait; list the files with table, split and number of rows."""
        return [
            (name, split, path, rows)
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
        table = pyarrow().concat_tables(self._waiting)
        self._waiting.clear()
        if self._writer is None:
            path = self._path(len(self._rows))
            self._stream = path.open("wb")
            self._writer = pyarrow_parquet().ParquetWriter(self._stream, table.schema, **PAGES)
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
