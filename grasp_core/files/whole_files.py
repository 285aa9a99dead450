"""Reads regular files up to a size limit, and writes files completely or not at all.

A new file is written under another name, and is renamed when it is complete.
"""

import os
import shutil
import stat
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path

UNFINISHED = ".unfinished-"
"""Part of the name of a file that is still being written, or whose writing process was killed."""
SHOWN = 40
"""Largest number of characters that the name of an unfinished file repeats of the final name."""


def write_parts(path: Path, parts: Iterable[bytes]) -> Path:
    """Write a file from parts of bytes; missing folders are made."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.writelines(parts)
        stream.flush()
        os.fsync(stream.fileno())
    return path


@contextmanager
def replacing(path: Path) -> Generator[Path]:
    """Yield another path with the same suffix to write to; afterwards that file replaces `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with _beside(path) as temporary:
            yield temporary
            temporary.chmod(0o644)
            temporary.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


@contextmanager
def _beside(path: Path) -> Generator[Path]:
    """Yield the path of an empty file in the same folder; the file is removed afterwards."""
    prefix = f".{path.name[:SHOWN]}{UNFINISHED}"
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=prefix, suffix=path.suffix)
    try:
        os.close(handle)
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove the files and folders that killed processes left unfinished in a folder.

    Nothing else may be writing to the folder meanwhile.
    """
    for path in folder.glob(f".*{UNFINISHED}*"):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def bounded_bytes(path: Path, most: int) -> bytes:
    """Read the bytes of a file, or its first `most + 1` bytes if it is longer.

    Named pipes are refused, so reading never blocks.
    """
    try:
        handle = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
    except ValueError as error:
        raise OSError(None, f"the path is not a valid file name ({error})", str(path)) from error
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(None, "the path is a folder, a pipe or a device", str(path))
        with os.fdopen(handle, "rb", closefd=False) as stream:
            return stream.read(most + 1)
    finally:
        os.close(handle)
