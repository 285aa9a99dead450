"""The door to trimesh: its reading of mesh files, and nearest points."""

import importlib
import io
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.ties import first_best


def parsed_by_trimesh(kind: str, data: bytes) -> tuple[Array, Indices]:
    """Vertices (n, 3) and triangles (t, 3) as trimesh finds them; none where it finds none.

    It guesses and skips where a file is broken, and raises whatever the bytes lead it to.
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


def nearest_on_surface(vertices: Array, triangles: Indices, points: Array) -> Array:
    """The surface point nearest to each of several points, (n, 3).

    Args:
        vertices: (v, 3) [m]
        triangles: (t, 3)
        points: (n, 3) [m]
    """
    corners = vertices[triangles]
    nearest = np.empty((len(points), 3))
    for place, point in enumerate(points):
        candidates = nearest_on_triangles(corners, point)
        nearest[place] = candidates[first_best(-np.linalg.norm(candidates - point, axis=1))]
    return nearest


def nearest_on_triangles(corners: Array, point: Array) -> Array:
    """The point of each of several triangles nearest to a point, (t, 3).

    Args:
        corners: (t, 3, 3) [m]
        point: (3,) [m]
    """
    closest_point: Any = _trimesh("triangles").closest_point
    return closest_point(corners, np.broadcast_to(point, (len(corners), 3)))


def _trimesh(submodule: str) -> Any:
    return importlib.import_module(f"trimesh.{submodule}")
