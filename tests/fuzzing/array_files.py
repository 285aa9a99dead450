"""Readers of npz and Parquet files as targets."""

import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pyarrow import parquet

from sim_validate.datasets.columns import TABLES
from sim_validate.datasets.parquet import parquet_bytes, read_columns
from sim_validate.files.array_files import arrays_of
from sim_validate.planning.regions import ARRAYS, regions_of
from tests.fuzzing.targets import MEMORY, Target


def npz(**arrays: Any) -> bytes:
    """The bytes of an npz file."""
    held = io.BytesIO()
    np.savez(held, **arrays)
    return held.getvalue()


def _proof() -> dict[str, Any]:
    square = np.array([[0.0, 0, 0], [0.01, 0, 0], [0.01, 0.01, 0], [0, 0.01, 0]])
    up = np.tile([0.0, 0, 1], (4, 1))
    return {
        "grasp": np.array("c-0-1-2-3"), "axes": np.eye(6), "codes": np.full(64, 15, np.uint8),
        "forces": np.ones((64, 4, 3)), "normals": up, "friction": np.full(4, 0.5),
        "origin_m": np.zeros(3), "depths_m": np.zeros(4), "scale_m": np.array(0.1),
        "centers_m": np.ones((4, 3)), "disc_radius_m": np.array(0.004),
        "open_radius_m": np.array(np.inf), "open_choice_m": np.zeros((0, 3)),
        "open_wrench": np.zeros(0),
        **{f"{name}{i}_m": square for name in ("region", "border") for i in range(4)},
    }  # fmt: skip


def _plain(data: bytes, names: Any) -> dict[str, Any]:
    """What numpy reads."""
    with np.load(io.BytesIO(data), allow_pickle=False) as held:
        return {name: held[name] for name in names if name in held}


def _same_proof(data: bytes, found: Any) -> None:
    kept = _plain(data, ARRAYS)
    np.testing.assert_array_equal(kept["centers_m"], found.centers)
    np.testing.assert_array_equal(kept["region2_m"], found.regions[2].polygon)
    np.testing.assert_array_equal(kept["codes"], found.cover.codes)
    np.testing.assert_array_equal(kept["forces"], found.cover.forces)


def _rows() -> list[dict[str, Any]]:
    values = {"text": "a", "bool": True, "int": 1, "float": 0.5}
    return [
        {c.name: np.full(c.shape, values[c.kind]).tolist() for c in TABLES["objects"]}
        | {"object_id": name}
        for name in ("a" * 64, "b" * 64)
    ]


def _table(data: bytes) -> Any:
    with tempfile.NamedTemporaryFile(dir=MEMORY if MEMORY.is_dir() else None) as file:
        file.write(data)
        file.flush()
        return read_columns([Path(file.name)], "objects", TABLES)


def _same_table(data: bytes, found: Any) -> None:
    stated = parquet.read_table(io.BytesIO(data)).to_pydict()
    assert list(stated) == list(found)
    for name in ("object_id", "vertices"):
        missing = None if name == "object_id" else -1
        assert [missing if v is None else v for v in stated[name]] == found[name].tolist()


TARGETS = (
    Target("proof", lambda data: regions_of(arrays_of(data, ARRAYS)), lambda: [npz(**_proof())],
           _same_proof, "npz"),
    Target("table", _table, lambda: [parquet_bytes("objects", _rows(), TABLES)], _same_table),
)  # fmt: skip
