"""Reads PLY files, text or binary: tables of vertices and faces that the header describes.

What breaks the format is raised as `ValueError`, also by Python and numpy where numbers do not fit.
"""

import re
import struct
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.mesh_files.polygons import Polygons, TextPoints
from grasp_core.mesh_files.texts import plain_text, whole, worded_lines

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float16": "f2", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
END = re.compile(rb"\n[ \t]*end_header[ \t]*\r?\n|\r[ \t]*end_header[ \t]*\r")
LONGEST_HEADER = 2**16
CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I",
         "i8": "q", "u8": "Q", "f2": "e", "f4": "f", "f8": "d"}  # fmt: skip
CORNERS = {"vertex_indices", "vertex_index"}
POINT = ("x", "y", "z")


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
    order, tables, place = _header(data)
    body = _Text(data[place:]) if order == "=" else _Binary(data, place, order)
    points, polygons = np.empty((0, 3)), Polygons(most)
    for table in tables:
        if table.name == "face":
            (name,) = {column.name for column in table.columns} & CORNERS
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


def _header(data: bytes) -> tuple[str, list[Table], int]:
    """Read the byte order, the tables, and the byte where the header ends."""
    found = END.search(data[:LONGEST_HEADER])
    if not found:
        raise ValueError("expected `end_header`")
    order, tables = "", list[Table]()
    for words in map(str.split, data[: found.start()].decode("ascii", "replace").splitlines()[1:]):
        match words:
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["format", name, "1.0"] if name in ORDERS and not order:
                order = ORDERS[name]
            case ["element", name, rows]:
                tables.append(Table(name, whole(rows.encode()), []))
            case ["property", "list", count, kind, name] if tables and {count, kind} <= {*TYPES}:
                tables[-1].columns.append(Column(name, TYPES[kind], TYPES[count]))
            case ["property", kind, name] if tables and kind in TYPES:
                tables[-1].columns.append(Column(name, TYPES[kind], None))
            case _:
                raise ValueError(f"the header says {' '.join(words)[:40]!r}")
    _check(order, tables)
    return order, tables, found.end()


def _check(order: str, tables: list[Table]) -> None:
    """Refuse a header without one table of points and one of faces, or with names twice."""
    by_name = {table.name: table.columns for table in tables}
    points = [column.name for column in by_name.get("vertex", ()) if not column.counted]
    corners = [c for c in by_name.get("face", ()) if c.name in CORNERS]
    if not order or len(by_name) < len(tables) or not {*POINT} <= {*points}:
        raise ValueError("the header needs a format, and elements vertex (x, y, z) and face, once")
    if len(corners) != 1 or not corners[0].counted:
        raise ValueError(f"the header needs one list {' or '.join(sorted(CORNERS))} of faces")
    for _, rows, columns in tables:
        names = {column.name for column in columns}
        if rows < 0 or (rows and not columns) or len(names) < len(columns):
            raise ValueError("the header has a count below 0, or the same name twice")
        if any(column.counted and column.counted.startswith("f") for column in columns):
            raise ValueError("the length of a list must be a whole number")


def _rows(table: Table, body: "_Text | _Binary") -> Iterator[dict[str, Sequence[Any]]]:
    """Yield the cells of each row by the names of columns; single numbers are lists of one."""
    for _ in range(table.rows):
        cells = dict[str, Sequence[Any]]()
        body.begin_row()
        for name, kind, count in table.columns:
            length = 1 if count is None else int(body.take(count, 1)[0])
            cells[name] = body.take(kind, length)
        yield cells


class _Text:
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
            written.add([cells[axis][0] for axis in POINT])
        points, self.digits = written.array, written.digits
        for name, kind, _ in (column for column in table.columns if column.name in POINT):
            values = points[:, POINT.index(name)]
            with np.errstate(over="ignore", under="ignore", invalid="ignore"):
                kept = values.astype(kind)
            if not kind.startswith("f") and (kept != values).any():
                raise ValueError(f"{name} does not fit the whole numbers that the header gives")
            values[:] = kept
        return points

    def goes_on(self) -> bool:
        """Return whether anything follows in the row."""
        return self.place < len(self.words)


class _Binary:
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
        taken = struct.unpack_from(f"{self.order}{length}{CODES[kind]}", self.data, self.place)
        self.place = end
        return taken

    def points(self, table: Table) -> Array:
        if any(column.counted for column in table.columns):
            listed = [[cells[axis][0] for axis in POINT] for cells in _rows(table, self)]
            return np.array(listed, dtype=np.float64).reshape(-1, 3)
        fields = [(column.name, self.order + column.kind) for column in table.columns]
        rows = np.frombuffer(self.data, np.dtype(fields), table.rows, self.place)
        self.place += rows.nbytes
        return np.stack([rows[axis].astype(np.float64) for axis in POINT], axis=1)

    def goes_on(self) -> bool:
        return self.place < len(self.data)
