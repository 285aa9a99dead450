"""Reads OBJ files: vertices and polygons; groups and looks are ignored, curved surfaces refused."""

import re
from collections.abc import Iterator

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.polygon_soup import Polygons
from grasp_core.mesh_files.refusals import broken, outside, shown, unsupported
from grasp_core.mesh_files.rounding import TextPoints
from grasp_core.mesh_files.words import (
    LONGEST_LINE,
    check_unused,
    numbered_lines,
    numbers,
    plain_text,
    whole,
    worded_lines,
)

PASSED_OVER = frozenset(
    b"vt vn vp vc g o s usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj "
    b"trace_obj mg l p".split()
)
"""OBJ keywords that are ignored: they set appearance, groups or curves, not the surface."""
OTHER_COMMENTS = (b"//", b";")
"""Beginnings of comments in other languages, which some programs write into OBJ files."""
SURFACE = re.compile(rb"\s*[vf]\s")
CORNER = re.compile(rb"[+-]?\d++(/([+-]?\d++)?){0,2}")
"""The form of one corner of a face: a vertex number, then optional texture and normal numbers."""
WIDTHS = (3, 4, 6, 7)
"""Allowed counts of numbers on a `v` line: a point, then a weight, a colour, or both of them."""
FLOATS, WEIGHTED = 3, 4
GOES_ON = b"\\\n"


def read(data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Read the vertices (n, 3), triangles (t, 3) and coordinates' digits of an OBJ file."""
    points, polygons = TextPoints(), Polygons(most, first=1)
    for number, (keyword, *words) in _statements(plain_text(data)):
        where = f"line {number}"
        if keyword == b"v":
            points.add(words[:FLOATS], _vertex(words, where))
        elif keyword == b"f":
            polygons.add(_corners(words, len(points), where), where)
        elif keyword not in PASSED_OVER and not keyword.startswith(OTHER_COMMENTS):
            unsupported(f"{where}: keyword {shown(keyword)!r}", "export polygons only")
    return *polygons.on(points.array), points.digits


def _statements(text: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the words of each statement, with the number of its first line."""
    return _joined(text) if GOES_ON in text else worded_lines(text, comments=True)


def _joined(text: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Yield statements like `_statements`; a backslash at the end of a line joins it with the next.

    The format does not say whether a backslash also does so in a comment. A comment with one, right
    before a `v` or `f` line, is therefore refused.
    """
    held, begun, after_backslash = bytearray(), 0, False
    for number, line in numbered_lines(text):  # pieces are appended in place, in linear time
        kept, _, comment = line.partition(b"#")
        if after_backslash and SURFACE.match(kept):
            broken(f"line {number - 1}", "a comment ends in a backslash before a `v` or `f` line")
        after_backslash = comment.endswith(GOES_ON)
        begun = begun if held else number
        goes_on = kept.endswith(GOES_ON)
        held += kept.removesuffix(GOES_ON)
        if len(held) > LONGEST_LINE:
            broken(f"line {begun}", f"the statement is longer than {LONGEST_LINE} bytes")
        if not goes_on:
            if words := bytes(held).split():
                yield begun, words
            held.clear()
    if words := bytes(held).split():
        yield begun, words


def _vertex(words: list[bytes], where: str) -> list[float]:
    values = numbers(words if len(words) == WEIGHTED else words[:FLOATS], where)
    if len(words) not in WIDTHS:
        broken(where, f"a vertex needs three numbers, got {len(words)}")
    if len(values) == WEIGHTED and values[FLOATS] != 1.0:
        unsupported(f"{where}: a vertex of weight {values[FLOATS]:g}", "export weights of 1")
    if len(words) > WEIGHTED:
        check_unused(words[FLOATS:], where)
    return values[:FLOATS]


def _corners(words: list[bytes], vertices: int, where: str) -> list[int]:
    """Convert the corners of an `f` line to vertex numbers that count from 0.

    In the file, positive numbers count from 1; negative ones count back from the last vertex so
    far.
    """
    for word in words:
        if not CORNER.fullmatch(word):
            broken(where, f"a corner must be whole numbers separated by `/`, got {shown(word)!r}")
    corners = [whole(word.partition(b"/")[0], where) for word in words]
    for corner in corners:
        if corner == 0 or corner < -vertices:
            outside(where, corner, vertices)
    return [corner - 1 if corner > 0 else vertices + corner for corner in corners]
