"""Reads STL files, binary or text; their normals are ignored, as many programs write none."""

import re
from collections.abc import Iterator

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.polygon_soup import too_many
from grasp_core.mesh_files.refusals import broken, not_finite, shown
from grasp_core.mesh_files.rounding import TextPoints
from grasp_core.mesh_files.words import numbers, plain_text, worded_lines

HEADER, TRIANGLE = 80, 50
"""Bytes before the number of triangles in a binary file, and bytes of each triangle."""
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
FLOATS = 3
BEGINNING = re.compile(rb"\s*(#[^\r\n]*\s+)*solid", re.IGNORECASE)
KEYWORDS = frozenset(b"facet normal outer loop vertex endloop endfacet".split())
Lines = Iterator[tuple[int, list[bytes]]]
Words = Iterator[tuple[int, bytes]]


def is_binary(data: bytes) -> bool:
    """Tell whether the length of the file fits the triangle count of a binary STL."""
    counted = int.from_bytes(data[HEADER : HEADER + 4], "little")
    return len(data) == HEADER + 4 + TRIANGLE * counted


def is_text(data: bytes) -> bool:
    """Tell whether the bytes begin with `solid`, like a text STL, perhaps below comments."""
    return BEGINNING.match(data) is not None


def read(data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Read the vertices (3 t, 3), triangles (t, 3) and coordinates' digits of an STL file."""
    digits = 0
    if is_binary(data):
        points = _of_binary(data, most)
    else:
        read_points = _of_text(plain_text(data), most)
        points, digits = read_points.array, read_points.digits
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        not_finite(
            f"triangle {bad[0] // 3}", "a coordinate must be finite", points[bad[0]].tolist()
        )
    return points, np.arange(len(points)).reshape(-1, 3), digits


def _of_binary(data: bytes, most: int) -> Array:
    records = np.frombuffer(data, dtype=RECORD, offset=HEADER + 4)
    if len(records) > most:
        too_many(len(records), most)
    return records["corners"].reshape(-1, 3).astype(np.float64)


def _of_text(text: bytes, most: int) -> TextPoints:
    """Read the corners of all solids of a text STL; line breaks between words do not matter."""
    points = TextPoints()
    lines = worded_lines(text, comments=b"#" in text)
    for number, words in lines:
        _expect(number, words[0][: len(b"solid")], b"solid")  # its name may have no space before it
        inside = _until_its_end(lines)
        for place, word in inside:
            _expect(place, word, b"facet")
            _add_triangle(inside, points)
            if len(points) > 3 * most:
                too_many(len(points) // 3, most)
    return points


def _until_its_end(lines: Lines) -> Words:
    """Yield the words of a solid with their line numbers; `endsolid` and its name are left out."""
    for number, words in lines:
        for word in words:
            if word[0] in b"eE" and word.lower().startswith(b"endsolid"):
                return
            yield number, word
    broken("the end", "expected `endsolid`")


def _add_triangle(words: Words, points: TextPoints) -> None:
    """Read one triangle of a text STL, and add its corners to the points."""
    number, word = _next(words)
    for _ in range(1 + FLOATS):  # the word `normal` and its numbers, or not all of them
        if word.lower() != b"outer":
            number, word = _next(words)
    _expect(number, word, b"outer")
    _expect(*_next(words), b"loop")
    for _ in range(3):
        number, word = _next(words)
        _expect(number, word, b"vertex")
        three = [_next(words)[1] for _ in range(FLOATS)]
        if not KEYWORDS.isdisjoint(three):
            broken(f"line {number}", "a vertex needs three numbers, got fewer")
        points.add(three, numbers(three, f"line {number}"))
    _expect(*_next(words), b"endloop")
    _expect(*_next(words), b"endfacet")


def _next(words: Words) -> tuple[int, bytes]:
    word = next(words, None)
    if word is None:
        broken("the end", "the last triangle is incomplete")
    return word


def _expect(number: int, word: bytes, expected: bytes) -> None:
    if word.lower() != expected:
        wanted = expected.decode("ascii")
        broken(f"line {number}", f"expected `{wanted}`, got {shown(word)!r}")
