"""Reads a mesh file: one regular file, by the rules of the format that its ending names.

OBJ, OFF and some STL files are text, others of STL are rows of numbers, PLY files are tables that
their header describes; `glb` reads GLB files, and `threemf` 3MF files. What breaks a format is
raised as `ValueError`, also by Python and numpy where numbers do not fit. Words that say nothing of
the surface, such as colours, are passed over unread. Reading takes time and memory in proportion to
the bytes of the file, unpacked, and no more triangles than are allowed are kept: `MeshLimits`
bounds both.
"""

import io
import re
import struct
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain, groupby, islice
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal, about
from grasp_core.files.text_files import bounded_bytes
from grasp_core.mesh_files.glb import read_glb
from grasp_core.mesh_files.limits import MESH_FORMATS, LengthUnit, MeshLimits
from grasp_core.mesh_files.polygons import (
    Polygons,
    TextPoints,
    single_rounding,
    too_many,
    unsupported,
    whole,
)
from grasp_core.mesh_files.threemf import read_3mf

BEGINNINGS = {"ply": b"ply", "glb": b"gltf"}
"""First bytes of files of some formats, in small letters."""
STL_HEAD = 80
STL_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
BYTE_ORDER_MARK, UTF_16 = b"\xef\xbb\xbf", (b"\xff\xfe", b"\xfe\xff")
SHOWN_FAULT = 100


class FileSurface(NamedTuple):
    """The surface that a mesh file holds, in the file's unit of length."""

    vertices: Array
    triangles: Indices
    rounding: float
    """Largest rounding error of a coordinate that the numbers of the file show; 0 if they show
    none."""
    unit: LengthUnit | None
    """Unit of length that the file states; None if its format has none."""
    data: bytes


def read_triangles(path: Path, limits: MeshLimits) -> FileSurface:
    """Read a mesh file."""
    with about(path):
        kind = path.suffix.lower().lstrip(".")
        if kind not in MESH_FORMATS:
            message = f"the file's ending must be one of {', '.join(MESH_FORMATS)}, got {kind!r}"
            raise MeshError(MeshRefusal.FORMAT, message)
        try:
            data = bounded_bytes(path, limits.max_mesh_bytes)
            if len(data) > limits.max_mesh_bytes:
                most = limits.max_mesh_bytes
                message = (
                    f"the file is over the limit of {most} bytes; simplify it, or allow more "
                    "(--max-mesh-bytes, and perhaps --max-triangles)"
                )
                raise MeshError(MeshRefusal.TOO_MANY, message)
            return mesh_of_bytes(kind, data, limits.max_triangles, limits.max_mesh_bytes)
        except OSError as error:
            message = f"the file cannot be read ({error.strerror}); check the path"
            raise MeshError(MeshRefusal.UNREADABLE, message) from error
        except InputError as error:
            if isinstance(error, MeshError):
                raise
            raise MeshError(MeshRefusal.UNREADABLE, str(error)) from error
        except MemoryError as error:
            message = "reading it needs more memory than there is; simplify the mesh"
            raise MeshError(MeshRefusal.LIMIT, message) from error


def mesh_of_bytes(
    kind: str, data: bytes, most: int, room: int = MeshLimits().max_mesh_bytes
) -> FileSurface:
    """Read the bytes of a mesh file, unpacked at most as many as there is room, and judge them."""
    for other, beginning in BEGINNINGS.items():
        if other != kind and data[:4].lower().startswith(beginning):
            message = f"the file is {other.upper()} by its first bytes; rename it to .{other}"
            raise MeshError(MeshRefusal.FORMAT, message)
    try:
        read = partial(read_3mf, room=room) if kind == "3mf" else partial(_surface, kind)
        points, triangles, rounding, unit = read(data, most)
    except (ValueError, OverflowError) as error:
        fault = "".join(
            c if c.isascii() and c.isprintable() else "?" for c in str(error)[:SHOWN_FAULT]
        )
        message = f"the file breaks the rules of {kind.upper()} ({fault}); export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if not len(triangles):
        raise MeshError(MeshRefusal.EMPTY, "the file holds no triangles; export a surface mesh")
    if not np.isfinite(points).all():
        message = "a coordinate is infinite, not a number, or too large; repair the mesh"
        raise MeshError(MeshRefusal.NON_FINITE, message)
    return FileSurface(points, triangles, rounding, unit, data)


