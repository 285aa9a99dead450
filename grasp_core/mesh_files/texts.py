"""Reads the mesh formats that are text: OBJ, OFF and text STL.

What breaks a format is raised as `ValueError`, also by Python where a word is no number. Words that
say nothing of the surface, such as colours, are passed over unread.
"""

import io
import re
from collections.abc import Iterator

from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.polygons import Polygons, TextPoints, too_many

LONGEST_LINE = 2**20
PADDING = b"\0\x1a"
"""Bytes that may follow the last line: zeros of a fixed length, and the end mark of old systems."""
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
COMMENT = re.compile(rb"#[^\n]*")
OTHER_ALPHABETS = bytes(range(128)) + b"?" * 128
OBJ_PASSED_OVER = frozenset(
    b"vt vn vp vc g o s usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj "
    b"trace_obj mg l p".split()
)
"""OBJ keywords that are ignored: they set appearance, groups or curves, not the surface."""
OTHER_COMMENTS = (b"//", b";")
"""Beginnings of comments in other languages, which some programs write into OBJ files."""
OBJ_CORNER = re.compile(rb"[+-]?\d++(/([+-]?\d++)?){0,2}")
"""One corner of a face: a vertex number, then optional texture and normal numbers."""
OBJ_WIDTHS = (3, 4, 6, 7)
"""Allowed counts of numbers on a `v` line: a point, then a weight, a colour, or both of them."""
WEIGHTED = 4
GOES_ON = b"\\\n"
SWALLOWED = re.compile(rb"^[^#\n]*#[^\n]*\\\n[^\S\n]*[vf]\s", re.MULTILINE)
"""A comment that ends in a backslash, right before a vertex or a face of an OBJ file."""
OFF_HEAD = re.compile(rb"(?:ST)?C?N?OFF(\d*)", re.IGNORECASE)
"""Words that begin an OFF file, some with the first count behind them, as in ModelNet40; texture,
colour and normal values after a point are ignored."""
OFF_COUNTS = (2, 3)
STL_HEAD = re.compile(rb"\s*solid[^\n]*", re.IGNORECASE)
STL_FACET = re.compile(
    rb"\s*facet(?:\s+(?!outer\s)\S+){0,4}\s+outer\s+loop"
    + 3 * rb"\s+vertex\s+(\S+)\s+(\S+)\s+(\S+)"
    + rb"\s+endloop\s+endfacet\b",
    re.IGNORECASE,
)
"""A triangle of a text STL file; the word `normal` and its numbers may be there in part."""
STL_END = re.compile(rb"\s*endsolid[^\n]*", re.IGNORECASE)


def plain_text(data: bytes) -> bytes:
    """Convert a text to ASCII and line feeds; other letters and the `#` of `1.#QNAN` become `?`."""
    text = data.rstrip(PADDING)
    if found := CONTROL.search(text):
        raise ValueError(f"expected text, got the control character {found[0]!r}")
    text = text.translate(OTHER_ALPHABETS).replace(b".#", b".?")
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def worded_lines(text: bytes, *, comments: bool = True) -> Iterator[list[bytes]]:
    """Yield the words of each line that is not blank, one line at a time to save memory."""
    for line in io.BytesIO(text):
        if len(line) > LONGEST_LINE:
            raise ValueError(f"a line is longer than {LONGEST_LINE} bytes")
        if words := (line.partition(b"#")[0] if comments else line).split():
            yield words


def whole(word: bytes) -> int:
    """Read a word as a whole number, without the underscores that Python allows."""
    return int(word.replace(b"_", b"?"))


