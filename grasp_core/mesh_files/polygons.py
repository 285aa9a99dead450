"""Collects the vertices and polygons of a mesh file, and judges rounding and shape of them.

A polygon becomes a fan around its first corner; one that its fan does not cover exactly, because it
is dented or bent, is refused.

Two signs of rounding are known. Where all coordinates are numbers of single precision, as far as
their digits show, each is off by at most half the spacing of such numbers, 2^-24 of the largest.
And the numbers of a text show how many digits its writer keeps: if none has more than S significant
digits, the last digit of the largest coordinate, of the order 10^e, counts for 10^(e + 1 - S), and
half of that is the rounding, whether the writer keeps S digits or a fixed number of decimals.
Numbers that are all shorter than `FEWEST_DIGITS` are taken as typed by hand, and exact, unless all
have the same number of decimals, `FEWEST_DIGITS` or more; those with `ALL_DIGITS` hold a double.
"""

import math
import re
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal

TRIANGLE, QUAD = 3, 4
FOLDED = 1e-9
"""A fan's triangle is folded back if its projection is below minus this share of the polygon."""
PROJECTED_SHARE = 0.5
"""Least area of a polygon projected along its normal, relative to the sum of its triangles."""


def too_many(triangles: int, most: int) -> NoReturn:
    """Refuse a file that has too many triangles."""
    message = (
        f"the mesh has {triangles} or more triangles, the limit is {most}; simplify it, or allow "
        "more (--max-triangles)"
    )
    raise MeshError(MeshRefusal.TOO_MANY, message)


def unsupported(said: str, remedy: str) -> NoReturn:
    """Refuse a file that has something which is not read."""
    message = f"the file has a feature that is not read: {said}; {remedy}"
    raise MeshError(MeshRefusal.UNSUPPORTED, message)


def whole(word: bytes) -> int:
    """Read a word as a whole number, without the underscores that Python allows."""
    return int(word.replace(b"_", b"?"))


def check_corners(corners: Indices, vertices: int) -> None:
    """Refuse corners of triangles that are no numbers of vertices."""
    low, high = int(corners.min(initial=0)), int(corners.max(initial=-1))
    if low < 0 or high >= vertices:
        message = (
            f"a triangle names vertex {low if low < 0 else high}, counted from 0, but the file has "
            f"{vertices} vertices; export it again"
        )
        raise MeshError(MeshRefusal.INDEX, message)


@dataclass(slots=True)
class Polygons:
    """The polygons of a file, by vertex numbers that count from 0, at 8 bytes a corner."""

    most: int  # largest number of triangles allowed
    triangles: int = 0  # number of triangles in the fans of the polygons so far
    corners: "array[int]" = field(default_factory=lambda: array("q"))
    sizes: "array[int]" = field(default_factory=lambda: array("q"))
    """Number of corners of each polygon."""

    def add(self, corners: Sequence[int]) -> None:
        """Add one polygon."""
        if len(corners) < TRIANGLE:
            raise ValueError(f"a face needs at least three corners, got {len(corners)}")
        self.triangles += len(corners) - 2
        if self.triangles > self.most:
            too_many(self.triangles, self.most)
        self.corners.extend(corners)
        self.sizes.append(len(corners))

    def fans(self, points: Array) -> Indices:
        """Return the triangles of all polygons in their order, (t, 3)."""
        flat, sizes = np.array(self.corners), np.array(self.sizes)
        check_corners(flat, len(points))
        first, before = np.cumsum(sizes) - sizes, np.cumsum(sizes - 2) - (sizes - 2)
        triangles = np.empty((self.triangles, TRIANGLE), dtype=np.int64)
        for size in np.unique(sizes):
            alike = sizes == size
            corners = flat[first[alike, None] + np.arange(size)]
            if size > TRIANGLE and _ambiguous_fans(points[corners]).any():
                message = "a face is dented or bent, so its shape is ambiguous; export triangles"
                raise MeshError(MeshRefusal.POLYGON, message)
            rows = np.stack(
                np.broadcast_arrays(corners[:, :1], corners[:, 1:-1], corners[:, 2:]), 2
            )
            if size == QUAD:  # masses are summed in this order, and keep their last digits
                rows[:, 1] = np.roll(rows[:, 1], -1, axis=1)
            triangles[before[alike, None] + np.arange(size - 2)] = rows
        return triangles


