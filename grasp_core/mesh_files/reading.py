"""Reads a mesh file: one regular file, by the rules of the format that its ending names.

OBJ, OFF and some STL files are text, others of STL are rows of numbers, PLY files are tables that
their header describes, and `glb` reads GLB files. What breaks a format is raised as `ValueError`,
also by Python and numpy where numbers do not fit. Words that say nothing of the surface, such as
colours, are passed over unread. Reading takes time and memory in proportion to the bytes of the
file, and no more triangles than are allowed are kept: `MeshLimits` bounds both.
"""

import io
import re
import struct
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal, about
from grasp_core.files.text_files import bounded_bytes
from grasp_core.mesh_files.glb import read_glb
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.polygons import (
    Polygons,
    TextPoints,
    single_rounding,
    text_rounding,
    too_many,
)

FORMATS = ("obj", "stl", "ply", "off", "glb")
BEGINNINGS = {"ply": b"ply", "glb": b"gltf"}
"""First bytes of files of some formats, in small letters."""
STL_HEAD = 80
STL_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
BYTE_ORDER_MARK, UTF_16 = b"\xef\xbb\xbf", (b"\xff\xfe", b"\xfe\xff")
SHOWN = 100
"""Largest number of characters of a fault that a message quotes."""


class MeshFile(NamedTuple):
    """The surface that a mesh file holds, in the file's unit of length."""

    vertices: Array
    triangles: Indices
    rounding: float
    """Largest rounding error of a coordinate that the numbers of the file show; 0 if they show
    none."""
    data: bytes


def read_triangles(path: Path, limits: MeshLimits) -> MeshFile:
    """Read a mesh file."""
    with about(path):
        kind = path.suffix.lower().lstrip(".")
        if kind not in FORMATS:
            message = f"the file's ending must be one of {', '.join(FORMATS)}, got {kind!r}"
            raise MeshError(MeshRefusal.FORMAT, message)
        try:
            data = bounded_bytes(path, limits.max_mesh_bytes)
            if len(data) > limits.max_mesh_bytes:
                most = limits.max_mesh_bytes
                message = f"the file is over the limit of {most} bytes; simplify it"
                raise MeshError(MeshRefusal.TOO_MANY, message)
            return mesh_of_bytes(kind, data, limits.max_triangles)
        except OSError as error:
            message = f"the file cannot be read ({error.strerror}); check the path"
            raise MeshError(MeshRefusal.UNREADABLE, message) from error
        except MemoryError as error:
            message = "reading it needs more memory than there is; simplify the mesh"
            raise MeshError(MeshRefusal.LIMIT, message) from error


def mesh_of_bytes(kind: str, data: bytes, most: int) -> MeshFile:
    """Read the bytes of a mesh file, and judge the numbers that it holds."""
    for other, beginning in BEGINNINGS.items():
        if other != kind and data[:4].lower().startswith(beginning):
            message = f"the file is {other.upper()} by its first bytes; rename it to .{other}"
            raise MeshError(MeshRefusal.FORMAT, message)
    try:
        points, triangles, digits = _surface(kind, data, most)
    except (ValueError, OverflowError) as error:
        fault = "".join(c if c.isascii() and c.isprintable() else "?" for c in str(error)[:SHOWN])
        message = f"the file breaks the rules of {kind.upper()} ({fault}); export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if not len(triangles):
        raise MeshError(MeshRefusal.EMPTY, "the file holds no triangles; export a surface mesh")
    if not np.isfinite(points).all():
        message = "a coordinate is infinite, not a number, or too large; repair the mesh"
        raise MeshError(MeshRefusal.NON_FINITE, message)
    rounding = single_rounding(points, digits) + text_rounding(points, digits)
    return MeshFile(points, triangles, rounding, data)


def _surface(kind: str, data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Return the vertices (n, 3), triangles (t, 3) and coordinates' digits of a file."""
    count = int.from_bytes(data[STL_HEAD : STL_HEAD + 4], "little")
    if kind == "stl" and len(data) == STL_HEAD + 4 + STL_ROW.itemsize * count:
        if count > most:
            too_many(count, most)
        rows = np.frombuffer(data, STL_ROW, offset=STL_HEAD + 4)
        return *_unshared(rows["corners"].reshape(-1, 3).astype(np.float64)), 0
    if data.startswith(UTF_16):
        data = data.decode("utf-16", "replace").encode()
    data = data.removeprefix(BYTE_ORDER_MARK)
    if not data[:4].lower().startswith(BEGINNINGS.get(kind, b"")):
        raise ValueError("it begins otherwise")
    if kind == "glb":
        return *read_glb(data, most), 0
    if kind == "stl":
        written = read_stl_text(data, most)
        return *_unshared(written.array), written.digits
    if kind == "ply":
        points, digits, polygons = read_ply(data, most)
        return points, polygons.fans(points), digits
    written, polygons = (read_obj if kind == "obj" else read_off)(data, most)
    return written.array, polygons.fans(written.array), written.digits


def _unshared(points: Array) -> tuple[Array, Indices]:
    return points, np.arange(len(points)).reshape(-1, 3)


PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float16": "f2", "float32": "f4", "float64": "f8",
}  # fmt: skip
PLY_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
PLY_END = re.compile(rb"\n[ \t]*end_header[ \t]*\r?\n|\r[ \t]*end_header[ \t]*\r")
LONGEST_HEADER = 2**16
PLY_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I",
             "i8": "q", "u8": "Q", "f2": "e", "f4": "f", "f8": "d"}  # fmt: skip
