"""Bytes of mesh files -> triangles, each file read twice; also a program of its own.

A strict reading of ours says what a file holds or where it breaks its format; trimesh must find the
same triangles. Run as `python -P -m grasp_core.mesh_files.child_main`, by `child` only, it
answers one request after another, with limits on memory and on the processor's time: a hostile file
may end it, but not the program that asked. It opens no files and no sockets.
"""

import json
import os
import signal
import sys
import time
import warnings
from typing import BinaryIO

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.geometry.mesh import parsed_by_trimesh
from grasp_core.mesh_files import glb, obj, off, ply, stl
from grasp_core.mesh_files.agreement import same_triangles
from grasp_core.mesh_files.words import plain_text, tidied

STRICT = {"obj": obj.read, "stl": stl.read, "ply": ply.read, "off": off.read, "glb": glb.read}
ROUNDING = {"glb": 1e-9}
"""Of matrices multiplied in another order; other formats write numbers as they are."""
ONE_READING = ("off",)
"""Formats whose strict reading stands where trimesh raises, as it does on pentagons: text of
counted lines that are all accounted for, which leaves nothing to read in another way."""
FORBIDDEN = ("socket.", "subprocess.", "os.", "shutil.", "pty.", "tempfile.", "urllib.", "http.")
LOOKING = ("os.listdir", "os.scandir", "os.putenv", "os.unsetenv")
"""What imports need."""
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def triangles_of(kind: str, data: bytes, most: int) -> tuple[Array, Indices]:
    """Vertices (n, 3) in the file's unit and triangles (t, 3).

    Args:
        kind: One of `mesh_files.FORMATS`.
        data: The file's bytes.
        most: Triangles that may be.

    Raises:
        MeshError: It is no whole file of its kind, or two readers find different triangles.
    """
    text = _text_of(kind, data)
    strict = STRICT[kind](text, most)
    if not len(strict[1]):
        raise MeshError(MeshRefusal.EMPTY, "holds no triangles; export surfaces")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = parsed_by_trimesh(kind, text)
    except (MemoryError, ImportError) as error:  # libraries that do not fit, either
        raise MemoryError from error
    except Exception as error:  # trimesh's parsers raise whatever the bytes led them to
        if kind in ONE_READING:
            return strict
        raise _ambiguous(kind, f"trimesh cannot read it ({type(error).__name__})") from error
    if not same_triangles(strict, found, ROUNDING.get(kind, 0.0)):
        raise _ambiguous(kind, f"trimesh finds others than the {len(strict[1])} that are written")
    return strict if kind in ROUNDING else found


def _ambiguous(kind: str, said: str) -> MeshError:
    remedy = "export it in another format, or without names and negative indices"
    return MeshError(
        MeshRefusal.AMBIGUOUS, f"this {kind.upper()} has two readings: {said}; {remedy}"
    )


def _text_of(kind: str, data: bytes) -> bytes:
    """Text as both readers see it alike; binary data as it is."""
    if kind in {"obj", "off"}:
        return tidied(plain_text(data), continued=kind == "obj")
    text = (kind == "stl" and not stl.is_binary(data)) or (kind == "ply" and ply.is_text(data))
    return plain_text(data) if text else data


def answer(requests: BinaryIO, answers: BinaryIO) -> bool:
    """Answer one request; False where there are to be no more.

    A request is a line of JSON and the bytes of a file; an answer a line of JSON and the bytes of
    vertices and triangles, or the reason why there are none.
    """
    line = requests.readline()
    if not line:
        return False
    asked = json.loads(line)
    data = requests.read(asked["bytes"])
    goes_on = True
    _limit_processor(asked["max_seconds"])
    try:
        points, corners = triangles_of(asked["kind"], data, asked["max_triangles"])
        said: dict[str, int | str] = {"vertices": len(points), "triangles": len(corners)}
        arrays = [np.ascontiguousarray(points, "<f8"), np.ascontiguousarray(corners, "<i8")]
    except MeshError as error:
        said, arrays = {"reason": error.reason, "message": error.message}, []
    except (MemoryError, RecursionError) as error:
        message = (
            f"reading it needs more memory than is allowed ({type(error).__name__}); simplify it, "
            "or raise --max-mesh-memory-mib"
        )
        said, arrays = {"reason": MeshRefusal.LIMIT, "message": message}, []
        goes_on = False  # with half of a library, perhaps
    answers.write(json.dumps(said).encode() + b"\n" + b"".join(each.tobytes() for each in arrays))
    answers.flush()
    return goes_on


def _limit_processor(seconds: float) -> None:
    import resource

    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    soft = int(time.process_time() + seconds) + 1
    allowed = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
    resource.setrlimit(resource.RLIMIT_CPU, (allowed, hard))


def _limit_memory(size: int) -> None:
    import resource

    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    allowed = size if hard == resource.RLIM_INFINITY else min(size, hard)
    resource.setrlimit(resource.RLIMIT_AS, (allowed, allowed))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _guard(event: str, given: tuple[object, ...]) -> None:
    """Refuse what no reader of bytes needs; the import of libraries goes on."""
    if event.startswith(FORBIDDEN) and event not in LOOKING:
        raise PermissionError(f"a reader of meshes has no need of {event}")
    if event == "open" and isinstance(given[2], int) and given[2] & WRITING:
        raise PermissionError("a reader of meshes writes no files")
    if event == "open" and isinstance(given[0], str | bytes) and not _is_library(given[0]):
        raise PermissionError("a reader of meshes opens no other files")


def _is_library(name: str | bytes) -> bool:
    return os.path.realpath(os.fsdecode(name)).startswith(ROOTS)


ROOTS = tuple(
    os.path.realpath(root) + os.sep
    for root in {sys.prefix, sys.base_prefix, *sys.path}
    if root.startswith(os.sep)
)
"""Folders of libraries."""


def main(memory_mib: str, pipe: str) -> None:
    """Answer requests on standard input until it ends.

    Args:
        memory_mib: How much memory may be used.
        pipe: The number of an open file for answers; standard output is for what libraries print.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # that is for the program that asks
    sys.dont_write_bytecode = True
    _limit_memory(2**20 * int(memory_mib))
    with os.fdopen(int(pipe), "wb") as answers:
        sys.addaudithook(_guard)
        while answer(sys.stdin.buffer, answers):
            pass


if __name__ == "__main__":
    main(*sys.argv[1:])
