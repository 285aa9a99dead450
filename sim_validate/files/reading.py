"""Reads files up to a size limit, and writes files so that they are complete or absent."""

import io
import shutil
import tempfile
import zipfile
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.whole_files import bounded_bytes, write_parts

MAX_TEXT_BYTES = 256 * 2**20
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
"""Byte order marks of UTF-8 and UTF-16."""


class NotTextError(InputError):
    """Error for a file whose bytes are not UTF-8 text."""


def read_bytes(path: Path, most: int = MAX_TEXT_BYTES) -> bytes:
    """Read a regular file; pipes and devices are refused, because they may never end.

    Raises:
        InputError: The file cannot be read, is not a regular file, or is larger than `most` bytes.
    """
    try:
        data = bounded_bytes(path, most)
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be read ({error.strerror}); give the path of a readable file"
        ) from error
    if len(data) > most:
        raise InputError(f"{path}: the file is larger than {most} bytes; give a smaller file")
    return data


def read_text(path: Path, most: int = MAX_TEXT_BYTES) -> str:
    """Read the text of a file.

    Raises:
        InputError: The file cannot be read, is too large, or is not UTF-8.
    """
    try:
        return text_of(read_bytes(path, most))
    except NotTextError as error:
        raise InputError(f"{path}: {error}") from error


def text_of(data: bytes) -> str:
    """Decode the bytes of a file; line ends of Windows become plain ones.

    Raises:
        NotTextError: The bytes are not UTF-8.
    """
    if data.startswith(MARKS):
        raise NotTextError("the text begins with a byte order mark; save it as UTF-8 without one")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise NotTextError(
            f"the file is not UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8"
        ) from error
    return text.replace("\r\n", "\n")


def write_text(path: Path, text: str) -> Path:
    """Write text by renaming a complete file into place; folders are made as needed."""
    return write_parts(path, [text.encode()])


def write_bytes(path: Path, data: bytes) -> Path:
    """Write bytes by renaming a complete file into place; folders are made as needed."""
    return write_parts(path, [data])


def write_lines(path: Path, lines: Iterable[str]) -> Path:
    """Write lines as `write_text` does, one at a time; each ends with its own line break."""
    return write_parts(path, (line.encode() for line in lines))


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Write named arrays, compressed, as `numpy.load` reads them."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            # A member made this way has a fixed date, so that equal arrays give equal files.
            member = zipfile.ZipInfo(f"{name}.npy")
            with archive.open(member, "w") as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)
    return write_parts(path, [held.getvalue()])


@contextmanager
def whole_folder(folder: Path) -> Generator[Path]:
    """Yield a temporary folder that becomes `folder` on success, and is removed on failure.

    Raises:
        InputError: The folder exists and is not empty.
    """
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; give another --out")
    named = folder.resolve()
    named.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=named.parent, prefix=".unfinished-"))
    try:
        yield temporary
        temporary.chmod(0o755)
        temporary.replace(named)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
