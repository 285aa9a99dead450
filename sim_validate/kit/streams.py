"""Standard output and error that do not stop the work when nobody reads them.

If a reader leaves (`| head`), it gets no more, and the command goes on: the files it writes and its
exit code do not depend on who reads. If standard output cannot take results for another reason,
that is an error; if standard error cannot take messages, that is not.
"""

import io
import sys
from contextlib import suppress
from typing import TextIO


def steady() -> None:
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


def end() -> None:
    """Drop standard output if it fails, before the interpreter flushes it.

    The failure has been reported by then; Python would add a message and an exit code of its own.
    """
    with suppress(OSError):
        if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison] - may be closed
            sys.stdout.flush()
            return
    sys.stdout = None
