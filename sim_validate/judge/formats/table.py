"""Reads a table of grasps that any tool can write, as npz, Parquet or JSON.

Ten lines of NumPy write one:

    import numpy as np
    np.savez(
        "grasps.npz",
        object=["mug", "bowl"],        # name of the object of each grasp, or of all
        scale=0.1,                     # factor on its mesh, of each or of all; 1 if left out
        joint_names=["j0", "j1"],      # of all; if left out, the order of the hand's file
        root_pose=root_pose,           # (n, 4, 4), or (n, 7): position, quaternion w, x, y, z
        joints_rad=joints,             # (n, j)
        squeeze_joints_rad=squeezing,  # (n, j), what servos are told to squeeze with
    )

| column | what it holds |
|---|---|
| `object` | name of the object, or path of its file or folder |
| `scale` | factor on the lengths of the object's mesh |
| `joint_names` | names of the joints in the hand's file |
| `root_pose` | pose of the hand's root (the world of its file) in the object's frame [m] |
| `joints_rad` | joint angles where the hand touches [rad] |
| `pregrasp_root_pose`, `pregrasp_joints_rad` | the same with open fingers |
| `squeeze_root_pose`, `squeeze_joints_rad` | the same as servos are told to squeeze |

Only `object`, `root_pose` and `joints_rad` must be there. A pregrasp or squeeze without a root has
that of the grasp. Other columns are left alone. The object's frame is that of its mesh, after its
lengths were multiplied by the scale.

A JSON file is an object with these columns as lists, or a list of one object for each grasp. A row
of a Parquet file is a grasp, with lists for poses, angles and names.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, cast

import numpy as np

from grasp_core.errors import InputError
from grasp_core.files.json_text import shown
from sim_validate.datasets.parquet import pyarrow
from sim_validate.files.array_files import ARRAY_KINDS, TEXT_KIND, arrays_of
from sim_validate.judge.formats.fields import (
    MOST_NUMBERS,
    Source,
    depth,
    entry,
    numbers,
    pose,
    scale,
)
from sim_validate.judge.records import GraspRecord, HandRecord, Posture

OF_ALL: Mapping[str, int] = {"object": 0, "scale": 0, "joint_names": 1}
"""Columns that may hold one value for all grasps, and the number of indices of that value."""
ROOT, JOINTS = "root_pose", "joints_rad"
STAGES = ("", "pregrasp_", "squeeze_")
COLUMNS = (*OF_ALL, *(stage + name for stage in STAGES for name in (ROOT, JOINTS)))
BATCH_ROWS = 16
"""Number of rows of a Parquet file in memory at a time: a few bytes can stand for a long row."""
MOST_COLUMN_BYTES = 128 * 2**20
"""Most bytes of a Parquet file's columns, before values that are repeated are written out."""


def columns_of_npz(data: bytes) -> dict[str, Any]:
    """Return the columns in the bytes of an npz file."""
    return arrays_of(data, COLUMNS, kinds=ARRAY_KINDS + TEXT_KIND)


def parquet_file(data: bytes) -> Any:
    """Open the bytes of a Parquet file; one that claims too much is refused."""
    arrow = pyarrow()
    try:
        file = arrow.parquet.ParquetFile(arrow.BufferReader(data), page_checksum_verification=True)
        about = file.metadata
        size = sum(about.row_group(k).total_byte_size for k in range(about.num_row_groups))
    except (OSError, ValueError, arrow.ArrowException) as error:
        raise InputError(f"the file is not Parquet, or is damaged ({shown(str(error))})") from error
    if not 0 <= size <= MOST_COLUMN_BYTES:
        raise InputError(f"the file claims {size} bytes, over {MOST_COLUMN_BYTES}; write several")
    return file


def read(found: Any, source: Source) -> Iterator[GraspRecord]:
    """Read columns, a list of rows, or an open Parquet file."""
    if isinstance(found, dict):
        rows, count = _rows_of_columns(cast("dict[str, Any]", found))
    elif isinstance(found, list):
        rows = cast("list[Any]", found)
        count = len(rows)
    else:
        rows, count = _rows_of_parquet(found), found.metadata.num_rows
    yield from source.records(rows, count, _record)


def _rows_of_columns(columns: Mapping[str, Any]) -> tuple[Iterable[Any], int]:
    """Return rows and their number."""
    told = {name: columns[name] for name in COLUMNS if columns.get(name) is not None}
    if not depth(entry(told, ROOT)):
        raise InputError(f"{ROOT} must have a pose for each grasp, got {shown(told[ROOT])}")
    count = len(told[ROOT])
    common = {name: told.pop(name) for name, own in OF_ALL.items()
              if name in told and depth(told[name]) <= own}  # fmt: skip
    for name, column in told.items():
        if depth(column) == 0 or len(column) != count:
            raise InputError(f"{name} must have an entry for each of the {count} poses of {ROOT}")
    rows = (common | {name: column[place] for name, column in told.items()}
            for place in range(count))  # fmt: skip
    return rows, count


def _rows_of_parquet(file: Any) -> Iterator[Any]:
    arrow = pyarrow()
    columns = [name for name in COLUMNS if name in file.schema_arrow.names]
    try:
        for batch in file.iter_batches(BATCH_ROWS, columns=columns):
            yield from batch.to_pylist()
    except (OSError, ValueError, arrow.ArrowException) as error:
        raise InputError(f"the file is damaged ({shown(str(error))})") from error


def _record(row: Any, name: str) -> HandRecord:
    def posture(stage: str) -> Posture | None:
        if stage and row.get(stage + JOINTS) is None:
            return None
        joints = numbers(entry(row, stage + JOINTS), stage + JOINTS)
        root = ROOT if row.get(stage + ROOT) is None else stage + ROOT
        return Posture(pose(entry(row, root), root), joints)

    grasp, pregrasp, squeeze = map(posture, STAGES)
    size, names = row.get("scale"), row.get("joint_names")
    return HandRecord(
        name, _texts(entry(row, "object")), 1.0 if size is None else scale(size, "scale"),
        () if names is None else _texts(names), cast("Posture", grasp), pregrasp, squeeze,
        np.eye(3),
    )  # fmt: skip


def _texts(value: Any) -> Any:
    """Return the texts of an array as Python has them; anything else is left as it is."""
    found: Any = value
    few = isinstance(value, np.ndarray | np.generic) and found.size <= MOST_NUMBERS
    return found.tolist() if few else found
