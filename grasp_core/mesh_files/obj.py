"""Reads OBJ text: `v` and `f` lines; looks and groups are ignored, curved surfaces refused."""

import re
from array import array
from collections.abc import Iterator

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.polygon_soup import Polygons, points_of
from grasp_core.mesh_files.refusals import broken, outside, shown, unsupported
from grasp_core.mesh_files.words import (
    LONGEST_LINE,
    numbered_lines,
    numbers,
    plain_text,
    whole,
    worded_lines,
)

PASSED_OVER = frozenset(
    b"vt vn g o s usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj trace_obj mg "
    b"l p".split()
)
"""They change looks, names or curves, not the surface."""
SURFACE = re.compile(rb"\s*[vf]\s")
CORNER = re.compile(rb"[+-]?\d++(/([+-]?\d++)?){0,2}")
"""A vertex, perhaps of a texture and a normal."""
WIDTHS = (3, 4, 6, 7)
"""How many numbers a vertex may have: a point, perhaps its weight, perhaps a colour."""
WEIGHTED = (4, 7)
FLOATS = 3
GOES_ON = b"\\\n"


def read(data: bytes, most: int) -> tuple[Array, Indices]:
    """Vertices (n, 3) and triangles (t, 3) of an OBJ text.

    Raises:
        MeshError: The text breaks a rule, with the line, or has more than `most` triangles.
    """
    points, polygons = array("d"), Polygons(most, first=1)
    for number, (keyword, *words) in _statements(plain_text(data)):
        where = f"line {number}"
        if keyword == b"v":
            points.extend(_vertex(words, where))
        elif keyword == b"f":
            polygons.add(_corners(words, len(points) // FLOATS, where), where)
        elif keyword not in PASSED_OVER:
            unsupported(
                f"{where}: {shown(keyword)!r} is not part of a polyhedron", "export polygons only"
            )
    return polygons.on(points_of(points))


def _statements(text: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """The words of each statement with the number of its first line."""
    return _joined(text) if GOES_ON in text else worded_lines(text, comments=True)


def _joined(text: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Statements of which some go on: a backslash at the end of a line joins it with the next.

    Whether it does so in a comment is not said anywhere, so that a comment which could swallow a
    part of the surface is refused.
    """
    held, begun, after_backslash = bytearray(), 0, False
    for number, line in numbered_lines(text):  # pieces are appended in place, in linear time
        kept, _, comment = line.partition(b"#")
        if after_backslash and SURFACE.match(kept):
            broken(f"line {number - 1}", "a comment ends in a backslash, before a part of the mesh")
        after_backslash = comment.endswith(GOES_ON)
        begun = begun if held else number
        goes_on = kept.endswith(GOES_ON)
        held += kept.removesuffix(GOES_ON)
        if len(held) > LONGEST_LINE:
            broken(f"line {begun}", f"goes on for more than {LONGEST_LINE} bytes")
        if not goes_on:
            if words := bytes(held).split():
                yield begun, words
            held.clear()
    if words := bytes(held).split():
        yield begun, words


def _vertex(words: list[bytes], where: str) -> list[float]:
    values = numbers(words, where)
    if len(values) not in WIDTHS:
        broken(where, f"a vertex needs three numbers, got {len(values)}")
    if len(values) in WEIGHTED and values[FLOATS] != 1.0:
        unsupported(f"{where}: a vertex of weight {values[FLOATS]:g}", "export weights of 1")
    return values[:FLOATS]


def _corners(words: list[bytes], vertices: int, where: str) -> list[int]:
    """Numbers of vertices from 0 on.

    Those in the file count from 1, wherever in the file their vertex stands, or back from the last
    vertex above their line.
    """
    for word in words:
        if not CORNER.fullmatch(word):
            broken(where, f"a corner must be whole numbers separated by `/`, got {shown(word)!r}")
    corners = [whole(word.partition(b"/")[0], where) for word in words]
    for corner in corners:
        if corner == 0 or corner < -vertices:
            outside(where, corner, vertices)
    return [corner - 1 if corner > 0 else vertices + corner for corner in corners]
