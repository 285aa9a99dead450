"""Writes the Parquet files of a dataset, one group of rows after another."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from grasp_core.errors import InputError
from sim_validate.datasets.columns import KEYS, TABLES, Name, Tables
from sim_validate.datasets.parquet import GROUP_ROWS, PAGES, pyarrow, pyarrow_parquet, read_table

SPLIT = "split"
"""Column that takes the split that the rows are added to."""
FILE_ROWS = 500_000
"""Number of rows at which a file is closed and the next one begun, about 100 MB of grasps."""


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
        arrow, keys = pyarrow(), list(KEYS[name])
        table = arrow.concat_tables([read_table(path, name, self._tables) for path in paths])
        table = table.sort_by([(key, "ascending") for key in keys])
        if table.group_by(keys).aggregate([]).num_rows < table.num_rows:
            raise InputError(
                f"table {name}: two rows have the same {' and '.join(keys)}; build the dataset "
                "again into an empty folder"
            )
        if not table.num_rows:
            return
        if SPLIT in table.column_names:
            place = table.column_names.index(SPLIT)
            every = arrow.array([split] * table.num_rows, type=arrow.string())
            table = table.set_column(place, table.schema.field(place), every)
        part = self._parts.setdefault((name, split), _Part(self._folder / name, split))
        part.add(table.replace_schema_metadata(self._about))

    def close(self) -> list[WrittenTable]:
        """Write the rows that still wait, and list the files."""
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