PLY_CORNERS = {"vertex_indices", "vertex_index"}
PLY_POINT = ("x", "y", "z")


class Column(NamedTuple):
    """A property of a PLY table: one number, or one list of numbers, in each row."""

    name: str
    kind: str  # the number type as numpy writes it, without the byte order, such as `f4`
    counted: str | None
    """The number type of a list's length; None if the column holds single numbers."""


class Table(NamedTuple):
    """An element that the header announces, such as `vertex` or `face`."""

    name: str
    rows: int
    columns: list[Column]


def read_ply(data: bytes, most: int) -> tuple[Array, int, Polygons]:
    """Read the vertices (n, 3) of a PLY file, the digits of their text, and its polygons."""
    order, tables, place = _ply_header(data)
    body = _TextTables(data[place:]) if order == "=" else _BinaryTables(data, place, order)
    points, polygons = np.empty((0, 3)), Polygons(most)
    for table in tables:
        if table.name == "face":
            (name,) = {column.name for column in table.columns} & PLY_CORNERS
            for cells in _rows(table, body):
                corners = [float(corner) for corner in cells[name]]
                if not all(map(float.is_integer, corners)):
                    raise ValueError("the corners of a face must be whole numbers")
                polygons.add([int(corner) for corner in corners])
        elif table.name == "vertex":
            points = body.points(table)
        else:
            deque(_rows(table, body), maxlen=0)
    body.begin_row()
    if body.goes_on():
        raise ValueError("the file goes on after the tables that its header announces")
    return points, body.digits, polygons


def _ply_header(data: bytes) -> tuple[str, list[Table], int]:
    """Read the byte order, the tables, and the byte where the header ends."""
    found = PLY_END.search(data[:LONGEST_HEADER])
    if not found:
        raise ValueError("expected `end_header`")
    order, tables = "", list[Table]()
    for words in map(str.split, data[: found.start()].decode("ascii", "replace").splitlines()[1:]):
        match words:
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["format", name, "1.0"] if name in PLY_ORDERS and not order:
                order = PLY_ORDERS[name]
            case ["element", name, rows]:
                tables.append(Table(name, whole(rows.encode()), []))
            case ["property", "list", count, kind, name] if tables and {count, kind} <= {
                *PLY_TYPES
            }:
                tables[-1].columns.append(Column(name, PLY_TYPES[kind], PLY_TYPES[count]))
            case ["property", kind, name] if tables and kind in PLY_TYPES:
                tables[-1].columns.append(Column(name, PLY_TYPES[kind], None))
            case _:
                raise ValueError(f"the header says {' '.join(words)[:40]!r}")
    _check_ply(order, tables)
    return order, tables, found.end()


def _check_ply(order: str, tables: list[Table]) -> None:
    """Refuse a header without one table of points and one of faces, or with names twice."""
    by_name = {table.name: table.columns for table in tables}
    points = [column.name for column in by_name.get("vertex", ()) if not column.counted]
    corners = [c for c in by_name.get("face", ()) if c.name in PLY_CORNERS]
    if not order or len(by_name) < len(tables) or not {*PLY_POINT} <= {*points}:
        raise ValueError("the header needs a format, and elements vertex (x, y, z) and face, once")
    if len(corners) != 1 or not corners[0].counted:
        raise ValueError(f"the header needs one list {' or '.join(sorted(PLY_CORNERS))} of faces")
    for _, rows, columns in tables:
        names = {column.name for column in columns}
        if rows < 0 or (rows and not columns) or len(names) < len(columns):
            raise ValueError("the header has a count below 0, or the same name twice")
        if any(column.counted and column.counted.startswith("f") for column in columns):
            raise ValueError("the length of a list must be a whole number")


