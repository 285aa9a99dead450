"""Tables of a dataset -> one HDF5 file, equal for equal rows; the only module that uses h5py.

The file has one group per table, and in it one dataset per column with its `unit`, its `meaning`
and the value that stands for `null`. The file's attributes say what made the dataset. Text is UTF-8
of fixed width.
"""

import importlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from sim_validate.datasets.columns import TABLES, Column, Name
from sim_validate.datasets.exports.array_files import NULLS, plain_columns
from sim_validate.datasets.open_dataset import Selection
from sim_validate.files.reading import write_bytes

FILE = "dataset.h5"


def write_hdf5(
    chosen: Selection, folder: Path, report: Callable[[int, int], None]
) -> dict[Name, int]:
    """Write all tables into one file.

    Raises:
        InputError: The dataset is damaged, or h5py is not installed.
    """
    h5py = _h5py()
    held = io.BytesIO()
    with h5py.File(held, "w") as file:
        file.attrs.update(chosen.facts())
        for done, (name, columns) in enumerate(TABLES.items(), start=1):
            group, arrays = file.create_group(name), plain_columns(chosen, name)
            for column in columns:
                _add(group, column, arrays[column.name])
            report(done, len(TABLES))
    write_bytes(folder / FILE, held.getvalue())
    return chosen.counts()


def _add(group: Any, column: Column, values: NDArray[Any]) -> None:
    if column.kind == "text":
        encoded = np.char.encode(values, "utf-8")
        values = encoded.astype(_h5py().string_dtype("utf-8", encoded.dtype.itemsize))
    # gzip refuses columns without rows
    packed = {"compression": "gzip", "shuffle": True} if len(values) else {}
    added = group.create_dataset(column.name, data=values, track_times=False, **packed)
    unit = {"unit": column.unit} if column.unit else {}
    added.attrs.update({**unit, "meaning": column.meaning, "null": NULLS[column.kind]})


def _h5py() -> Any:
    try:
        return importlib.import_module("h5py")
    except ImportError as error:
        raise InputError(
            "HDF5 files need h5py: pip install 'graspproof[hdf5]'; the other formats do not"
        ) from error