def _surface(kind: str, data: bytes, most: int) -> tuple[Array, Indices, float, None]:
    """Return the vertices (n, 3), triangles (t, 3) and rounding of a file that states no unit."""
    count = int.from_bytes(data[STL_HEAD : STL_HEAD + 4], "little")
    if kind == "stl" and len(data) == STL_HEAD + 4 + STL_ROW.itemsize * count:
        if count > most:
            too_many(count, most)
        rows = np.frombuffer(data, STL_ROW, offset=STL_HEAD + 4)
        corners = rows["corners"].reshape(-1, 3).astype(np.float64)
        return corners, np.arange(3 * count).reshape(-1, 3), single_rounding(corners), None
    if data.startswith(UTF_16):
        data = data.decode("utf-16", "replace").encode()
    data = data.removeprefix(BYTE_ORDER_MARK)
    if not data[:4].lower().startswith(BEGINNINGS.get(kind, b"")):
        raise ValueError("it begins otherwise")
    if kind == "glb":
        points, triangles = read_glb(data, most)
        return points, triangles, single_rounding(points), None
    read = {"ply": read_ply, "obj": read_obj, "off": read_off, "stl": read_stl_text}[kind]
    written, polygons = read(data, most)
    return written.array, polygons.fans(written.array), written.rounding, None


PLY_TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q",
    "float16": "e", "float32": "f", "float64": "d",
}  # fmt: skip
"""Number types of PLY as `struct` and numpy write them."""
FRACTIONS = "efd"
"""Letters of the types whose values may have fractions."""
PLY_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
PLY_END = re.compile(rb"\n[ \t]*end_header[ \t]*\r?\n|\r[ \t]*end_header[ \t]*\r")
LONGEST_HEADER, LONGEST_LIST = 2**16, 2**31
PLY_CORNERS = {"vertex_indices", "vertex_index"}
PLY_POINT = ("x", "y", "z")

Take: TypeAlias = Callable[[str, int], Sequence[Any]]
"""A function that takes the next values of a table, of types as `struct` writes them, (n,)."""


class PlyProperty(NamedTuple):
    """A property of a PLY table: one number, or one list of numbers, in each row."""

    name: str
    kind: str  # the number type as `struct` writes it
    counted: str | None
    """The number type of a list's length; None if the column holds single numbers."""


class PlyElement(NamedTuple):
    """An element that the header announces, such as `vertex` or `face`."""

    name: str
    rows: int
    columns: list[PlyProperty]


def read_ply(data: bytes, most: int) -> tuple[TextPoints, Polygons]:
    """Read a PLY file: a header, and rows of the tables that it announces, as text or as bytes."""
    order, tables, place = _ply_header(data)
    body: Iterator[bytes]
    if is_text := order == PLY_ORDERS["ascii"]:
        lines = worded_lines(plain_text(data[place:]).replace(b"_", b"?"))
        body = chain.from_iterable(lines)
        take: Take = partial(_taken_words, body)
    else:
        body = io.BytesIO(data[place:])
        take = partial(_taken_numbers, body, order)
    points, polygons = TextPoints(), Polygons(most)
    for table in tables:
        for cells in _rows(table, take):
            if table.name == "vertex":
                point = [cells[axis] for axis in PLY_POINT]
                (points.add if is_text else points.numbers.extend)(point)
            elif table.name == "face":
                (name,) = PLY_CORNERS & cells.keys()
                corners = [float(corner) for corner in cells[name]]
                if not all(map(float.is_integer, corners)):
                    raise ValueError("the corners of a face must be whole numbers")
                polygons.add([int(corner) for corner in corners])
    if next(body, None) is not None:
        raise ValueError("the file goes on after the tables that its header announces")
    for column in (each for table in tables if table.name == "vertex" for each in table.columns):
        if column.name in PLY_POINT:
            _round_to(column, points.array[:, PLY_POINT.index(column.name)])
    return points, polygons


def _taken_words(words: Iterator[bytes], _: str, count: int) -> Sequence[bytes]:
    taken = list(islice(words, count))
    if len(taken) < count:
        raise ValueError("a table or a row is shorter than the header says")
    return taken


def _taken_numbers(body: io.BytesIO, order: str, kinds: str, _: int) -> Sequence[float]:
    taken = body.read(size := struct.calcsize(order + kinds))
    if len(taken) < size:
        raise ValueError("a table is shorter than the header says")
    return struct.unpack(order + kinds, taken)


def _rows(table: PlyElement, take: Take) -> Iterator[dict[str, Any]]:
    """Yield the cells of each row by the names of columns; single numbers are taken together."""
    runs = [
        (counted, list(columns)) for counted, columns in groupby(table.columns, lambda c: c.counted)
    ]
    for _ in range(table.rows):
        cells = dict[str, Any]()
        for counted, columns in runs:
            if counted is None:
                kinds = "".join(column.kind for column in columns)
                values = take(kinds, len(columns))
                cells.update((c.name, value) for c, value in zip(columns, values, strict=True))
                continue
            for name, kind, _ in columns:
                length = int(take(counted, 1)[0])
                if not 0 <= length <= LONGEST_LIST:
                    raise ValueError(f"a list has a length of {length}")
                cells[name] = take(f"{length}{kind}", length)
        yield cells


