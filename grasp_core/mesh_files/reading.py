"""Reads a mesh file's bytes: from a regular file, of a known kind, and not too many."""

from pathlib import Path

from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.files.whole_files import bounded_bytes
from grasp_core.mesh_files import stl
from grasp_core.mesh_files.limits import MeshLimits

FORMATS = ("obj", "stl", "ply", "off", "glb")
OTHER_FILES = {
    b"\x1f\x8b": "a gzip archive", b"PK\x03\x04": "a zip archive", b"BZh": "a bzip2 archive",
    b"\xfd7zXZ": "an xz archive", b"7z\xbc\xaf": "a 7z archive", b"Rar!": "a rar archive",
    b"\x28\xb5\x2f\xfd": "a zstd archive", b"<?xml": "an XML file", b"<!DOCTYPE": "an HTML file",
    b"%PDF": "a PDF file", b"\x89PNG": "a picture", b"DRACO": "a Draco file",
}  # fmt: skip
"""Beginnings of files of other kinds, and what to call them."""
MAGIC = {"ply": b"ply", "glb": b"glTF"}


def mesh_kind(path: Path) -> str:
    """The format of a file, by its ending.

    Raises:
        MeshError: The ending is not that of a format that is read.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        message = f"{path}: the ending must be one of {', '.join(FORMATS)}, got {kind!r}"
        raise MeshError(MeshRefusal.FORMAT, message)
    return kind


def mesh_bytes(path: Path, limits: MeshLimits) -> bytes:
    """The bytes of a mesh file; they begin as files with its ending do.

    Raises:
        MeshError: The file cannot be read, is not a regular file, too large, empty, or of
            another kind.
    """
    kind = mesh_kind(path)
    try:
        data = bounded_bytes(path, limits.max_bytes)
    except OSError as error:
        message = f"{path}: cannot be read ({error.strerror}); check the path and its rights"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if len(data) > limits.max_bytes:
        message = f"{path}: is over the limit of {limits.max_bytes} bytes; simplify the mesh"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    if not data:
        raise MeshError(MeshRefusal.EMPTY, f"{path}: the file is empty; export it again")
    try:
        check_beginning(kind, data)
    except MeshError as error:
        raise MeshError(error.reason, f"{path}: {error.message}") from error
    return data


def check_beginning(kind: str, data: bytes) -> None:
    """Refuse bytes that do not begin as files of a kind do.

    Raises:
        MeshError: The bytes begin otherwise.
    """
    for beginning, other in OTHER_FILES.items():
        if data.startswith(beginning):
            message = f"is {other}, expected {kind.upper()}; unpack or convert it first"
            raise MeshError(MeshRefusal.FORMAT, message)
    for other, beginning in MAGIC.items():
        if other != kind and data.startswith(beginning):
            message = f"is a {other.upper()} file by its beginning; rename it to .{other}"
            raise MeshError(MeshRefusal.FORMAT, message)
    if kind == "stl" and not stl.is_text(data) and not stl.is_binary(data):
        counted = int.from_bytes(data[stl.HEADER : stl.HEADER + 4], "little")
        message = (
            f"is neither a text nor a binary STL file: it says {counted} triangles, which is "
            f"{stl.HEADER + 4 + stl.TRIANGLE * counted} bytes, and has {len(data)}; export it again"
        )
        raise MeshError(MeshRefusal.UNREADABLE, message)
    if not data.startswith(MAGIC.get(kind, b"")):
        message = f"does not begin as a {kind.upper()} file does; export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message)
