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
"""What writes each format into a folder and says how many rows it took. The first four hold all
rows, negative controls too; the last two hold closed grasps only."""


@dataclass(frozen=True, slots=True)
class Exported:
    """What came of an export."""

    files: int
    rows: dict[Name, int]
    """How many rows of each table were written, or made into something."""


def export(
    folder: Path,
    to: ExportFormat,
    out: Path,
    split: SplitName | None,
    report: Callable[[int, int], None],
) -> Exported:
    """Write a dataset in another format, the same bytes for the same dataset.

    Args:
        folder: Of the dataset.
        to: The format.
        out: Folder to make; when it is there, everything is in it.
        split: Whose objects; all if None.
        report: Told how much is written, and of how much.

    Raises:
        InputError: There is no finished dataset, it is damaged, the folder to make is in it or
            holds something, or what the format takes is not installed.
    """
    require_pyarrow()
    chosen = select(folder, split)
    if out.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{out}: is in the dataset, which holds nothing else; give another --out")
    with whole_folder(out) as place:
        rows = EXPORTERS[to](chosen, place, report)
        files = sum(1 for _ in place.iterdir())
    return Exported(files, rows)
