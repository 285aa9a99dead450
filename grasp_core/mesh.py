"""The door to trimesh: mesh files read whole or refused, nearest points."""

import importlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal

FORMATS = ("obj", "stl", "ply", "off", "glb")
MAX_FILE_BYTES = 64 * 2**20
STL_HEADER, STL_TRIANGLE = 80, 50
"""Bytes of a binary STL file before the number of triangles, and of each triangle."""


def read_triangles(path: Path) -> tuple[Array, Indices, bytes]:
    """Vertices (n, 3) in the file's unit, triangles (t, 3), and the bytes of the file.

    Raises:
        MeshError: The file is not a whole mesh of a known format.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        message = f"{path.name}: the ending must be one of {', '.join(FORMATS)}, got {kind!r}"
        raise MeshError(MeshRefusal.FORMAT, message)
    try:
        size = path.stat().st_size
        data = path.read_bytes() if size <= MAX_FILE_BYTES else b""
    except OSError as error:
        message = f"{path}: cannot be read ({error.strerror}); check the path and its rights"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if size > MAX_FILE_BYTES:
        message = f"{path.name}: {size} bytes is over the limit of {MAX_FILE_BYTES}; simplify it"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    if not data:
        raise MeshError(MeshRefusal.EMPTY, f"{path.name}: the file is empty")
    if kind == "stl":
        _check_stl(path.name, data)
    expected = _obj_triangle_count(path.name, data) if kind == "obj" else None
    vertices, triangles = _parsed(path.name, kind, data)
    if expected is not None and expected != len(triangles):
        message = f"{path.name}: {expected} triangles are written, {len(triangles)} were readable"
        raise MeshError(MeshRefusal.UNREADABLE, message)
    return vertices, triangles, data


def _parsed(name: str, kind: str, data: bytes) -> tuple[Array, Indices]:
    try:
        scene = _trimesh("exchange.load").load_scene(
            io.BytesIO(data), file_type=kind, process=False, skip_materials=True
        )
        whole = scene.to_mesh() if scene.geometry else None
    except Exception as error:  # trimesh's parsers raise whatever the bytes led them to
        message = f"{name}: not a whole {kind.upper()} file; export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if whole is None or not len(getattr(whole, "faces", ())):
        raise MeshError(MeshRefusal.EMPTY, f"{name}: holds no triangles")
    return np.asarray(whole.vertices, dtype=np.float64), np.asarray(whole.faces, dtype=np.int64)


def _check_stl(name: str, data: bytes) -> None:
    """Refuse what is neither of the two kinds of STL file.

    Whether the parser finds text in other bytes depends on which libraries for guessing encodings
    are installed.

    Raises:
        MeshError: It is neither.
    """
    text = data.lstrip()[:5].lower() == b"solid"
    counted = int.from_bytes(data[STL_HEADER : STL_HEADER + 4], "little")
    if not text and len(data) != STL_HEADER + 4 + STL_TRIANGLE * counted:
        message = f"{name}: not a whole STL file; export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message)


def _obj_triangle_count(name: str, data: bytes) -> int:
    """Count the triangles an OBJ text declares, refusing what a lenient parser would skip."""
    vertices = triangles = 0
    for number, line in enumerate(data.decode("utf-8", errors="replace").splitlines(), 1):
        words = line.split()
        if not words or words[0] not in {"v", "f"}:
            continue
        try:
            if words[0] == "v":
                vertices += 1
                finite = len(words) > 3 and np.isfinite([float(word) for word in words[1:4]]).all()  # noqa: PLR2004 - v x y z
                if not finite:
                    raise MeshError(
                        MeshRefusal.NON_FINITE,
                        f"{name}, line {number}: a vertex needs three finite numbers",
                    )
                continue
            corners = [int(word.split("/")[0]) for word in words[1:]]
        except ValueError as error:
            message = f"{name}, line {number}: not a number ({error})"
            raise MeshError(MeshRefusal.UNREADABLE, message) from error
        if any(corner == 0 or abs(corner) > vertices for corner in corners):
            message = f"{name}, line {number}: a face names a vertex outside 1..{vertices}"
            raise MeshError(MeshRefusal.INDEX, message)
        triangles += max(len(corners) - 2, 0)
    return triangles


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
        nearest[place] = candidates[int(np.argmin(np.linalg.norm(candidates - point, axis=1)))]
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
