"""Reads a mesh file: one regular file, by the rules of the format that its ending names.

Binary STL files are rows of numbers, and `glb`, `ply` and `texts` read the other formats. Reading
takes time and memory in proportion to the bytes of the file, and no more triangles than are
allowed are kept: `MeshLimits` bounds both.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal, about
from grasp_core.files.text_files import bounded_bytes
from grasp_core.mesh_files.glb import read_glb
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.ply import read_ply
from grasp_core.mesh_files.polygons import single_rounding, text_rounding, too_many
from grasp_core.mesh_files.texts import read_obj, read_off, read_stl_text

FORMATS = ("obj", "stl", "ply", "off", "glb")
BEGINNINGS = {"ply": b"ply", "glb": b"gltf"}
"""First bytes of files of some formats, in small letters."""
STL_HEAD = 80
STL_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
BYTE_ORDER_MARK, UTF_16 = b"\xef\xbb\xbf", (b"\xff\xfe", b"\xfe\xff")
SHOWN = 100
"""Largest number of characters of a fault that a message quotes."""


class MeshFile(NamedTuple):
    """The surface that a mesh file holds, in the file's unit of length."""

    vertices: Array
    triangles: Indices
    rounding: float
    """Largest rounding error of a coordinate that the numbers of the file show; 0 if they show
    none."""
    data: bytes


def read_triangles(path: Path, limits: MeshLimits) -> MeshFile:
    """Read a mesh file."""
    with about(path):
        kind = path.suffix.lower().lstrip(".")
        if kind not in FORMATS:
            message = f"the file's ending must be one of {', '.join(FORMATS)}, got {kind!r}"
            raise MeshError(MeshRefusal.FORMAT, message)
        try:
            data = bounded_bytes(path, limits.max_mesh_bytes)
            if len(data) > limits.max_mesh_bytes:
                most = limits.max_mesh_bytes
                message = f"the file is over the limit of {most} bytes; simplify it"
                raise MeshError(MeshRefusal.TOO_MANY, message)
            return mesh_of_bytes(kind, data, limits.max_triangles)
        except OSError as error:
            message = f"the file cannot be read ({error.strerror}); check the path"
            raise MeshError(MeshRefusal.UNREADABLE, message) from error
        except MemoryError as error:
            message = "reading it needs more memory than there is; simplify the mesh"
            raise MeshError(MeshRefusal.LIMIT, message) from error


def mesh_of_bytes(kind: str, data: bytes, most: int) -> MeshFile:
    """Read the bytes of a mesh file, and judge the numbers that it holds."""
    for other, beginning in BEGINNINGS.items():
        if other != kind and data[:4].lower().startswith(beginning):
            message = f"the file is {other.upper()} by its first bytes; rename it to .{other}"
            raise MeshError(MeshRefusal.FORMAT, message)
    try:
        points, triangles, digits = _surface(kind, data, most)
    except (ValueError, OverflowError) as error:
        fault = "".join(c if c.isascii() and c.isprintable() else "?" for c in str(error)[:SHOWN])
        message = f"the file breaks the rules of {kind.upper()} ({fault}); export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if not len(triangles):
        raise MeshError(MeshRefusal.EMPTY, "the file holds no triangles; export a surface mesh")
    if not np.isfinite(points).all():
        message = "a coordinate is infinite, not a number, or too large; repair the mesh"
        raise MeshError(MeshRefusal.NON_FINITE, message)
    rounding = single_rounding(points, digits) + text_rounding(points, digits)
    return MeshFile(points, triangles, rounding, data)


def _surface(kind: str, data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Return the vertices (n, 3), triangles (t, 3) and coordinates' digits of a file."""
    count = int.from_bytes(data[STL_HEAD : STL_HEAD + 4], "little")
    if kind == "stl" and len(data) == STL_HEAD + 4 + STL_ROW.itemsize * count:
        if count > most:
            too_many(count, most)
        rows = np.frombuffer(data, STL_ROW, offset=STL_HEAD + 4)
        return *_unshared(rows["corners"].reshape(-1, 3).astype(np.float64)), 0
    if data.startswith(UTF_16):
        data = data.decode("utf-16", "replace").encode()
    data = data.removeprefix(BYTE_ORDER_MARK)
    if not data[:4].lower().startswith(BEGINNINGS.get(kind, b"")):
        raise ValueError("it begins otherwise")
    if kind == "glb":
        return *read_glb(data, most), 0
    if kind == "stl":
        written = read_stl_text(data, most)
        return *_unshared(written.array), written.digits
    if kind == "ply":
        points, digits, polygons = read_ply(data, most)
        return points, polygons.fans(points), digits
    written, polygons = (read_obj if kind == "obj" else read_off)(data, most)
    return written.array, polygons.fans(written.array), written.digits


def _unshared(points: Array) -> tuple[Array, Indices]:
    return points, np.arange(len(points)).reshape(-1, 3)
