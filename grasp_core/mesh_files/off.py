"""Reads OFF files: the word OFF, three counts, the vertices and the polygons."""

import re
from collections.abc import Iterator

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.polygon_soup import Polygons
from grasp_core.mesh_files.refusals import broken
from grasp_core.mesh_files.rounding import TextPoints
from grasp_core.mesh_files.words import check_unused, numbers, plain_text, whole, worded_lines

Lines = Iterator[tuple[int, list[bytes]]]
HEAD = re.compile(rb"(?:ST)?C?N?OFF(\d*)", re.IGNORECASE)
"""Words that begin an OFF file, some with the first count behind them, as in ModelNet40; texture,
colour and normal values after a point are ignored."""
COUNTS = (2, 3)
FLOATS = 3


def read(data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Read the vertices (n, 3), triangles (t, 3) and coordinates' digits of an OFF file."""
    lines = worded_lines(plain_text(data), comments=True)
    vertices, faces = _counts(lines)
    points, polygons = TextPoints(), Polygons(most)
    for _ in range(vertices):
        number, words = _next(lines, "a vertex")
        if len(words) < FLOATS:
            broken(f"line {number}", f"a vertex needs three numbers, got {len(words)}")
        three = words[:FLOATS]
        points.add(three, numbers(three, f"line {number}"))
        if len(words) > FLOATS:
            check_unused(words[FLOATS:], f"line {number}")
    for _ in range(faces):
        number, words = _next(lines, "a face")
        where = f"line {number}"
        corners = whole(words[0], where)
        if not 0 <= corners < len(words):
            broken(where, f"a face that says {corners} corners lists {len(words) - 1}")
        polygons.add([whole(word, where) for word in words[1 : corners + 1]], where)
    if (after := next(lines, None)) is not None:
        broken(
            f"line {after[0]}",
            f"the file has more lines than its {vertices} vertices and {faces} faces",
        )
    return *polygons.on(points.array), points.digits


def _counts(lines: Lines) -> tuple[int, int]:
    number, words = _next(lines, "OFF")
    if not (head := HEAD.fullmatch(words[0])):
        broken(f"line {number}", "expected the word OFF")
    counts = [word for word in (head[1], *words[1:]) if word]
    if not counts:
        number, counts = _next(lines, "the counts")
    if len(counts) not in COUNTS:
        broken(f"line {number}", f"expected counts of vertices, faces and edges, got {len(counts)}")
    vertices, faces = (whole(count, f"line {number}") for count in counts[:2])
    if vertices < 0 or faces < 0:
        broken(f"line {number}", "a count is negative")
    return vertices, faces


def _next(lines: Lines, expected: str) -> tuple[int, list[bytes]]:
    line = next(lines, None)
    if line is None:
        broken("the end", f"expected {expected}")
    return line
