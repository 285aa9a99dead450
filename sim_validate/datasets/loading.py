"""A dataset's tables as arrays."""

from pathlib import Path

from grasp_core.checked import path_of
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.parquet import Columns, read_columns


def load_dataset(folder: str | Path, split: str | None = None) -> dict[Name, Columns]:
    """The tables of a dataset, each a dictionary of its columns.

    Args:
        folder: Of the dataset.
        split: `train`, `validation` or `test`; everything if not given.

    Returns:
        By table and column, arrays with a row per row: contact points, say, are (n, 4, 3) [m].
        Missing numbers are NaN, or -1 in columns of whole numbers; missing text is None.

    Raises:
        InputError: There is no such split, no finished dataset, or a file is damaged.
    """
    chosen = select(path_of(folder, "folder"), split)
    return {name: read_columns(chosen.paths(name), name) for name in TABLES}
