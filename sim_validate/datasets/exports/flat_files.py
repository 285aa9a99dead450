"""Tables of a dataset -> CSV and JSON Lines, one text file per table, with `about.json`.

CSV has one column per number: `contact_points_m_0_x` belongs to the first contact, `wrench_n_nm_fx`
is a force. Null is an empty cell. Text is in quotes; text that a spreadsheet could take for a
formula, or that begins with an apostrophe, gets an apostrophe in front, which readers must remove.
JSON Lines have one row per line, nested, with null.
"""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from sim_validate.datasets.columns import TABLES, Column, Name
from sim_validate.datasets.open_dataset import Selection
from sim_validate.files.reading import write_lines, write_text

Row: TypeAlias = Mapping[str, Any]
PARTS = {3: tuple("xyz"), 4: tuple("0123"), 6: ("fx", "fy", "fz", "tx", "ty", "tz")}
"""Names of the places in a cell, by how many there are: a point, fingers, a wrench."""
FORMULA = "=+-@\uff1d\uff0b\uff0d\uff20'"
"""First letters of cells that spreadsheets calculate, also in full width, and the apostrophe that
marks text."""


def write_csv(
    chosen: Selection, folder: Path, report: Callable[[int, int], None]
) -> dict[Name, int]:
    """Write one CSV file per table.

    Raises:
        InputError: The dataset is damaged.
    """

    def write(name: Name) -> None:
        write_lines(folder / f"{name}.csv", _csv_lines(chosen, name))

    return write_tables(chosen, folder, report, write)


def write_jsonl(
    chosen: Selection, folder: Path, report: Callable[[int, int], None]
) -> dict[Name, int]:
    """Write one file of JSON Lines per table.

    Raises:
        InputError: The dataset is damaged.
    """

    def write(name: Name) -> None:
        lines = (json.dumps(row, allow_nan=False) + "\n" for row in chosen.rows(name))
        write_lines(folder / f"{name}.jsonl", lines)

    return write_tables(chosen, folder, report, write)


def write_tables(
    chosen: Selection,
    folder: Path,
    report: Callable[[int, int], None],
    write: Callable[[Name], None],
) -> dict[Name, int]:
    """Write a file for each table, and `about.json` with the dataset's origin and its columns.

    Args:
        chosen: The dataset, or the split to write.
        folder: Folder to write into.
        report: Called with (written, total) after each table.
        write: Writes one table.
    """
    for done, name in enumerate(TABLES, start=1):
        write(name)
        report(done, len(TABLES))
    columns = {name: [asdict(column) for column in table] for name, table in TABLES.items()}
    about = {"dataset": chosen.facts(), "columns": columns}
    write_text(folder / "about.json", json.dumps(about, indent=1) + "\n")
    return chosen.counts()


def _csv_lines(chosen: Selection, name: Name) -> Iterator[str]:
    columns = TABLES[name]
    yield ",".join(part for column in columns for part in _names(column)) + "\n"
    for row in chosen.rows(name):
        yield ",".join(cell for column in columns for cell in _cells(column, row)) + "\n"


def _names(column: Column) -> list[str]:
    places = product(*(PARTS[size] for size in column.shape))
    return ["_".join((column.name, *place)) for place in places]


def _cells(column: Column, row: Row) -> list[str]:
    value = row[column.name]
    if value is None:
        return [""] * math.prod(column.shape)
    flat: list[Any] = np.array(value, dtype=object).ravel().tolist()
    return [_cell(part) for part in flat]


def _cell(value: object) -> str:
    """Write a plain value so that no spreadsheet takes it for a formula."""
    if value is None:
        return ""
    if not isinstance(value, str):
        return str(value).lower() if isinstance(value, bool) else repr(value)
    mark = "'" if value and (value[0] in FORMULA or not value[0].isprintable()) else ""
    return '"' + mark + value.replace('"', '""') + '"'
