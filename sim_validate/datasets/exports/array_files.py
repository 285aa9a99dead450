"""Tables of a dataset -> NumPy archives without pickled objects, one file per table.

As in `load_dataset`, null is NaN in columns of floats and -1 in columns of whole numbers. Text has
a fixed width, and null is the empty text. Truth values are 1 and 0, and -1 for null.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_validate.datasets.columns import TABLES, Column, Name
from sim_validate.datasets.exports.flat_files import write_tables
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.parquet import Columns, read_columns
from sim_validate.files.reading import write_arrays

NULLS = {"float": "NaN", "int": "-1", "text": "empty", "bool": "-1"}
"""What stands for null in arrays, by kind of column."""


def write_npz(
    chosen: Selection, folder: Path, report: Callable[[int, int], None]
) -> dict[Name, int]:
    """Write one archive per table, with one array per column.

    Raises:
        InputError: The dataset is damaged.
    """

    def write(name: Name) -> None:
        write_arrays(folder / f"{name}.npz", plain_columns(chosen, name))

    return write_tables(chosen, folder, report, write)


def plain_columns(chosen: Selection, name: Name) -> Columns:
    """The columns of a table as arrays (rows, ..) of numbers and fixed-width text.

    Raises:
        InputError: The dataset is damaged.
    """
    found = read_columns(chosen.paths(name), name)
    return {column.name: _plain(column, found[column.name]) for column in TABLES[name]}


def _plain(column: Column, values: NDArray[Any]) -> NDArray[Any]:
    if column.kind == "bool":
        return np.array([-1 if value is None else int(value) for value in values], dtype=np.int8)
    if column.kind == "text":
        return np.array(["" if value is None else value for value in values], dtype=np.str_)
    return values
