"""Exports the tables of a dataset as CSV, JSON Lines, NumPy archives, or one HDF5 file.

CSV has one column per number: `contact_points_m_0_x` belongs to the first contact, `wrench_n_nm_fx`
is a force. Text that a spreadsheet could take for a formula, or that begins with an apostrophe,
gets an apostrophe in front, which readers must remove. JSON Lines have one row per line, nested,
with null. Arrays hold no pickled objects: null is NaN in columns of floats, -1 in columns of whole
numbers and truth values, and "" in columns of text, which has a fixed width.
"""

import importlib
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import reduce
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts, write_text
from sim_validate.datasets.columns import Column, Name
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.parquet import Columns, pyarrow, read_columns, schema_of
from sim_validate.files.writing import write_arrays, write_bytes, write_lines

PARTS = {3: tuple("xyz"), 4: tuple("0123"), 6: ("fx", "fy", "fz", "tx", "ty", "tz")}
"""Names of the components of a cell, by their number: of a point, four fingers, or a wrench. Others
are counted from 0."""
FORMULA = "^[=+\\-@\uff1d\uff0b\uff0d\uff20'\\pC\\pZ]"
"""Pattern of cells that a spreadsheet may calculate, also where signs are in full width or behind
space, and of cells that begin with the apostrophe that marks text."""
NULLS = {"float": "NaN", "int": "-1", "text": "empty", "bool": "-1"}
"""Value that stands for null in arrays, by type of column."""


def write_tables(
    write: Callable[[Selection, Name, Path], None],
    chosen: Selection,
    folder: Path,
    report: Callable[[int, int], None],
) -> dict[Name, int]:
    """Write a file for each table, and `about.json` with the dataset's origin and its columns.

    Takes `report` (written, total).
    """
    tables = chosen.tables
    for done, name in enumerate(tables, start=1):
        write(chosen, name, folder)
        report(done, len(tables))
    columns = {name: [asdict(column) for column in table] for name, table in tables.items()}
    about = {"dataset": chosen.facts(), "columns": columns}
    write_text(folder / "about.json", json.dumps(about, indent=1) + "\n")
    return chosen.counts()


def csv_file(chosen: Selection, name: Name, folder: Path) -> None:
    """Write a table as CSV with all text in quotes; null is an empty cell."""
    csv: Any = importlib.import_module("pyarrow.csv")
    columns = chosen.tables[name]

    def text(part: Any, *, header: bool) -> bytes:
        held = io.BytesIO()
        csv.write_csv(_flat(part, columns), held, csv.WriteOptions(include_header=header))
        return held.getvalue()

    rest = (text(part, header=False) for part in chosen.batches(name))
    write_parts(
        folder / f"{name}.csv", chain([text(schema_of(columns).empty_table(), header=True)], rest)
    )


def json_lines(chosen: Selection, name: Name, folder: Path) -> None:
    """Write a table as JSON Lines: one row per line, nested."""
    lines = (json.dumps(row, allow_nan=False) + "\n" for row in chosen.rows(name))
    write_lines(folder / f"{name}.jsonl", lines)


def archive(chosen: Selection, name: Name, folder: Path) -> None:
    """Write a table as an archive for `numpy.load`, with one array per column."""
    write_arrays(folder / f"{name}.npz", _plain_columns(chosen, name))


def write_hdf5(
    chosen: Selection, folder: Path, report: Callable[[int, int], None]
) -> dict[Name, int]:
    """Write all tables into one file, a group per table, with units and meanings as attributes."""
    try:
        h5py: Any = importlib.import_module("h5py")
    except ImportError as error:
        raise InputError(
            "writing HDF5 needs h5py: run pip install 'graspproof[hdf5]' ('.[hdf5]' in a "
            "checkout), or choose another format"
        ) from error
    held = io.BytesIO()
    with h5py.File(held, "w") as file:
        file.attrs.update(chosen.facts())
        for done, (name, columns) in enumerate(chosen.tables.items(), start=1):
            group, arrays = file.create_group(name), _plain_columns(chosen, name)
            for column in columns:
                values = arrays[column.name]
                if column.kind == "text":
                    encoded = np.char.encode(values, "utf-8")
                    values = encoded.astype(h5py.string_dtype("utf-8", encoded.dtype.itemsize))
                # gzip refuses columns without rows
                packed = {"compression": "gzip", "shuffle": True} if len(values) else {}
                added = group.create_dataset(column.name, data=values, track_times=False, **packed)
                unit = {"unit": column.unit} if column.unit else {}
                added.attrs.update(unit | {"meaning": column.meaning, "null": NULLS[column.kind]})
            report(done, len(chosen.tables))
    write_bytes(folder / "dataset.h5", held.getvalue())
    return chosen.counts()


def _flat(table: Any, of_table: Sequence[Column]) -> Any:
    """Return an Arrow table with one column per number; no text can pass for a formula."""
    compute: Any = importlib.import_module("pyarrow.compute")
    columns = dict[str, Any]()
    for column in of_table:
        if column.kind == "text":
            text = table[column.name]
            marked = compute.binary_join_element_wise("'", text, "")
            risky = compute.match_substring_regex(text, FORMULA)
            columns[column.name] = compute.if_else(risky, marked, text)
            continue
        for places in product(*(range(size) for size in column.shape)):
            words = map(_part, places, column.shape)
            columns["_".join((column.name, *words))] = reduce(
                compute.list_element, places, table[column.name]
            )
    return pyarrow().table(columns)


def _part(place: int, size: int) -> str:
    """Return the name of one component of several."""
    return PARTS[size][place] if size in PARTS else str(place)


def _plain_columns(chosen: Selection, name: Name) -> Columns:
    """Return the columns of a table as arrays (rows, ..) of numbers and fixed-width text."""
    found = read_columns(chosen.paths(name), name, chosen.tables)
    return {column.name: _plain(column, found[column.name]) for column in chosen.tables[name]}


def _plain(column: Column, values: NDArray[Any]) -> NDArray[Any]:
    if column.kind == "bool":
        cells = values.astype(np.float64)
        return np.where(np.isnan(cells), -1.0, cells).astype(np.int8)
    if column.kind == "text":
        return np.array(["" if value is None else value for value in values], dtype=np.str_)
    return values
