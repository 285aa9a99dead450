"""Parts of four convex pieces: halves of halves, pieces shrunk at random, and their corners."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.fields import is_tuple_of
from grasp_core.geometry.polygons import clip
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.ties import first_best

SMALLER = 0.5
"""Size of random parts, as a share of the piece."""
DEEPEST = 1000
"""More cuts in a row leave parts smaller than numbers tell apart."""
Corners = tuple[Array, ...]
"""Corners of a convex part of each piece, (k, 2) in its plane."""
Path = tuple[int, ...]
"""Which half was taken at each cut."""


def random_parts(
    pieces: Sequence[FacePiece], rng: np.random.Generator, count: int
) -> Iterator[Corners]:
    """The pieces shrunk about random points of theirs."""
    for _ in range(count):
        parts: list[Array] = []
        for piece in pieces:
            about = rng.dirichlet(np.ones(len(piece.corners))) @ piece.corners
            parts.append(about + SMALLER * (piece.corners - about))
        yield tuple(parts)


def corner_contacts(pieces: Sequence[FacePiece], part: Corners) -> tuple[Array, Array]:
    """Positions and normals of contacts at all corners of a part."""
    points = [p.origin + corners @ p.frame.T for p, corners in zip(pieces, part, strict=True)]
    normals = [np.tile(p.normal, (len(c), 1)) for p, c in zip(pieces, part, strict=True)]
    return np.vstack(points), np.vstack(normals)


def part_at(pieces: Sequence[FacePiece], path: Path) -> Corners:
    """The part reached by cutting the longest polygon again and again."""
    part = [piece.corners for piece in pieces]
    for half in path:
        spans = [_longest(corners) for corners in part]
        widest = first_best([length for length, _ in spans])
        part[widest] = _half(part[widest], spans[widest][1], half)
    return tuple(part)


def is_path(value: Any) -> bool:
    """Whether a value says which half to take, cut by cut."""
    return is_tuple_of(value, int) and len(value) <= DEEPEST and set(value) <= {0, 1}


def cover_everything(paths: Sequence[Path]) -> bool:
    """Whether parts, none within another, together are the whole."""
    halves = all(half in {0, 1} for path in paths for half in path)
    apart = not any(
        two[: len(one)] == one
        for i, one in enumerate(paths)
        for j, two in enumerate(paths)
        if i != j
    )
    deepest = max((len(path) for path in paths), default=0)
    shares = sum(1 << (deepest - len(path)) for path in paths)
    return halves and apart and shares == 1 << deepest


def _longest(corners: Array) -> tuple[float, Array]:
    """Length and direction of the longest line between two corners."""
    between = (corners[:, None] - corners[None]).reshape(-1, 2)
    lengths = np.linalg.norm(between, axis=1)
    far = first_best(lengths)
    return float(lengths[far]), between[far] / lengths[far]


def _half(corners: Array, along: Array, half: int) -> Array:
    heights = corners @ along
    middle = 0.5 * float(heights.min() + heights.max())
    sign = 1.0 if half == 0 else -1.0
    return clip(corners, sign * along[None], np.array([sign * middle]))