def _ambiguous_fans(corners: Array) -> NDArray[np.bool_]:
    """Return which polygons (n, k, 3) overlap their fan around the first corner, or lie outside."""
    with np.errstate(over="ignore", invalid="ignore"):  # sizes are judged later
        spokes = corners[:, 1:] - corners[:, :1]
        crosses = np.cross(spokes[:, :-1], spokes[:, 1:])
        whole = crosses.sum(axis=1)
        areas = np.linalg.norm(crosses, axis=2)
        dots = (spokes[:, :-1] * spokes[:, 1:]).sum(axis=2)
        along = np.einsum("nij,nj->ni", crosses, whole)
        length = np.linalg.norm(whole, axis=1)
        folds = (along < -FOLDED * length[:, None] ** 2).any(axis=1)
        winds = np.arctan2(areas, dots).sum(axis=1) > 2.0 * np.pi + FOLDED
        flat = length < PROJECTED_SHARE * areas.sum(axis=1)
    return folds | winds | flat


SINGLE = 2.0**-24
"""Largest rounding error of single precision, relative to a number."""
FEWEST_DIGITS, ALL_DIGITS = 5, 17
WRITTEN_ERROR = 0.501
"""Largest error of a written number, in units of its last digit."""
EXPONENT = re.compile(rb"[eE][+-]?\d+")
NUMBER_SIGNS = b"+-."
FLOATS = 3


@dataclass(slots=True)
class TextPoints:
    """The vertices of a text file as they are read, and how many digits they are written with."""

    numbers: "array[float]" = field(default_factory=lambda: array("d"))
    """Coordinates, three for each vertex."""
    words: bytearray = field(default_factory=bytearray)
    """The words of the coordinates, with spaces between them."""

    def __len__(self) -> int:
        return len(self.numbers) // FLOATS

    def add(self, words: Sequence[bytes]) -> None:
        """Add a vertex, given by three words."""
        if len(words) != FLOATS:
            raise ValueError(f"a vertex needs three numbers, got {len(words)}")
        self.numbers.extend([float(word.replace(b"_", b"?")) for word in words])
        self.words += b" ".join(words) + b" "

    @property
    def array(self) -> Array:
        """The vertices, (n, 3), without a copy."""
        return np.frombuffer(self.numbers, dtype=np.float64).reshape(-1, 3)

    @property
    def digits(self) -> int:
        """Significant digits that the writer kept; 0 if the numbers may be exact."""
        words = set(bytes(self.words).split())
        digits, decimals = most_digits(words), {len(word.partition(b".")[2]) for word in words}
        fixed = len(decimals) == 1 and min(decimals) >= FEWEST_DIGITS
        return digits if fixed or digits >= FEWEST_DIGITS else 0

    @property
    def rounding(self) -> float:
        """The largest rounding error of a coordinate that the numbers show; 0 if they show none."""
        points, digits = self.array, self.digits
        return single_rounding(points, digits) + text_rounding(points, digits)


def most_digits(words: Iterable[bytes]) -> int:
    """Return the most significant digits of some numbers, zeros at the end of decimals included."""
    plain = EXPONENT.sub(b"", b" ".join(words)).split()
    plain = [word if b"." in word else word.rstrip(b"0") for word in plain]
    digits = b" ".join(plain).translate(None, NUMBER_SIGNS).split()
    return max((len(each.lstrip(b"0")) for each in digits), default=0)


def text_rounding(points: Array, digits: int) -> float:
    """Return the rounding of coordinates (n, 3) written with at most so many digits."""
    largest = float(np.abs(points).max(initial=0.0))
    if not 0 < digits < ALL_DIGITS or not 0.0 < largest < math.inf:
        return 0.0
    return 0.5 * 10.0 ** (math.floor(math.log10(largest)) + 1 - digits)


def single_rounding(points: Array, digits: int = 0) -> float:
    """Return the rounding of coordinates (n, 3) if all are of single precision; 0 otherwise."""
    with np.errstate(all="ignore"):  # what is not finite is refused later
        sizes = np.abs(points)
        last = 10.0 ** (np.floor(np.log10(sizes)) + 1 - digits) if digits else np.zeros(())
        if not (np.abs(points - points.astype(np.float32)) <= WRITTEN_ERROR * last).all():
            return 0.0
    return SINGLE * float(np.abs(points).max(initial=0.0))
