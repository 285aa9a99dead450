"""Splits text into words and reads numbers, in ASCII only, which all readers read alike."""

import io
import math
import re
from collections.abc import Iterator, Sequence

from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.refusals import broken, shown

LONGEST_LINE = 2**20
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
CONTROL = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
OTHER_ALPHABETS = bytes(range(128)) + b"?" * 128
COMMENT = re.compile(rb"#[^\n]*")
CONTINUED = re.compile(rb"\\\r?\n")
CONTINUED_COMMENT = re.compile(rb"#[^\n]*\\\r?\n")
NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,9})?")
WHOLE = re.compile(rb"[+-]?\d{1,18}")
NOT_FINITE = re.compile(rb"[+-]?(nan|inf(inity)?)", re.IGNORECASE)
Where = str


def plain_text(data: bytes) -> bytes:
    """Text with one byte per character: comments and names in other alphabets become `?`.

    Raises:
        MeshError: The data are UTF-16, hold control characters, or have too long a line.
    """
    if data.startswith(UTF_16):
        broken("byte 0", "expected UTF-8 text, got UTF-16")
    text = data.removeprefix(BYTE_ORDER_MARK).translate(OTHER_ALPHABETS)
    if found := CONTROL.search(text):
        broken(f"byte {found.start()}", f"expected text, got the control character {found[0]!r}")
    for number, line in enumerate(io.BytesIO(text), 1):
        if len(line) > LONGEST_LINE:
            broken(f"line {number}", f"is longer than {LONGEST_LINE} bytes")
    return text


def tidied(text: bytes, *, continued: bool) -> bytes:
    """The words of each line with one space between them, without what follows a `#`.

    Args:
        text: Lines of text.
        continued: Whether a backslash at the end of a line continues it on the next.

    Raises:
        MeshError: A comment ends in a backslash: readers differ on whether it goes on.
    """
    if found := CONTINUED_COMMENT.search(text):
        line = text.count(b"\n", 0, found.start()) + 1
        broken(f"line {line}", "a comment ends in a backslash")
    whole = CONTINUED.sub(b"", text) if continued else text
    lines = COMMENT.sub(b"", whole).split(b"\n")
    return b"\n".join(b" ".join(line.split()) for line in lines)


def worded_lines(text: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the number and the words of each line that has words."""
    for number, line in enumerate(io.BytesIO(text), 1):
        words = line.split()
        if words:
            yield number, words


def numbers(words: Sequence[bytes], where: Where) -> list[float]:
    """Read words as finite numbers.

    Raises:
        MeshError: A word is not a finite number.
    """
    values = [float(word) if NUMBER.fullmatch(word) else _refused(word, where) for word in words]
    for word, value in zip(words, values, strict=True):
        if not math.isfinite(value):
            _refused(word, where)
    return values


def _refused(word: bytes, where: Where) -> float:
    if NOT_FINITE.fullmatch(word) or NUMBER.fullmatch(word):
        message = f"{where}: a coordinate must be finite, got {shown(word)}; repair it"
        raise MeshError(MeshRefusal.NON_FINITE, message)
    broken(where, f"expected a number, got {shown(word)!r}")


def whole(word: bytes, where: Where) -> int:
    """Read a word as a whole number.

    Raises:
        MeshError: The word is not a whole number.
    """
    if not WHOLE.fullmatch(word):
        broken(where, f"expected a whole number, got {shown(word)!r}")
    return int(word)
