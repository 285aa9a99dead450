"""Reads PLY files, text or binary: tables of vertices and faces that the header describes."""

import struct
from array import array
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.ply_header import LISTS, POINT, Element, Header, Property, read_header
from grasp_core.mesh_files.polygon_soup import CORNERS, Polygons, points_of, too_many
from grasp_core.mesh_files.refusals import broken, not_finite
from grasp_core.mesh_files.rounding import TextPoints
from grasp_core.mesh_files.words import check_unused, numbers, plain_text, whole, worded_lines

LARGEST_CORNER = 2**32
LARGEST_ROW = 2**30
"""Largest number of bytes in one row of a table that numpy can describe."""
CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I",
         "i8": "q", "u8": "Q", "f2": "e", "f4": "f", "f8": "d"}  # fmt: skip
Lines = Iterator[tuple[int, list[bytes]]]
Cells = dict[str, Sequence[float]]
"""The values of one row that describe the surface, by the name of their property."""


def read(data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Read the vertices (n, 3), triangles (t, 3) and coordinates' digits of a PLY file."""
    header = read_header(data)
    polygons, digits = Polygons(most), 0
    if header.order == "=":
        points, digits = _text_points(header, data, polygons)
    else:
        points = _binary_points(header, data, polygons)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        said = "a coordinate must be finite in the precision of its type"
        not_finite(f"vertex {bad[0]}", said, points[bad[0]].tolist())
    return *polygons.on(points), digits


def _text_points(header: Header, data: bytes, polygons: Polygons) -> tuple[Array, int]:
    """Read the vertices (n, 3) of a text PLY and their digits, and add its faces to `polygons`."""
    points, digits = np.empty((0, 3)), 0
    lines = worded_lines(plain_text(data, header.end))
    for element in header.elements:
        if element.name == "vertex":
            written = _text_vertices(element, lines)
            points, digits = _as_typed(element, written.array), written.digits
            continue
        corners = element.place(LISTS) if element.name == "face" else None
        for where, words in _rows_of(element, lines):
            cells = _text_cells(element, words, where)
            if corners is not None:
                listed = _text_corners(corners, numbers(cells[corners.name], where), where)
                polygons.add(listed, where)
    if (after := next(lines, None)) is not None:
        broken(
            f"line {after[0]} after the header", "the file has more lines than its header announces"
        )
    return points, digits


def _rows_of(element: Element, lines: Lines) -> Iterator[tuple[str, list[bytes]]]:
    """Yield the words of each row of a table, with the row's place in the file for messages."""
    for row in range(element.rows):
        number, words = next(lines, (0, list[bytes]()))
        if not words:
            broken("the end", f"the header announces {element.rows} {element.name} rows, got {row}")
        yield f"{element.name} {row}, line {number} after the header", words


def _text_vertices(element: Element, lines: Lines) -> TextPoints:
    """Read the vertex table of a text PLY."""
    points = TextPoints()
    places = [element.properties.index(element.place((axis,))) for axis in POINT]
    for where, words in _rows_of(element, lines):
        if element.lists or len(words) != len(element.properties):
            cells = _text_cells(element, words, where)
            three = [cells[axis][0] for axis in POINT]
        else:
            three = [words[place] for place in places]
            if len(words) > len(three):
                check_unused(words, where)
        points.add(three, numbers(three, where))
    return points


def _text_cells(element: Element, words: list[bytes], where: str) -> dict[str, list[bytes]]:
    """Split the words of one row by property name; a list comes as several words."""
    check_unused(words, where)
    found, place = dict[str, list[bytes]](), 0
    for each in element.properties:
        length = 1
        if each.count_kind is not None:
            length = whole(words[place], where) if place < len(words) else -1
            place += 1
        found[each.name] = words[place : place + max(length, 0)]
        place += max(length, 0)
        if length < 0 or place > len(words):
            there = len(found[each.name])
            broken(where, f"list {each.name} announces {length} values, got {there}")
    if place < len(words):
        broken(where, "the row has more values than the header has properties")
    return found


def _as_typed(element: Element, points: Array) -> Array:
    """Round coordinates (n, 3) to the number types that the header gives for x, y and z."""
    for column, axis in enumerate(POINT):
        kind = np.dtype(element.place((axis,)).kind)
        values = points[:, column]
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            kept = values.astype(kind)
        if kind.kind != "f" and (wrong := np.flatnonzero(kept != values)).size:
            broken(f"vertex {wrong[0]}", f"{axis} does not fit its whole-number type in the header")
        points[:, column] = kept
    return points


def _text_corners(each: Property, values: list[float], where: str) -> list[int]:
    kind = np.dtype(each.kind)
    low, high = -LARGEST_CORNER, LARGEST_CORNER
    if kind.kind == "f":
        with np.errstate(over="ignore"):
            values = np.array(values).astype(kind).tolist()
    else:
        low, high = int(np.iinfo(kind).min), int(np.iinfo(kind).max)
    if not all(low <= value <= high and value == int(value) for value in values):
        broken(where, "the corners of a face must be vertex numbers, whole and in range")
    return [int(value) for value in values]


def _binary_points(header: Header, data: bytes, polygons: Polygons) -> Array:
    """Read the vertices (n, 3) of a binary PLY, and add its faces to `polygons`."""
    points, place = np.empty((0, 3)), header.end
    for element in header.elements:
        rows = _equal_rows(element, data, place, header.order)
        if rows is None:
            listed = _differing_rows(element, data, place, header.order, polygons.most)
            points, place = _add_differing(element, listed, points, place, polygons)
            continue
        place += rows.nbytes
        if element.name == "vertex":
            points = np.stack([rows[axis].astype(np.float64) for axis in POINT], axis=1)
        elif element.name == "face":
            _add_faces(rows[element.place(LISTS).name], polygons)
    if place < len(data):
        broken("the end", f"{len(data) - place} bytes follow the tables that the header announces")
    return points


def _equal_rows(element: Element, data: bytes, place: int, order: str) -> NDArray[np.void] | None:
    """Read a binary table at once if its rows are equally long; None if they may not be."""
    fields, counts, width = dict[str, tuple[str | tuple[str, int], int]](), dict[str, int](), 0
    for number, each in enumerate(element.properties):
        length, kind = 1, order + each.kind
        if each.count_kind is not None:
            count = np.dtype(order + each.count_kind)
            if not element.rows or place + width + count.itemsize > len(data):
                return None
            length = int(np.frombuffer(data, count, 1, place + width)[0])
            fields[f"count {number}"], counts[f"count {number}"] = (count.str, width), length
            width += count.itemsize
        if each.name in element.kept:
            fields[each.name] = ((kind, length) if each.count_kind else kind), width
        width += np.dtype(kind).itemsize * length
        if length < 0 or width > min(len(data), LARGEST_ROW):
            return None
    if width * element.rows > len(data) - place:
        if not counts:
            broken("the end", f"the header announces {element.rows} {element.name} rows, got fewer")
        return None
    row = np.dtype(
        {
            "names": list(fields),
            "formats": [
                kind if isinstance(kind, str) else np.dtype((kind[0], (kind[1],)))
                for kind, _ in fields.values()
            ],
            "offsets": [offset for _, offset in fields.values()],
            "itemsize": width,
        }
    )
    rows = np.frombuffer(data, row, element.rows, place)
    equal = all((rows[name] == length).all() for name, length in counts.items())
    return rows if equal else None


def _add_faces(corners: NDArray[np.generic], polygons: Polygons) -> None:
    """Add faces that all have the same number of corners k, given as vertex numbers (n, k)."""
    count, sides = corners.shape
    if count and sides < CORNERS:
        broken("face 0", f"a face needs at least three corners, got {sides}")
    if count * (sides - 2) > polygons.most:
        too_many(count * (sides - 2), polygons.most)
    for row, listed in enumerate(corners.tolist()):
        polygons.add(_whole_corners(listed, f"face {row}"), f"face {row}")


def _whole_corners(listed: Sequence[float], where: str) -> list[int]:
    if not all(abs(corner) <= LARGEST_CORNER and corner == int(corner) for corner in listed):
        broken(where, "the corners of a face must be vertex numbers, whole and in range")
    return [int(corner) for corner in listed]


def _differing_rows(
    element: Element, data: bytes, place: int, order: str, most: int
) -> Iterator[tuple[int, Cells]]:
    """Yield each row of a binary table whose rows differ in length, with the byte where it ends."""
    steps = [
        (
            each.name,
            CODES[each.kind],
            struct.calcsize("=" + CODES[each.kind]),
            struct.Struct(order + CODES[each.count_kind]) if each.count_kind else None,
            each.name in element.kept,
        )
        for each in element.properties
    ]
    for row in range(element.rows):
        cells: Cells = {}
        for name, code, size, count, kept in steps:
            length = 1
            if count is not None and (place := place + count.size) <= len(data):
                (length,) = count.unpack_from(data, place - count.size)
            past = place + size * length
            if length < 0:
                broken(f"{element.name} {row}", f"list {name} announces {length} values")
            if past > len(data):
                broken(
                    "the end", f"the header announces {element.rows} {element.name} rows, got {row}"
                )
            if kept:
                if length - 2 > most:
                    too_many(length - 2, most)
                cells[name] = struct.unpack_from(f"{order}{length}{code}", data, place)
            place = past
        yield place, cells


def _add_differing(
    element: Element,
    rows: Iterator[tuple[int, Cells]],
    points: Array,
    place: int,
    polygons: Polygons,
) -> tuple[Array, int]:
    """Read rows of different lengths; return the vertices (n, 3) and the byte where the table ends.

    For any table other than the vertices, the points given are returned unchanged.
    """
    coordinates = array("d")
    for row, (end, cells) in enumerate(rows):
        place = end
        if element.name == "vertex":
            coordinates.extend(cells[axis][0] for axis in POINT)
        elif element.name == "face":
            corners = cells[element.place(LISTS).name]
            polygons.add(_whole_corners(corners, f"face {row}"), f"face {row}")
    return (points_of(coordinates) if element.name == "vertex" else points), place
