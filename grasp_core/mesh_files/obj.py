"""Reads OBJ text: `v` and `f` lines; looks and groups are ignored, curved surfaces refused."""

import re

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.polygon_soup import Surface
from grasp_core.mesh_files.refusals import broken, outside, shown, unsupported
from grasp_core.mesh_files.words import numbers, whole, worded_lines

PASSED_OVER = frozenset(
    b"vt vn g o s usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj trace_obj mg "
    b"l p".split()
)
"""Keywords that change looks, names or curves, not the surface."""
CORNER = re.compile(rb"[+-]?\d+(/([+-]?\d+)?){0,2}")
"""A corner of a face: a vertex, perhaps with a texture and a normal."""
WIDTHS = (3, 4, 6, 7)
"""How many numbers a vertex may have: a point, perhaps its weight, perhaps a colour."""
WEIGHTED = (4, 7)
FLOATS = 3


def read(text: bytes, most: int) -> tuple[Array, Indices]:
    """Vertices (n, 3) and triangles (t, 3) of an OBJ text.

    Raises:
        MeshError: The text breaks a rule, with the line, or has more than `most` triangles.
    """
    surface = Surface(most)
    for number, (keyword, *words) in worded_lines(text):
        where = f"line {number}"
        if keyword == b"v":
            surface.points.append(_vertex(words, where))
        elif keyword == b"f":
            surface.add(_corners(words, len(surface.points), where), where)
        elif keyword not in PASSED_OVER:
            unsupported(
                f"{where}: {shown(keyword)!r} is not part of a polyhedron", "export polygons only"
            )
    return surface.arrays()


def _vertex(words: list[bytes], where: str) -> list[float]:
    values = numbers(words, where)
    if len(values) not in WIDTHS:
        broken(where, f"a vertex needs three numbers, got {len(values)}")
    if len(values) in WEIGHTED and values[FLOATS] != 1.0:
        unsupported(f"{where}: a vertex of weight {values[FLOATS]:g}", "export weights of 1")
    return values[:FLOATS]


def _corners(words: list[bytes], vertices: int, where: str) -> list[int]:
    """Vertex numbers from 0 on; the file counts from 1, or back from the last vertex by then."""
    for word in words:
        if not CORNER.fullmatch(word):
            broken(where, f"a corner must be whole numbers separated by `/`, got {shown(word)!r}")
    corners = [whole(word.partition(b"/")[0], where) for word in words]
    for corner in corners:
        if not 1 <= abs(corner) <= vertices:
            outside(where, corner, vertices)
    return [corner - 1 if corner > 0 else vertices + corner for corner in corners]