def _round_to(column: PlyProperty, values: Array) -> None:
    """Round coordinates, (n,), to the number type that the header gives them."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        kept = values.astype(column.kind)
    if column.kind not in FRACTIONS and (kept != values).any():
        raise ValueError(f"{column.name} does not fit the whole numbers that the header gives")
    values[:] = kept


def _ply_header(data: bytes) -> tuple[str, list[PlyElement], int]:
    """Read the byte order, the tables, and the byte where the header ends."""
    found = PLY_END.search(data[:LONGEST_HEADER])
    if not found:
        raise ValueError("expected `end_header`")
    order, tables = "", list[PlyElement]()
    for words in map(str.split, data[: found.start()].decode("ascii", "replace").splitlines()[1:]):
        match words:
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["format", name, "1.0"] if name in PLY_ORDERS and not order:
                order = PLY_ORDERS[name]
            case ["element", name, rows]:
                tables.append(PlyElement(name, whole(rows.encode()), []))
            case ["property", "list", count, kind, name] if tables and {count, kind} <= {
                *PLY_TYPES
            }:
                tables[-1].columns.append(PlyProperty(name, PLY_TYPES[kind], PLY_TYPES[count]))
            case ["property", kind, name] if tables and kind in PLY_TYPES:
                tables[-1].columns.append(PlyProperty(name, PLY_TYPES[kind], None))
            case _:
                raise ValueError(f"the header says {' '.join(words)[:40]!r}")
    _check_ply(order, tables)
    return order, tables, found.end()


def _check_ply(order: str, tables: list[PlyElement]) -> None:
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
        if any(column.counted and column.counted in FRACTIONS for column in columns):
            raise ValueError("the length of a list must be a whole number")


LONGEST_MESH_LINE = 2**20
PADDING = b"\0\x1a"
"""Bytes that may follow the last line: zeros of a fixed length, and the end mark of old systems."""
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
OBJ_COMMENT = re.compile(rb"#[^\n]*")
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
STL_INSIDE = re.compile(
    rb"\s*endsolid[^\n]*|\s*facet(?:\s+(?!outer\s)\S+){0,4}\s+outer\s+loop"
    + 3 * rb"\s+vertex\s+(\S+)\s+(\S+)\s+(\S+)"
    + rb"\s+endloop\s+endfacet\b",
    re.IGNORECASE,
)
"""A triangle of a text STL file, or its end; the word `normal` and its numbers may be there in
part."""


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
        if len(line) > LONGEST_MESH_LINE:
            raise ValueError(f"a line is longer than {LONGEST_MESH_LINE} bytes")
        if words := line.partition(b"#")[0].split():
            yield words


def read_obj(data: bytes, most: int) -> tuple[TextPoints, Polygons]:
    """Read an OBJ file; a comment whose backslash might hide a vertex or a face is refused."""
    text = plain_text(data)
    if SWALLOWED.search(text):
        raise ValueError("a comment ends in a backslash before a `v` or `f` line")
    if GOES_ON in text:
        text = OBJ_COMMENT.sub(b"", text).replace(GOES_ON, b"")
    points, polygons = TextPoints(), Polygons(most)
    for keyword, *words in worded_lines(text):
        if keyword == b"v":
            if len(words) not in OBJ_WIDTHS:
                raise ValueError(f"a vertex needs three numbers, got {len(words)}")
            if len(words) == WEIGHTED and float(words[-1]) != 1.0:
                unsupported("a vertex has a weight", "export weights of 1")
            points.add(words[:3])
        elif keyword == b"f":
            polygons.add([_obj_corner(word, len(points)) for word in words])
        elif keyword not in OBJ_PASSED_OVER and not keyword.startswith(OTHER_COMMENTS):
            unsupported(f"keyword {keyword[:40].decode()!r}", "export polygons only")
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


def read_stl_text(data: bytes, most: int) -> tuple[TextPoints, Polygons]:
    """Read the corners of all solids of a text STL file; line breaks between words do not count."""
    text, points, polygons = OBJ_COMMENT.sub(b"", plain_text(data)), TextPoints(), Polygons(most)
    place, inside = 0, False
    while found := (STL_INSIDE if inside else STL_BEGIN).match(text, place):
        place = found.end()
        if found.lastindex:
            for corner in range(0, 9, 3):
                points.add(found.groups()[corner : corner + 3])
            polygons.add(range(len(points) - 3, len(points)))
        else:
            inside = not inside
    if inside or text[place:].strip():
        expected = "`endsolid` or a whole triangle" if inside else "`solid`"
        got = b" ".join(text[place : place + 80].split()[:4])
        raise ValueError(f"expected {expected}, got {got!r}")
    return points, polygons
