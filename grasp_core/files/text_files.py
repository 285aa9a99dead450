"""Reads regular files up to a size limit, as bytes or UTF-8 text, and writes whole files or none.

A new file is written under another name, and is renamed when it is complete.
"""

import os
import shutil
import stat
import tempfile
from collections.abc import Iterable
from pathlib import Path

from grasp_core.errors import InputError, about
from grasp_core.time_spent import TIME_SPENT

UNFINISHED = ".unfinished-"
"""Part of the name of a file that is still being written, or whose writing process was killed."""
SHOWN = 40
"""Largest number of characters that the name of an unfinished file repeats of the final name."""


@TIME_SPENT.on("files")
def write_parts(path: Path, parts: Iterable[bytes]) -> Path:
    """Write a file from parts of bytes; missing folders are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".{path.name[:SHOWN]}{UNFINISHED}"
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=prefix, suffix=path.suffix)
        temporary = Path(name)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.writelines(parts)
                stream.flush()
                os.fsync(handle)
            temporary.chmod(0o644)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    return path


def remove_unfinished(folder: Path) -> None:
    """Remove what killed processes left unfinished in a folder to which nothing is writing now."""
    for path in folder.glob(f".*{UNFINISHED}*"):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


POINTER = b"version https://git-lfs.github.com/spec/"
"""First bytes of the small text that Git LFS leaves in place of a large file."""


def bounded_bytes(path: Path, most: int) -> bytes:
    """Read a regular file, or its first `most + 1` bytes; pipes, which could block, are refused."""
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
            data = stream.read(most + 1)
    finally:
        os.close(handle)
    if data.startswith(POINTER):
        raise InputError(
            "the file is a pointer of Git LFS, which stands for the file itself; fetch that with "
            "`git lfs pull`"
        )
    return data


MAX_TEXT_BYTES = 256 * 2**20
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
"""Byte order marks of UTF-8 and UTF-16."""


def read_bytes(path: Path, most: int = MAX_TEXT_BYTES) -> bytes:
    """Read a regular file; pipes and devices are refused, because they may never end."""
    try:
        with about(path):
            data = bounded_bytes(path, most)
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be read ({error.strerror}); give the path of a readable file"
        ) from error
    if len(data) > most:
        raise InputError(f"{path}: the file is larger than {most} bytes; give a smaller file")
    return data


def read_text(path: Path, most: int = MAX_TEXT_BYTES) -> str:
    """Read the text of a file."""
    data = read_bytes(path, most)
    with about(path):
        return text_of(data)


def text_of(data: bytes) -> str:
    """Decode the bytes of a file; line ends of Windows become plain ones."""
    if data.startswith(MARKS):
        raise InputError("the text begins with a byte order mark; save it as UTF-8 without one")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"the file is not UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8"
        ) from error
    return text.replace("\r\n", "\n")


def write_text(path: Path, text: str) -> Path:
    """Write text by renaming a complete file into place; folders are made as needed."""
    return write_parts(path, [text.encode()])
