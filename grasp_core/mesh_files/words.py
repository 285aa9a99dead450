"""Splits the text of mesh files into lines, words and numbers, in time linear in the bytes."""

import io
import math
import re
from collections.abc import Iterator, Sequence

from grasp_core.mesh_files.refusals import broken, not_finite, shown

LONGEST_LINE = 2**20
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
PADDING = b"\0\x1a"
"""Bytes that may follow the last line: zeros of a fixed length, and the end mark of old systems."""
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
OTHER_ALPHABETS = bytes(range(128)) + b"?" * 128
NUMBER = re.compile(rb"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d{1,9})?")
"""A decimal number; possessive groups (`++`) keep long wrong words from taking quadratic time."""
WHOLE = re.compile(rb"[+-]?\d{1,18}")
NOT_FINITE = re.compile(rb"[+-]?(nan(\(\w{0,40}\))?|inf(inity)?|1\.\?[a-z]+\d*)", re.IGNORECASE)
"""Spellings of what is not finite: of every C library, with the `#` of some as `plain_text` has it.
"""
Where = str


def without_mark(data: bytes) -> bytes:
    """Leave out the byte-order mark of a text, and turn UTF-16, which needs one, into UTF-8."""
    if data.startswith(UTF_16):
        return data.decode("utf-16", "replace").encode()
    return data.removeprefix(BYTE_ORDER_MARK)


def plain_text(data: bytes, start: int = 0) -> bytes:
    """Convert the bytes of a text file to ASCII with line-feed line ends.

    Letters outside ASCII, as in comments and names, become `?`, and so does the `#` of a number
    such as `1.#QNAN`, which begins no comment.
    """
    text = data[start:].rstrip(PADDING)
    if found := CONTROL.search(text):
        place = start + found.start()
        broken(f"byte {place}", f"expected text, got the control character {found[0]!r}")
    text = text.translate(OTHER_ALPHABETS).replace(b".#", b".?")
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def numbered_lines(text: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield each line with its number, from 1 on, one at a time to save memory."""
    for number, line in enumerate(io.BytesIO(text), 1):
        if len(line) > LONGEST_LINE:
            broken(f"line {number}", f"the line is longer than {LONGEST_LINE} bytes")
        yield number, line


def worded_lines(text: bytes, *, comments: bool = False) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the words of each line that is not blank, with the number of the line."""
    for number, line in numbered_lines(text):
        words = (line.partition(b"#")[0] if comments else line).split()
        if words:
            yield number, words


def numbers(words: Sequence[bytes], where: Where) -> list[float]:
    """Read words as finite numbers."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = [math.nan]
    # Python also takes underscores, and nan and inf, which would make the sum one of them
    if not math.isfinite(sum(values)) or b"_" in b"".join(words):
        values = [_finite(word, where) for word in words]
    return values


def check_unused(words: Sequence[bytes], where: Where) -> None:
    """Refuse words that are not numbers in unused columns, as colours; nan may be there."""
    try:
        for word in words:
            float(word)
    except ValueError:
        for word in words:
            if not (NUMBER.fullmatch(word) or NOT_FINITE.fullmatch(word)):
                broken(where, f"expected a number, got {shown(word)!r}")


def _finite(word: bytes, where: Where) -> float:
    value = float(word) if NUMBER.fullmatch(word) else math.nan
    return value if math.isfinite(value) else _refused(word, where)


def _refused(word: bytes, where: Where) -> float:
    if NOT_FINITE.fullmatch(word) or NUMBER.fullmatch(word):
        not_finite(where, "a coordinate must be finite", shown(word))
    broken(where, f"expected a number, got {shown(word)!r}")


def whole(word: bytes, where: Where) -> int:
    """Read a word as a whole number."""
    if not WHOLE.fullmatch(word):
        broken(where, f"expected a whole number, got {shown(word)!r}")
    return int(word)
