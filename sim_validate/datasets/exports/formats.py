"""Exports a finished dataset, or one of its splits, to formats that other programs read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

from grasp_core.errors import InputError
from sim_validate.datasets.columns import ExportFormat, Name, SplitName
from sim_validate.datasets.exports.isaac import write_isaac
from sim_validate.datasets.exports.mjcf import write_mjcf
from sim_validate.datasets.exports.tables import (
    archive,
    csv_file,
    json_lines,
    write_hdf5,
    write_tables,
)
from sim_validate.datasets.open_dataset import Selection, select
from sim_validate.datasets.parquet import pyarrow
from sim_validate.files.writing import whole_folder

Exporter: TypeAlias = Callable[[Selection, Path, Callable[[int, int], None]], dict[Name, int]]
EXPORTERS: Mapping[ExportFormat, Exporter] = {
    "csv": partial(write_tables, csv_file),
    "jsonl": partial(write_tables, json_lines),
    "npz": partial(write_tables, archive),
    "hdf5": write_hdf5,
    "isaac": write_isaac,
    "mjcf": write_mjcf,
}
"""Functions that write each format into a folder and return the number of rows used. The first four
formats hold all rows, also of negative controls; the last two hold force-closed grasps only."""


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

    Takes `report` (written, total).
    """
    pyarrow()  # before any work, so that a missing library is named at once
    chosen = select(folder, split)
    if out.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f"{out}: this folder is inside the dataset to export; give an --out outside of it"
        )
    with whole_folder(out) as place:
        rows = EXPORTERS[to](chosen, place, report)
        files = sum(1 for _ in place.iterdir())
    return Exported(files, rows)
