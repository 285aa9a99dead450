"""A finished dataset, or one of its splits -> the formats that other programs read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from grasp_core.errors import InputError
from sim_validate.datasets.columns import ExportFormat, Name, SplitName
from sim_validate.datasets.exports.array_files import write_npz
from sim_validate.datasets.exports.flat_files import write_csv, write_jsonl
from sim_validate.datasets.exports.hdf5 import write_hdf5
from sim_validate.datasets.exports.isaac import write_isaac
from sim_validate.datasets.exports.mjcf import write_mjcf
from sim_validate.datasets.open_dataset import Selection, select
from sim_validate.datasets.parquet import require_pyarrow
from sim_validate.files.reading import whole_folder

Exporter: TypeAlias = Callable[[Selection, Path, Callable[[int, int], None]], dict[Name, int]]
EXPORTERS: Mapping[ExportFormat, Exporter] = {
    "csv": write_csv,
    "jsonl": write_jsonl,
    "npz": write_npz,
    "hdf5": write_hdf5,
    "isaac": write_isaac,
    "mjcf": write_mjcf,
}
"""Functions that write each format into a folder and return the number of rows used. The first four
formats hold all rows, negative controls too; the last two hold closed grasps only."""


@dataclass(frozen=True, slots=True)
class Exported:
    """The result of an export."""

    files: int
    rows: dict[Name, int]
    """Number of rows of each table that were written, or turned into files."""


def export(
    folder: Path,
    to: ExportFormat,
    out: Path,
    split: SplitName | None,
    report: Callable[[int, int], None],
) -> Exported:
    """Write a dataset in another format; the same dataset gives the same bytes.

    Args:
        folder: Folder of the dataset.
        to: The format.
        out: Folder to make; it appears only when it is complete.
        split: The split whose objects are written; all if None.
        report: Called with (written, total) while writing.

    Raises:
        InputError: The dataset is missing, unfinished or damaged, the folder to make is inside it
            or holds something, or a package that the format needs is not installed.
    """
    require_pyarrow()
    chosen = select(folder, split)
    if out.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{out}: is in the dataset, which holds nothing else; give another --out")
    with whole_folder(out) as place:
        rows = EXPORTERS[to](chosen, place, report)
        files = sum(1 for _ in place.iterdir())
    return Exported(files, rows)
