"""Reads regular files as bytes or UTF-8 text up to a size limit, and writes text files."""

from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.whole_files import bounded_bytes, write_parts

MAX_TEXT_BYTES = 256 * 2**20
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
"""Byte order marks of UTF-8 and UTF-16."""


class NotTextError(InputError):
    """Error for a file whose bytes are not UTF-8 text."""


def read_bytes(path: Path, most: int = MAX_TEXT_BYTES) -> bytes:
    """Read a regular file; pipes and devices are refused, because they may never end."""
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
    """Read the text of a file."""
    try:
        return text_of(read_bytes(path, most))
    except NotTextError as error:
        raise InputError(f"{path}: {error}") from error


def text_of(data: bytes) -> str:
    """Decode the bytes of a file; line ends of Windows become plain ones."""
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
