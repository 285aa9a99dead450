"""The door to trimesh, which reads mesh files."""

import importlib
import io
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices


def parsed_by_trimesh(kind: str, data: bytes) -> tuple[Array, Indices]:
    """Read vertices (n, 3) and triangles (t, 3) with trimesh; both empty where it finds none.

    Trimesh guesses and skips where a file is broken, and raises whatever the bytes lead it to.
    """
    scene = _trimesh("exchange.load").load_scene(
        io.BytesIO(data), file_type=kind, process=False, skip_materials=True
    )
    whole = scene.to_mesh() if scene.geometry else None
    points, corners = getattr(whole, "vertices", ()), getattr(whole, "faces", ())
    return (
        np.array(points, dtype=np.float64).reshape(-1, 3),
        np.array(corners, dtype=np.int64).reshape(-1, 3),
    )


def _trimesh(submodule: str) -> Any:
    return importlib.import_module(f"trimesh.{submodule}")
