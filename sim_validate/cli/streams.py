"""Standard output and error that do not stop the work when nobody reads them.

A reader that leaves (`| head`) gets no more, and the command goes on: what it writes to files, and
its exit code, do not depend on who looks on. Results that standard output cannot take are an
error; messages that standard error cannot take are not.
"""

import io
import sys
from contextlib import suppress
from typing import TextIO


class _Read(io.FileIO):
    """A stream for results, until its reader leaves."""

    def write(self, data: object, /) -> int:
        try:
            return super().write(data)  # type: ignore[arg-type]
        except BrokenPipeError:
            return len(memoryview(data))  # type: ignore[arg-type]


class _Told(io.FileIO):
    """A stream for messages, as far as it takes them."""

    def write(self, data: object, /) -> int:
        try:
            return super().write(data)  # type: ignore[arg-type]
        except OSError:
            return len(memoryview(data))  # type: ignore[arg-type]


def steady() -> None:
    """Make the standard streams of this process such ones; missing ones are let be."""
    sys.stdout = _over(sys.stdout, _Read)
    sys.stderr = _over(sys.stderr, _Told)


def _over(stream: TextIO, kind: type[io.FileIO]) -> TextIO:
    if not isinstance(stream, io.TextIOWrapper):  # closed, or somebody's own
        return stream
    buffered = io.BufferedWriter(kind(stream.fileno(), "w", closefd=False))
    return io.TextIOWrapper(
        buffered,
        encoding=stream.encoding,
        errors="backslashreplace",  # a name that the terminal's letters cannot say
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def end() -> None:
    """Let go of standard output, whose failure has been told, before the interpreter looks at it.

    Python would end with a code and a message of its own.
    """
    with suppress(OSError):
        if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison] - a closed one is
            sys.stdout.flush()
            return
    sys.stdout = None
