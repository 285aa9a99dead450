"""A dataset's tables as arrays."""

from pathlib import Path

from grasp_core.errors import InputError
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.rows import SPLITS
from sim_validate.datasets.tables import Columns, read_columns


def load_dataset(folder: str | Path, split: str | None = None) -> dict[Name, Columns]:
    """The tables of a dataset, each a dictionary of its columns.

    Args:
        folder: Of the dataset.
        split: `train`, `validation` or `test`; everything if not given.

    Returns:
        By table and column, arrays with a row per row: contact points, say, are (n, 4, 3) [m].
        Missing numbers are NaN, or 0 in columns of whole numbers; missing text is None.

    Raises:
        InputError: There is no such split, no finished dataset, or a file is damaged.
    """
    splits = [name for name, _ in SPLITS]
    if split is not None and split not in splits:
        raise InputError(f"split: expected one of {', '.join(splits)}, got {split!r}")
    root = Path(folder)
    manifest = read_manifest(root)
    return {
        name: read_columns(
            [root / each.path for each in manifest.of_table(name) if split in (None, each.split)],
            name,
        )
        for name in TABLES
    }