def read_obj(data: bytes, most: int) -> tuple[TextPoints, Polygons]:
    """Read the vertices and polygons of an OBJ file.

    The format does not say whether a backslash joins lines also at the end of a comment. Such a
    comment right before a vertex or a face is therefore refused.
    """
    text = plain_text(data)
    if SWALLOWED.search(text):
        raise ValueError("a comment ends in a backslash before a `v` or `f` line")
    if GOES_ON in text:
        text = COMMENT.sub(b"", text).replace(GOES_ON, b"")
    points, polygons = TextPoints(), Polygons(most)
    for keyword, *words in worded_lines(text):
        if keyword == b"v":
            if len(words) not in OBJ_WIDTHS:
                raise ValueError(f"a vertex needs three numbers, got {len(words)}")
            if len(words) == WEIGHTED and float(words[-1]) != 1.0:
                _unsupported("a vertex has a weight", "export weights of 1")
            points.add(words[:3])
        elif keyword == b"f":
            polygons.add([_obj_corner(word, len(points)) for word in words])
        elif keyword not in OBJ_PASSED_OVER and not keyword.startswith(OTHER_COMMENTS):
            _unsupported(f"keyword {keyword[:40].decode()!r}", "export polygons only")
    return points, polygons


def _obj_corner(word: bytes, vertices: int) -> int:
    """Convert a corner to a vertex number from 0; negative ones count back from the last vertex."""
    if not OBJ_CORNER.fullmatch(word):
        raise ValueError(f"a corner must be whole numbers separated by `/`, got {word[:40]!r}")
    number = int(word.partition(b"/")[0])
    if number == 0 or number < -vertices:
        message = f"a face names vertex {number}, of {vertices} so far; export it again"
        raise MeshError(MeshRefusal.INDEX, message)
    return number - 1 if number > 0 else vertices + number


def _unsupported(said: str, remedy: str) -> None:
    message = f"the file has a feature that is not read: {said}; {remedy}"
    raise MeshError(MeshRefusal.UNSUPPORTED, message)


def read_off(data: bytes, most: int) -> tuple[TextPoints, Polygons]:
    """Read the vertices and polygons of an OFF file: the word OFF, counts, vertices, polygons."""
    lines = worded_lines(plain_text(data))
    head, *counts = next(lines, [b""])
    if not (found := OFF_HEAD.fullmatch(head)):
        raise ValueError("expected the word OFF")
    counts = [found[1], *counts] if found[1] else counts or next(lines, list[bytes]())
    if len(counts) not in OFF_COUNTS:
        raise ValueError(f"expected counts of vertices, faces and edges, got {len(counts)}")
    vertices, faces = map(whole, counts[:2])
    points, polygons, rows = TextPoints(), Polygons(most), 0
    for words in lines:
        rows += 1
        if rows <= vertices:
            points.add(words[:3])
            continue
        corners = whole(words[0])
        if not 0 <= corners < len(words):
            raise ValueError(f"a face that says {corners} corners lists {len(words) - 1}")
        polygons.add([whole(word) for word in words[1 : corners + 1]])
    if rows != vertices + faces or min(vertices, faces) < 0:
        raise ValueError(f"expected {vertices} vertices and {faces} faces, got {rows} lines")
    return points, polygons


def read_stl_text(data: bytes, most: int) -> TextPoints:
    """Read the corners of all solids of a text STL file; line breaks between words do not count."""
    text, points, place = COMMENT.sub(b"", plain_text(data)), TextPoints(), 0
    while begun := STL_HEAD.match(text, place):
        place = begun.end()
        while facet := STL_FACET.match(text, place):
            for corner in range(0, 9, 3):
                points.add(facet.groups()[corner : corner + 3])
            if len(points) > 3 * most:
                too_many(len(points) // 3, most)
            place = facet.end()
        if not (ended := STL_END.match(text, place)):
            raise ValueError(f"expected `endsolid` or a whole triangle, got {_next(text, place)!r}")
        place = ended.end()
    if text[place:].strip():
        raise ValueError(f"expected `solid`, got {_next(text, place)!r}")
    return points


def _next(text: bytes, place: int) -> bytes:
    return b" ".join(text[place : place + 80].split()[:4])