def _rows(table: Table, body: "_TextTables | _BinaryTables") -> Iterator[dict[str, Sequence[Any]]]:
    """Yield the cells of each row by the names of columns; single numbers are lists of one."""
    for _ in range(table.rows):
        cells = dict[str, Sequence[Any]]()
        body.begin_row()
        for name, kind, count in table.columns:
            length = 1 if count is None else int(body.take(count, 1)[0])
            cells[name] = body.take(kind, length)
        yield cells


class _TextTables:
    """The tables of a text PLY, with a line for each row."""

    digits = 0

    def __init__(self, data: bytes) -> None:
        self.lines = worded_lines(plain_text(data).replace(b"_", b"?"))
        self.words, self.place = list[bytes](), 0

    def begin_row(self) -> None:
        """Go on to the next line."""
        if self.goes_on():
            raise ValueError("a row has more values than the header says")
        self.words, self.place = next(self.lines, list[bytes]()), 0

    def take(self, _: str, length: int) -> list[bytes]:
        """Take the next words of the row."""
        end = self.place + length
        if not self.place <= end <= len(self.words):
            raise ValueError("a table or a row is shorter than the header says")
        taken, self.place = self.words[self.place : end], end
        return taken

    def points(self, table: Table) -> Array:
        """Return the vertices (n, 3), rounded to the number types that the header gives."""
        written = TextPoints()
        for cells in _rows(table, self):
            written.add([cells[axis][0] for axis in PLY_POINT])
        points, self.digits = written.array, written.digits
        for name, kind, _ in (column for column in table.columns if column.name in PLY_POINT):
            values = points[:, PLY_POINT.index(name)]
            with np.errstate(over="ignore", under="ignore", invalid="ignore"):
                kept = values.astype(kind)
            if not kind.startswith("f") and (kept != values).any():
                raise ValueError(f"{name} does not fit the whole numbers that the header gives")
            values[:] = kept
        return points

    def goes_on(self) -> bool:
        """Return whether anything follows in the row."""
        return self.place < len(self.words)


class _BinaryTables:
    """The tables of a binary PLY, one after another; methods are those of a text."""

    digits = 0

    def __init__(self, data: bytes, place: int, order: str) -> None:
        self.data, self.place, self.order = data, place, order

    def begin_row(self) -> None:
        pass

    def take(self, kind: str, length: int) -> Sequence[float]:
        end = self.place + length * int(kind[1])
        if not self.place <= end <= len(self.data):
            raise ValueError("a table is shorter than the header says")
        taken = struct.unpack_from(f"{self.order}{length}{PLY_CODES[kind]}", self.data, self.place)
        self.place = end
        return taken

    def points(self, table: Table) -> Array:
        if any(column.counted for column in table.columns):
            listed = [[cells[axis][0] for axis in PLY_POINT] for cells in _rows(table, self)]
            return np.array(listed, dtype=np.float64).reshape(-1, 3)
        fields = [(column.name, self.order + column.kind) for column in table.columns]
        rows = np.frombuffer(self.data, np.dtype(fields), table.rows, self.place)
        self.place += rows.nbytes
        return np.stack([rows[axis].astype(np.float64) for axis in PLY_POINT], axis=1)

    def goes_on(self) -> bool:
        return self.place < len(self.data)


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
STL_BEGIN = re.compile(rb"\s*solid[^\n]*", re.IGNORECASE)
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


def worded_lines(text: bytes) -> Iterator[list[bytes]]:
    """Yield the words of each line that is not blank, one line at a time to save memory."""
    for line in io.BytesIO(text):
        if len(line) > LONGEST_LINE:
            raise ValueError(f"a line is longer than {LONGEST_LINE} bytes")
        if words := line.partition(b"#")[0].split():
            yield words


def whole(word: bytes) -> int:
    """Read a word as a whole number, without the underscores that Python allows."""
    return int(word.replace(b"_", b"?"))


def read_obj(data: bytes, most: int) -> tuple[TextPoints, Polygons]:
    """Read an OBJ file; a comment whose backslash might hide a vertex or a face is refused."""
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
    while begun := STL_BEGIN.match(text, place):
        place = begun.end()
        while facet := STL_FACET.match(text, place):
            for corner in range(0, 9, 3):
                points.add(facet.groups()[corner : corner + 3])
            if len(points) > 3 * most:
                too_many(len(points) // 3, most)
            place = facet.end()
        if not (ended := STL_END.match(text, place)):
            raise ValueError(
                f"expected `endsolid` or a whole triangle, got {_next_words(text, place)!r}"
            )
        place = ended.end()
    if text[place:].strip():
        raise ValueError(f"expected `solid`, got {_next_words(text, place)!r}")
    return points


def _next_words(text: bytes, place: int) -> bytes:
    return b" ".join(text[place : place + 80].split()[:4])
