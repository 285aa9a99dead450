"""The door to the process that reads mesh files: one for all files, ended when it takes too long.

Only numbers come back from it. It is begun with the first file, and goes when this process does.
"""

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import mesh_bytes, mesh_kind

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
LONGEST_ANSWER = 2**16
"""Of a line that says what comes, or why nothing does."""
ROW_BYTES = 24
"""Of three coordinates, or three numbers of vertices."""
GRACE_S = 240.0
"""Beside the seconds of a processor that a file may cost, for a process that gets little of one: by
the weights of Linux, two seconds for its start take 75 s at niceness 10 beside four busy processes.
It only ends what hangs."""


@dataclass(frozen=True, slots=True)
class _Child:
    """A running reader, and the two ends of what is said."""

    process: "subprocess.Popen[bytes]"
    requests: int
    """Not buffered: a fork must not send twice what was half sent."""
    answers: IO[bytes]
    memory_mib: int

    def end(self) -> int:
        """Stop it, whatever it is doing; how it ended."""
        self.process.kill()
        self.answers.close()
        if self.process.stdin is not None:
            self.process.stdin.close()
        return self.process.wait()


class _State:
    """The reader of this process, if there is one, and who is talking to it."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.child: _Child | None = None


_state = _State()
os.register_at_fork(after_in_child=_state.__init__)


class _EndedError(Exception):
    """The reader ended without an answer."""


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
        with _state.lock:
            points, corners = _read(json.dumps(asked).encode() + b"\n" + data, limits)
    except MeshError as error:
        raise MeshError(error.reason, f"{path}: {error.message}") from error
    return points, corners, data


def _read(request: bytes, limits: MeshLimits) -> tuple[Array, Indices]:
    """What a reader answers; one that is ended by others is tried once more.

    Raises:
        MeshError: That is the answer, or it took too long, or no reader survives it.
    """
    try:
        return _asked(request, limits)
    except _EndedError:
        pass
    try:
        return _asked(request, limits)
    except _EndedError as error:
        message = f"no reader survives it ({error}); export it again"
        raise MeshError(MeshRefusal.LIMIT, message) from error


def _asked(request: bytes, limits: MeshLimits) -> tuple[Array, Indices]:
    child = _child(limits.max_memory_mib)
    late = threading.Event()

    def end() -> None:
        late.set()
        child.process.kill()

    alarm = threading.Timer(limits.max_seconds + GRACE_S, end)
    try:
        alarm.start()
        _send(child.requests, request)
        return _answer(child.answers)
    except MeshError:
        raise
    except (OSError, ValueError, KeyError, TypeError) as error:
        with contextlib.suppress(subprocess.TimeoutExpired):  # it may still be on its way out
            child.process.wait(1.0)
        code = child.process.poll()
        child.end()
        if late.is_set() or code == -signal.SIGXCPU:
            message = (
                f"reading it took more than {limits.max_seconds:g} s; simplify the mesh, or raise "
                "--max-mesh-seconds"
            )
            raise MeshError(MeshRefusal.LIMIT, message) from error
        raise _EndedError(f"exit code {code}") from error
    except BaseException:  # an interrupt: what the child says next would answer another request
        child.end()
        raise
    finally:
        alarm.cancel()


def _send(pipe: int, request: bytes) -> None:
    left = memoryview(request)
    while left:
        left = left[os.write(pipe, left) :]


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


def _child(memory_mib: int) -> _Child:
    """The reader, begun anew where it has ended, or has another limit."""
    found = _state.child
    if found is None or found.memory_mib != memory_mib or found.process.poll() is not None:
        if found is not None:
            found.end()
        found = _state.child = _begun(memory_mib)
    return found


def _begun(memory_mib: int) -> _Child:
    root = str(Path(__file__).parents[1])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    ours, theirs = os.pipe()
    try:
        process = subprocess.Popen(  # noqa: S603 - this program of ours, with no words of users
            [
                sys.executable,
                "-P",
                "-m",
                "grasp_core.mesh_files.child_main",
                str(memory_mib),
                str(theirs),
            ],
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[theirs],
            cwd="/",
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(paths)},
        )
    except BaseException:
        os.close(ours)
        raise
    finally:
        os.close(theirs)
    requests = cast("IO[bytes]", process.stdin).fileno()
    return _Child(process, requests, os.fdopen(ours, "rb"), memory_mib)


@atexit.register
def _end() -> None:
    if _state.child is not None:
        _state.child.end()
