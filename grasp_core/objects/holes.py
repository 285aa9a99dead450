"""Closes the holes of a surface by triangles between the corners of their borders.

The volume that a hole may hide is bounded by that of half a ball: a cap of area A across a hole of
width d is off by at most A d / 3 if the true surface stays within the half-ball over the hole.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.polygons import plane_frame
from grasp_core.objects.booleans import triangulate
from grasp_core.objects.solid_checks import edges_of


@dataclass(frozen=True, slots=True, eq=False)
class Caps:
    """Triangles that close all holes of a surface, (c, 3), with the sizes of the holes."""

    triangles: Indices
    """Vertex indices, wound like the surface around them, (c, 3)."""
    widths: Array
    """Largest distance between two corners of each hole, (h,) [m]."""
    hole_of: Indices
    """Number of the hole that each triangle closes, (c,)."""
    hidden: float
    """Largest volume by which the caps may differ from the true surface [m^3]."""


def caps_of(points: Array, corners: Indices) -> Caps | None:
    """Close the holes of a surface; None if it has none, or its open edges do not form loops.

    Takes `points` (n, 3) [m]; `corners` (t, 3).
    """
    loops = _loops(corners)
    if not loops:
        return None
    triangles = [_cap(points, loop) for loop in loops]
    widths = np.array([_width(points[loop]) for loop in loops])
    areas = np.array([_area(points[each]) for each in triangles])
    hole_of = np.repeat(np.arange(len(loops)), [len(each) for each in triangles])
    return Caps(np.concatenate(triangles), widths, hole_of, float(areas @ widths) / 3.0)


def _loops(corners: Indices) -> list[list[int]] | None:
    """Walk along the open edges against their triangles, so that caps are wound like these.

    None if an edge that belongs to three or more triangles has more of them on one side. Otherwise
    as many open edges end in each vertex as begin there, so that every walk returns.
    """
    tails, heads = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    place, forward = edges_of(corners)
    uses = np.bincount(place)
    balance = np.bincount(place, weights=np.where(forward, 1.0, -1.0))
    if ((uses > 1) & (balance != 0)).any():
        return None
    leaving: dict[int, list[int]] = {}
    for edge in np.flatnonzero(uses[place] == 1).tolist():
        leaving.setdefault(int(heads[edge]), []).append(int(tails[edge]))
    loops = list[list[int]]()
    for start in list(leaving):
        while leaving[start]:
            loops += _walked(start, leaving)
    return loops


def _walked(start: int, leaving: dict[int, list[int]]) -> list[list[int]]:
    """Walk until the start is reached; where a vertex is met again, a loop is complete."""
    loops, walk, place = list[list[int]](), [start], {start: 0}
    while True:  # each step uses up an edge
        vertex = leaving[walk[-1]].pop()
        if vertex in place:
            loops.append(walk[place[vertex] :])
            del walk[place[vertex] :]
            for passed in loops[-1]:
                del place[passed]
        place[vertex] = len(walk)
        walk.append(vertex)
        if vertex == start:
            return loops


def _cap(points: Array, loop: list[int]) -> Indices:
    """Triangulate a loop in the plane that fits it, or as a fan where that is not possible."""
    numbers: Indices = np.array(loop, dtype=np.int64)
    places = points[numbers]
    fan = np.column_stack([np.zeros(len(loop) - 2, dtype=np.int64),
                           np.arange(1, len(loop) - 1), np.arange(2, len(loop))])  # fmt: skip
    spokes = places - places.mean(axis=0)
    normal = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    length, size = float(np.linalg.norm(normal)), float(np.ptp(places, axis=0).max())
    if len(loop) == 3 or length <= FLAT * size**2:  # noqa: PLR2004
        return numbers[fan]
    flat: Array = spokes @ plane_frame(normal / length)
    found = triangulate([flat])
    return numbers[found if _covers(found, len(loop)) else fan]


FLAT = 1e-9
"""Area of a loop in the plane that fits it, relative to its width squared, below which it is a
crack between triangles that meet."""


def _covers(triangles: Indices, count: int) -> bool:
    """Tell whether triangles have the edges of a loop of `count` corners as their border."""
    if len(triangles) != count - 2:
        return False
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)}
    border = {edge for edge in edges if edge[::-1] not in edges}
    return border == {(k, (k + 1) % count) for k in range(count)}


def _width(places: Array) -> float:
    """Return the largest distance between two points, or a bound on it for very many."""
    if len(places) > 500:  # noqa: PLR2004 - the diagonal of the box is at most 1.8 times as long
        return float(np.linalg.norm(np.ptp(places, axis=0)))
    return float(np.linalg.norm(places[:, None] - places[None], axis=2).max())


def _area(corners: Array) -> float:
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * float(np.linalg.norm(crosses, axis=1).sum())
