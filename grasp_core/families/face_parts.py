"""Divides four convex pieces into halves, shrinks them at random, and puts contacts at corners."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from grasp_core.arrays import Array, is_tuple_of
from grasp_core.geometry.polygons import clip
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.ties import first_best

SMALLER = 0.5
"""Size of randomly shrunk pieces, relative to the piece."""
DEEPEST = 1000
"""Largest number of cuts in a row: more leave parts smaller than floating-point numbers can tell
apart."""
Corners = tuple[Array, ...]
"""Corners of a convex part of each piece, each (k, 2) in the plane coordinates of its piece."""
Path = tuple[int, ...]
"""The half, 0 or 1, that was kept at each cut."""


def random_parts(
    pieces: Sequence[FacePiece], rng: np.random.Generator, count: int
) -> Iterator[Corners]:
    """Yield the four pieces, each shrunk about a random point of it."""
    for _ in range(count):
        parts: list[Array] = []
        for piece in pieces:
            about = rng.dirichlet(np.ones(len(piece.corners))) @ piece.corners
            parts.append(about + SMALLER * (piece.corners - about))
        yield tuple(parts)


def corner_contacts(pieces: Sequence[FacePiece], part: Corners) -> tuple[Array, Array]:
    """Put contacts at all corners of a part; return positions and normals, each (k, 3)."""
    points = [p.origin + corners @ p.frame.T for p, corners in zip(pieces, part, strict=True)]
    normals = [np.tile(p.normal, (len(c), 1)) for p, c in zip(pieces, part, strict=True)]
    return np.vstack(points), np.vstack(normals)


def part_at(pieces: Sequence[FacePiece], path: Path) -> Corners:
    """Return the part reached by a path, which cuts the polygon with the longest diagonal."""
    part = [piece.corners for piece in pieces]
    for half in path:
        spans = [_longest(corners) for corners in part]
        widest = first_best([length for length, _ in spans])
        part[widest] = _half(part[widest], spans[widest][1], half)
    return tuple(part)


def is_path(value: Any) -> bool:
    """Return whether a value is a path: a tuple of halves that is not too long."""
    return is_tuple_of(value, int) and len(value) <= DEEPEST and set(value) <= {0, 1}


def cover_everything(paths: Sequence[Path]) -> bool:
    """Return whether parts, none of them inside another, together make up the whole."""
    halves = all(half in {0, 1} for path in paths for half in path)
    apart = not any(
        two[: len(one)] == one
        for i, one in enumerate(paths)
        for j, two in enumerate(paths)
        if i != j
    )
    # a part after k cuts is 2^-k of the whole; whole numbers keep the sum exact
    deepest = max((len(path) for path in paths), default=0)
    shares = sum(1 << (deepest - len(path)) for path in paths)
    return halves and apart and shares == 1 << deepest


def _longest(corners: Array) -> tuple[float, Array]:
    """Return length and unit direction of the longest line between two corners."""
    between = (corners[:, None] - corners[None]).reshape(-1, 2)
    lengths = np.linalg.norm(between, axis=1)
    far = first_best(lengths)
    return float(lengths[far]), between[far] / lengths[far]


def _half(corners: Array, along: Array, half: int) -> Array:
    heights = corners @ along
    middle = 0.5 * float(heights.min() + heights.max())
    sign = 1.0 if half == 0 else -1.0
    return clip(corners, sign * along[None], np.array([sign * middle]))
