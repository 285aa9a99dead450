"""Reads a mesh file: one regular file, by the rules of the format that its ending names.

Reading takes time and memory in proportion to the bytes of the file, and no more triangles than are
allowed are kept: `MeshLimits` bounds both.
"""

from dataclasses import dataclass
from pathlib import Path

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.files.whole_files import bounded_bytes
from grasp_core.mesh_files import glb, obj, off, ply, stl
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.refusals import shown
from grasp_core.mesh_files.rounding import single_rounding, text_rounding
from grasp_core.mesh_files.words import CONTROL, without_mark

READERS = {"obj": obj.read, "stl": stl.read, "ply": ply.read, "off": off.read, "glb": glb.read}
FORMATS = tuple(READERS)
OTHER_FILES = {
    b"\x1f\x8b": "a gzip archive", b"PK\x03\x04": "a zip archive", b"BZh": "a bzip2 archive",
    b"\xfd7zXZ": "an xz archive", b"7z\xbc\xaf": "a 7z archive", b"Rar!": "a rar archive",
    b"\x28\xb5\x2f\xfd": "a zstd archive", b"<?xml": "an XML file", b"<!DOCTYPE": "an HTML file",
    b"%PDF": "a PDF file", b"\x89PNG": "a picture", b"DRACO": "a Draco file",
}  # fmt: skip
"""First bytes of files that are not meshes, each with a name of the format for messages."""
MAGIC = {"ply": b"ply", "glb": b"gltf"}
"""First bytes of files of some formats, in small letters."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshFile:
    """The surface that a mesh file holds, in the file's unit of length."""

    vertices: Array
    """Vertices, (n, 3)."""
    triangles: Indices
    """Vertex indices, (t, 3)."""
    rounding: float
    """Largest rounding error of a coordinate that the numbers of the file show; 0 if they show
    none."""
    data: bytes
    """The bytes of the file."""

    def __post_init__(self) -> None:
        self.vertices.setflags(write=False)
        self.triangles.setflags(write=False)


def read_triangles(path: Path, limits: MeshLimits) -> MeshFile:
    """Read a mesh file."""
    try:
        kind = mesh_kind(path)
        return mesh_of_bytes(kind, _bytes_of(path, limits), limits.max_triangles)
    except MeshError as error:
        raise MeshError(error.reason, f"{path}: {error.message}") from error
    except MemoryError as error:
        message = f"{path}: reading it needs more memory than there is; simplify the mesh"
        raise MeshError(MeshRefusal.LIMIT, message) from error


def mesh_kind(path: Path) -> str:
    """Name the format of a mesh file by its ending."""
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        message = f"the file's ending must be one of {', '.join(FORMATS)}, got {kind!r}"
        raise MeshError(MeshRefusal.FORMAT, message)
    return kind


def mesh_of_bytes(kind: str, data: bytes, most: int) -> MeshFile:
    """Read the bytes of a mesh file."""
    text = data if kind == "stl" and stl.is_binary(data) else without_mark(data)
    check_beginning(kind, text)
    points, triangles, digits = READERS[kind](text, most)
    if not len(triangles):
        raise MeshError(MeshRefusal.EMPTY, "the file holds no triangles; export a surface mesh")
    rounding = single_rounding(points, digits) + text_rounding(points, digits)
    return MeshFile(points, triangles, rounding, data)


def _bytes_of(path: Path, limits: MeshLimits) -> bytes:
    try:
        data = bounded_bytes(path, limits.max_bytes)
    except OSError as error:
        message = f"the file cannot be read ({error.strerror}); check the path and its permissions"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if len(data) > limits.max_bytes:
        message = f"the file is over the limit of {limits.max_bytes} bytes; simplify the mesh"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    if not data:
        raise MeshError(MeshRefusal.EMPTY, "the file is empty; export it again")
    return data


def check_beginning(kind: str, data: bytes) -> None:
    """Refuse bytes that do not begin like a file of the given format."""
    for beginning, other in OTHER_FILES.items():
        if data.startswith(beginning):
            message = f"the file is {other}, expected {kind.upper()}; unpack or convert it first"
            raise MeshError(MeshRefusal.FORMAT, message)
    first = data[:4].lower()
    for other, beginning in MAGIC.items():
        if other != kind and first.startswith(beginning):
            message = (
                f"the file is {other.upper()} by its first bytes; rename it to end in .{other}"
            )
            raise MeshError(MeshRefusal.FORMAT, message)
    if kind == "stl" and not stl.is_text(data) and not stl.is_binary(data):
        begins = data[: stl.HEADER + 4]
        counted = int.from_bytes(begins[stl.HEADER :], "little")
        message = (
            "the file is neither a text nor a binary STL file: its count of "
            f"{counted} triangles would be {stl.HEADER + 4 + stl.TRIANGLE * counted} bytes, "
            f"but it has {len(data)}"
        )
        if not CONTROL.search(begins):
            message = (
                f"the file does not begin with `solid` as a text STL does, got {shown(begins)!r}"
            )
        message += "; export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message)
    if not first.startswith(MAGIC.get(kind, b"")):
        message = f"does not begin as a {kind.upper()} file does; export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message)
