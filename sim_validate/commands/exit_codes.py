"""Chooses the exit code of a command, and the message, when it ends with an error.

Standard output and error do not stop the work when nobody reads them. If a reader leaves
(`| head`), it gets no more, and the command goes on: the files it writes and its exit code do not
depend on who reads. If standard output cannot take results for another reason, that is an error; if
standard error cannot take messages, that is not.
"""

import io
import sys
from contextlib import suppress
from enum import IntEnum
from typing import TextIO

from grasp_core.errors import (
    GraspError,
    InputError,
    SolverError,
    UndecidedError,
    UnfaithfulError,
)


class FlagsError(InputError):
    """Error for flags that contradict each other, or an unknown flag in a config file."""


class Exit(IntEnum):
    """Exit codes of the program `graspproof`."""

    GOOD = 0
    NEGATIVE = 1
    """The command ran, and at least one grasp or check failed."""
    USAGE = 2
    INTERNAL = 3
    INPUT = 4
    """The input was refused: a file, a flag or a value."""
    NONE = 5
    """No grasp of the object was found."""
    PARTIAL = 6
    INTERRUPTED = 130


def reason_of(error: GraspError | OSError) -> str:
    """Return the message of an error, with the name of the file that the error is about."""
    if isinstance(error, OSError):
        return f"{error.filename or 'output'}: {error.strerror or error}"
    return str(error)


def exit_code(error: GraspError | OSError) -> Exit:
    """Choose the exit code of a command that ended with an error."""
    if isinstance(error, FlagsError):
        return Exit.USAGE
    ours = (SolverError, UndecidedError, UnfaithfulError)
    return Exit.INTERNAL if isinstance(error, ours) else Exit.INPUT


def steady_streams() -> None:
    """Replace standard output and error by streams that survive a closed reader."""
    sys.stdout = _over(sys.stdout, BrokenPipeError)
    sys.stderr = _over(sys.stderr, OSError)


def _over(stream: TextIO, ignored: type[OSError]) -> TextIO:
    """Return a stream that drops what it cannot write where that fails with a certain error."""
    if not isinstance(stream, io.TextIOWrapper):  # closed, or another program's own stream
        return stream

    class Raw(io.FileIO):
        def write(self, data: object, /) -> int:
            try:
                return super().write(data)  # type: ignore[arg-type]
            except ignored:
                return len(memoryview(data))  # type: ignore[arg-type]

    buffered = io.BufferedWriter(Raw(stream.fileno(), "w", closefd=False))
    return io.TextIOWrapper(
        buffered,
        encoding=stream.encoding,
        errors="backslashreplace",  # a name may have letters that the terminal's encoding lacks
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def end_streams() -> None:
    """Drop standard output if it fails, before the interpreter flushes it.

    The failure has been reported by then; Python would add a message and an exit code of its own.
    """
    with suppress(OSError):
        if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison] - may be closed
            sys.stdout.flush()
            return
    sys.stdout = None
