"""Reads STL, binary or text; normals are ignored, as many programs write none."""

from collections.abc import Iterator, Sequence

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.polygon_soup import too_many
from grasp_core.mesh_files.refusals import broken, shown
from grasp_core.mesh_files.words import numbers, worded_lines

HEADER, TRIANGLE = 80, 50
"""Bytes of a binary file before the number of triangles, and bytes of each triangle."""
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
Lines = Iterator[tuple[int, list[bytes]]]


def is_binary(data: bytes) -> bool:
    """Whether there are as many bytes as the count of triangles says."""
    counted = int.from_bytes(data[HEADER : HEADER + 4], "little")
    return len(data) == HEADER + 4 + TRIANGLE * counted


def is_text(data: bytes) -> bool:
    """Whether the bytes begin as an STL text does."""
    return data.lstrip()[:5].lower() == b"solid"


def read(data: bytes, most: int) -> tuple[Array, Indices]:
    """Vertices (3 t, 3), three for each triangle, and triangles (t, 3).

    Raises:
        MeshError: The file breaks a rule, or has more than `most` triangles.
    """
    points = _of_binary(data) if is_binary(data) else _of_text(data, most)
    if len(points) > 3 * most:
        too_many(len(points) // 3, most)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        message = (
            f"triangle {bad[0] // 3}: a coordinate must be finite, got "
            f"{points[bad[0]].tolist()}; repair it"
        )
        raise MeshError(MeshRefusal.NON_FINITE, message)
    return points, np.arange(len(points)).reshape(-1, 3)


def _of_binary(data: bytes) -> Array:
    records = np.frombuffer(data, dtype=RECORD, offset=HEADER + 4)
    return records["corners"].reshape(-1, 3).astype(np.float64)


def _of_text(data: bytes, most: int) -> Array:
    points = list[list[float]]()
    lines = worded_lines(data)
    for number, words in lines:
        _expect(words, [b"solid"], number, whole_line=False)
        for place, inside in lines:
            if inside[0].lower() == b"endsolid":
                break
            points += _facet(place, inside, lines)
            if len(points) > 3 * most:
                too_many(len(points) // 3, most)
        else:
            broken("the end", "expected `endsolid`")
    return np.array(points, dtype=np.float64).reshape(-1, 3)


def _facet(number: int, words: list[bytes], lines: Lines) -> list[list[float]]:
    _expect(words, [b"facet", b"normal"], number, whole_line=False)
    number, words = _next(lines)
    _expect(words, [b"outer", b"loop"], number)
    corners = list[list[float]]()
    for _ in range(3):
        number, words = _next(lines)
        _expect(words, [b"vertex"], number, whole_line=False)
        values = numbers(words[1:], f"line {number}")
        if len(values) != 3:  # noqa: PLR2004 - x y z
            broken(f"line {number}", f"a vertex needs three numbers, got {len(values)}")
        corners.append(values)
    for last in (b"endloop", b"endfacet"):
        number, words = _next(lines)
        _expect(words, [last], number)
    return corners


def _next(lines: Lines) -> tuple[int, list[bytes]]:
    line = next(lines, None)
    if line is None:
        broken("the end", "expected a whole triangle")
    return line


def _expect(
    words: Sequence[bytes], expected: list[bytes], number: int, *, whole_line: bool = True
) -> None:
    found = [word.lower() for word in (words if whole_line else words[: len(expected)])]
    if found != expected:
        wanted = b" ".join(expected).decode("ascii")
        broken(f"line {number}", f"expected `{wanted}`, got {shown(b' '.join(words))!r}")
