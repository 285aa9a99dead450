"""Reads PLY: a header that lists elements and properties, then their rows, as text or binary."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.polygon_soup import Surface
from grasp_core.mesh_files.refusals import broken, shown, unsupported
from grasp_core.mesh_files.words import numbers, plain_text, whole, worded_lines

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
END = re.compile(rb"\nend_header[ \t]*\r?\n")
LONGEST_HEADER = 2**16
NAME = re.compile(r"\w{1,100}", re.ASCII)
LARGEST_CORNER = 2**32
LISTS = ("vertex_indices", "vertex_index")
POINT = ("x", "y", "z")
Cell = tuple[str, list[float]]
"""Name and values of a property in one row; properties that are ignored get no values."""


@dataclass(frozen=True, slots=True)
class Property:
    """A property of an element: each row has a number for it, or a list of numbers."""

    name: str
    kind: str
    count_kind: str | None = None
    """Type of the length of a list; None for a number."""


@dataclass(frozen=True, slots=True)
class Element:
    """A table of the file: its name, number of rows, and properties."""

    name: str
    rows: int
    properties: list[Property] = field(default_factory=list[Property])

    def place(self, names: tuple[str, ...]) -> Property:
        """The one property with one of the given names.

        Raises:
            MeshError: There is no such property, or there are several.
        """
        found = [each for each in self.properties if each.name in names]
        if len(found) != 1:
            broken("header", f"element {self.name} needs one property {' or '.join(names)}")
        return found[0]


def read(data: bytes, most: int) -> tuple[Array, Indices]:
    """Vertices (n, 3) and triangles (t, 3) of a PLY file.

    Raises:
        MeshError: The file breaks a rule, or has more than `most` triangles.
    """
    found = END.search(data[:LONGEST_HEADER])
    if not found:
        broken("header", "expected `end_header`")
    order, elements = _header(data[: found.start()])
    if not order:
        broken("header", "expected a format")
    for element in elements:
        _check_element(element)
    body = data[found.end() :]
    tables = {each.name: each for each in elements}
    if len(tables) < len(elements) or not {"vertex", "face"} <= tables.keys():
        broken("header", f"expected elements vertex and face, once each, got {shown(list(tables))}")
    _check_properties(tables["vertex"], tables["face"])
    surface = Surface(most)
    if order == "=":
        _add_text(surface, elements, body)
    else:
        _add_binary(surface, elements, body, order)
    return surface.arrays()


def is_text(data: bytes) -> bool:
    """Whether the header says that text follows; what comes after the header is not looked at."""
    ended = END.search(data[:LONGEST_HEADER])
    return ended is not None and b"\nformat ascii" in data[: ended.start()]


def _check_properties(vertex: Element, face: Element) -> None:
    for name in POINT:
        if vertex.place((name,)).count_kind is not None:
            broken("header", f"property {name} must be a number, not a list")
    if face.place(LISTS).count_kind is None:
        broken("header", "the corners of faces must be a list")


def _header(text: bytes) -> tuple[str, list[Element]]:
    """Byte order, or `=` for text, and the elements."""
    first, *lines = [line.split() for line in text.decode("ascii", "replace").splitlines()]
    order, elements = "", list[Element]()
    if first != ["ply"]:
        broken("header", "expected the word ply")
    for number, words in enumerate(lines, 2):
        where = f"header line {number}"
        match words:
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["format", name, "1.0"] if name in ORDERS and not order:
                order = ORDERS[name]
            case ["element", name, rows]:
                elements.append(Element(name, whole(rows.encode(), where)))
            case ["property", first, *others] if elements:
                elements[-1].properties.append(_property([first, *others], where))
            case _:
                broken(
                    where, f"expected a format, element or property, got {shown(' '.join(words))!r}"
                )
    return order, elements


def _check_element(element: Element) -> None:
    names = [element.name, *(each.name for each in element.properties)]
    if not all(NAME.fullmatch(name) for name in names) or len(names[1:]) > len(set(names[1:])):
        broken("header", "names must be of letters and digits, and differ")
    if element.rows < 0 or not element.properties:
        broken("header", f"element {element.name} needs properties, and a count from 0 on")


def _property(said: list[str], where: str) -> Property:
    lists = said[0] == "list"
    kinds = said[1:-1] if lists else said[:-1]
    if len(kinds) != 1 + lists or not TYPES.keys() >= set(kinds):
        broken(where, f"expected a property of known type, got {shown(' '.join(said))!r}")
    if lists and TYPES[kinds[0]].startswith("f"):
        broken(where, "the length of a list must be a whole number")
    return Property(said[-1], TYPES[kinds[-1]], TYPES[kinds[0]] if lists else None)


def _add_text(surface: Surface, elements: list[Element], body: bytes) -> None:
    lines = worded_lines(plain_text(body))
    for element in elements:
        for row in range(element.rows):
            number, words = next(lines, (0, list[bytes]()))
            where = f"{element.name} {row}, line {number} after the header"
            if not words:
                broken("the end", f"{element.rows} rows of {element.name} are counted, got {row}")
            values = dict(_cells(element, iter(words), where))
            _add_row(surface, element.name, values, where)
    if (after := next(lines, None)) is not None:
        broken(f"line {after[0]} after the header", "comes after the last row that is counted")


def _cells(element: Element, words: Iterator[bytes], where: str) -> Iterator[Cell]:
    for each in element.properties:
        length = 1 if each.count_kind is None else whole(next(words, b""), where)
        found = list(islice(words, max(length, 0)))
        if len(found) != length:
            broken(where, f"{each.name} lists {length} values, got {len(found)}")
        kept = element.name in {"vertex", "face"} and each.name in (*POINT, *LISTS)
        yield each.name, _rounded(numbers(found, where), each.kind, where) if kept else []
    if next(words, None) is not None:
        broken(where, "more values than properties")


def _rounded(values: list[float], kind: str, where: str) -> list[float]:
    """Round numbers as their type would keep them."""
    if not kind.startswith("f"):
        return values
    with np.errstate(over="ignore", under="ignore"):
        kept = np.array(values).astype(kind)
    if not np.isfinite(kept).all():
        message = f"{where}: a coordinate must be finite in single precision; repair it"
        raise MeshError(MeshRefusal.NON_FINITE, message)
    return kept.tolist()


def _add_row(surface: Surface, name: str, values: dict[str, list[float]], where: str) -> None:
    if name == "vertex":
        surface.points.append([values[axis][0] for axis in POINT])
    elif name == "face":
        corners = next(values[each] for each in LISTS if each in values)
        if any(corner != int(corner) or abs(corner) > LARGEST_CORNER for corner in corners):
            broken(where, "corners must be numbers of vertices")
        surface.add([int(corner) for corner in corners], where)


def _add_binary(surface: Surface, elements: list[Element], body: bytes, order: str) -> None:
    for element in elements:
        row = _row_type(element, body, order)
        size = row.itemsize * element.rows
        if len(body) < size:
            broken("the end", f"{element.rows} rows of {element.name} are counted, got fewer")
        rows = np.frombuffer(body[:size], dtype=row)
        for each in element.properties:
            if each.count_kind and (rows["count " + each.name] != row[each.name].shape[0]).any():
                unsupported(f"{element.name} of differing numbers of corners", "export triangles")
        _add_rows(surface, element, rows)
        body = body[size:]
    if body:
        broken("the end", f"{len(body)} bytes come after the last row that is counted")


def _row_type(element: Element, body: bytes, order: str) -> np.dtype[np.void]:
    """Type of a binary row, if the lists of all rows are as long as the lists of the first."""
    parts = list[tuple[str, str] | tuple[str, str, tuple[int]]]()
    for each in element.properties:
        if each.count_kind is None:
            parts.append((each.name, order + each.kind))
            continue
        before = np.dtype(parts).itemsize if parts else 0
        parts.append(("count " + each.name, order + each.count_kind))
        counted = body[before : np.dtype(parts).itemsize] if element.rows else b""
        full = before + len(counted) == np.dtype(parts).itemsize
        length = int(np.frombuffer(counted, order + each.count_kind)[0]) if full else 0
        if not 0 <= length <= len(body):
            broken(f"{element.name} 0", f"{each.name} lists {length} values")
        parts.append((each.name, order + each.kind, (length,)))
    return np.dtype(parts)


def _add_rows(surface: Surface, element: Element, rows: NDArray[np.void]) -> None:
    if element.name == "vertex":
        points = np.stack([rows[axis].astype(np.float64) for axis in POINT], axis=1)
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if bad.size:
            message = (
                f"vertex {bad[0]}: a coordinate must be finite, got {points[bad[0]].tolist()}; "
                "repair it"
            )
            raise MeshError(MeshRefusal.NON_FINITE, message)
        surface.points += points.tolist()
    elif element.name == "face":
        corners = rows[element.place(LISTS).name]
        if corners.dtype.kind == "f" and (corners != np.floor(corners)).any():
            broken("faces", "corners must be whole numbers")
        for place, row in enumerate(corners.astype(np.int64).tolist()):
            surface.add(row, f"face {place}")
