"""A program of our own that does tasks which come through a pipe, one after the other.

It is no copy of the caller's program, as the processes of the module `multiprocessing` are: a
script needs no guard against being run again, and the folder that it works in may be gone.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from grasp_core.processes.messages import receive, send


class Process:
    """A process with the pipes to it and from it."""

    def __init__(self, make: Callable[..., Callable[[Any], Any]], *arguments: Any) -> None:
        """Start a process."""
        if not can_start():
            raise OSError("no Python program can be started beside this one")
        # not -m alone: the current folder must not come before the installed packages
        command = [sys.executable, "-P", "-m", "grasp_core.processes.worker"]
        self.program = subprocess.Popen(  # noqa: S603 - our own program
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(_places())},
        )  # fmt: skip
        self.tasks: IO[bytes] = _opened(self.program.stdin)
        self.answers: IO[bytes] = _opened(self.program.stdout)
        self._start = (make, arguments)

    def ask(self, task: Any) -> bytes:
        """Have a task done; return a pickled pair of result and error."""
        if self._start:
            send(self.tasks, self._start)
            self._start = ()
        send(self.tasks, task)
        return receive(self.answers)

    def end(self) -> None:
        """End the process, whatever it does."""
        self.program.kill()
        self.program.wait()

    def close(self) -> None:
        """Close the pipes; what was not sent is lost."""
        for pipe in (self.tasks, self.answers):
            with suppress(OSError):
                pipe.close()


def can_start() -> bool:
    """Tell whether Python is a program that can be started again, and not a part of another."""
    return bool(sys.executable) and not getattr(sys, "frozen", False)


def _places() -> list[str]:
    """List where this program finds modules; an empty place is the current folder, if any."""
    here = ""
    with suppress(OSError):
        here = str(Path.cwd())
    return [place for place in (path or here for path in sys.path) if place]


def _opened(pipe: IO[bytes] | None) -> IO[bytes]:
    if pipe is None:
        raise OSError("no pipe was opened")
    return pipe
