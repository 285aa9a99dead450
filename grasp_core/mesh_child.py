"""The door to the process that reads mesh files: one for all files, ended when it takes too long.

Only numbers come back from it. It is begun with the first file, and goes when this process does.
"""

import atexit
import contextlib
import json
import os
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files import MeshLimits, mesh_bytes, mesh_kind

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
LONGEST_ANSWER = 2**16
"""Of a line that says what comes, or why nothing does."""
ROW_BYTES = 24
"""Of three coordinates, or three numbers of vertices."""
GRACE_S = 20.0
"""For the start of the process, on a busy machine."""


@dataclass(frozen=True, slots=True)
class _Child:
    """A running reader, and the two ends of what is said."""

    process: "subprocess.Popen[bytes]"
    requests: IO[bytes]
    answers: IO[bytes]

    def end(self) -> None:
        """Stop it, whatever it is doing."""
        self.process.kill()
        with contextlib.suppress(OSError):  # what was not sent yet has no reader now
            self.requests.close()
        self.answers.close()
        self.process.wait()


_lock = threading.Lock()
_children: dict[tuple[int, int], _Child] = {}
"""By process, as a fork must not share its parent's, and allowed memory."""


def read_triangles(path: Path, limits: MeshLimits) -> tuple[Array, Indices, bytes]:
    """Vertices (n, 3) in the file's unit, triangles (t, 3), and the bytes of the file.

    Raises:
        MeshError: The file is not a whole mesh of a known format, or costs more than is allowed.
    """
    kind, data = mesh_kind(path), mesh_bytes(path, limits)
    asked = {
        "kind": kind,
        "bytes": len(data),
        "max_seconds": limits.max_seconds,
        "max_triangles": limits.max_triangles,
    }
    try:
        with _lock:
            points, corners = _asked(json.dumps(asked).encode() + b"\n" + data, limits)
    except MeshError as error:
        raise MeshError(error.reason, f"{path.name}: {error.message}") from error
    return points, corners, data


def _asked(request: bytes, limits: MeshLimits) -> tuple[Array, Indices]:
    """What a child answers; it is ended when it does not, and then the answer is a refusal."""
    child = _child(limits.max_memory_mib)
    alarm = threading.Timer(limits.max_seconds + GRACE_S, child.process.kill)
    alarm.start()
    try:
        child.requests.write(request)
        child.requests.flush()
        return _answer(child.answers)
    except MeshError:
        raise
    except (OSError, ValueError, KeyError, TypeError) as error:
        child.end()
        message = (
            f"reading it took more than {limits.max_seconds:g} s or "
            f"{limits.max_memory_mib} MiB, or broke the reader; simplify the mesh, "
            "or export it again"
        )
        raise MeshError(MeshRefusal.LIMIT, message) from error
    except BaseException:  # an interrupt: what the child says next would answer another request
        child.end()
        raise
    finally:
        alarm.cancel()


def _answer(answers: IO[bytes]) -> tuple[Array, Indices]:
    """Read an answer, see `mesh_reader.answer`.

    Raises:
        MeshError: That is the answer.
        ValueError: It is none, or not whole.
    """
    said = dict[str, Any](json.loads(answers.readline(LONGEST_ANSWER)))
    if "reason" in said:
        raise MeshError(MeshRefusal(said["reason"]), str(said["message"]))
    vertices, triangles = int(said["vertices"]), int(said["triangles"])
    points = np.frombuffer(answers.read(ROW_BYTES * vertices), "<f8").reshape(vertices, 3)
    corners = np.frombuffer(answers.read(ROW_BYTES * triangles), "<i8").reshape(triangles, 3)
    return points, corners


def _child(memory: int) -> _Child:
    key = (os.getpid(), memory)
    found = _children.get(key)
    if found is None or found.process.poll() is not None:
        if found is not None:
            found.end()
        found = _children[key] = _begun(memory)
    return found


def _begun(memory: int) -> _Child:
    root = str(Path(__file__).parents[1])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    process = subprocess.Popen(  # noqa: S603 - this program of ours, with no words of users
        [sys.executable, "-P", "-m", "grasp_core.mesh_reader", str(memory)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        cwd="/",
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(paths)},
    )
    return _Child(process, cast("IO[bytes]", process.stdin), cast("IO[bytes]", process.stdout))


@atexit.register
def _end_all() -> None:
    for (process, _), child in _children.items():
        if process == os.getpid():
            child.end()
