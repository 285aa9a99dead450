"""Bytes of files that someone names: regular files only, and no more than are allowed."""

import os
import stat
from pathlib import Path


def bounded_bytes(path: Path, most: int) -> bytes:
    """The bytes of a file, or its first `most + 1` where there are more; pipes never block.

    Raises:
        OSError: It cannot be read, or is a folder, a pipe or a device.
    """
    try:
        handle = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
    except ValueError as error:
        raise OSError(None, f"no name of a file ({error})", str(path)) from error
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(None, "a folder, a pipe or a device", str(path))
        with os.fdopen(handle, "rb", closefd=False) as stream:
            return stream.read(most + 1)
    finally:
        os.close(handle)
