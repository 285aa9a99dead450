"""A polytope that grows inside a set of wrenches until its nearest plane touches the set.

Solved: the method of `quality`, from the first simplex to the last, for one set. The answer says
which forces give the points, which points bound each simplex, and with which normals; `quality`
checks that these simplices close around the points and takes its bounds from them.

The hull is that of `growing_hull`, with the same planes. A point sees simplices, first the lowest
one, then neighbours of those it sees. Across each corner j of a seen simplex f lies a neighbour:
if it is not seen, corner j gives way to the point. That new simplex adjoins

    across the point             the neighbour that is not seen,
    across another corner c      the new simplex found by turning around the corners that both
                                 keep: from f across c into the next seen simplex, then across
                                 the corner that has been common to the last two, until what
                                 lies across is not seen.

Turning needs no look-up of ridges, and makes neighbours of the right ones where a ridge has more
than two simplices. A corner is found by the sums of corners, which are exact.
"""

from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType, reportMissingTypeStubs]
from numba.core.errors import NumbaError  # pyright: ignore[reportMissingTypeStubs]

from grasp_core.arrays import Array, Indices

D = 6
"""Wrenches have six components."""
ROOM = 2048
"""Simplices at first; twice as many whenever these do not suffice."""
DEAD = 1e300
"""Offset of a simplex that is no longer there."""
SINGULAR = 1e-13
"""Least pivot of the first simplex, whose points are widely spread."""
GROWN, OUTSIDE, FLAT, LOST = 0, 1, 2, 3
"""A polytope around zero; zero is outside; all points lie in a plane; the hull fell apart."""


class Cones(NamedTuple):
    """What wrenches there are."""

    G: Array
    """Local contact forces to their wrench, (6, 3k), contiguous."""
    friction: Array
    """(k,)"""
    linf: bool
    """Whether each normal force is bounded, not their sum."""


class Limits(NamedTuple):
    """When to stop."""

    gap: float
    """(upper - lower) / upper that is enough."""
    simplices: int
    points: int
    flat: float
    """Points closer than this to a common plane, relative to their extent, span nothing more."""
    above: float
    """A point sees a simplex from this height on, relative to the extent."""


class Hull(NamedTuple):
    """Simplices, live and dead, and what is known about the latest point."""

    normals: Array
    """Outward unit normals, (room, 6)."""
    offsets: Array
    corners: Indices
    """Points of each simplex, (room, 6)."""
    neighbors: Indices
    """Neighbour across the ridge without each corner, (room, 6)."""
    sums: Indices
    """Of the corners."""
    heights: Array
    """Of the latest point that was compared with a simplex, above its plane."""
    rounds: Indices
    """Which point that was."""
    made: Indices
    """New simplex without each corner, (room, 6)."""
    seen: Indices
    """Simplices that the point sees."""
    free: Indices
    """Places of dead simplices."""
    counts: Indices
    """How many places were ever used, and how many of them are free."""


def try_out() -> None:
    """Grow a tiny polytope.

    Raises:
        RuntimeError: The method cannot be compiled here.
    """
    limits = Limits(0.5, 100, 100, 1e-9, 1e-12)
    try:
        grow(Cones(np.eye(D), np.ones(2), False), np.ones((1, D)), limits)
    except NumbaError as error:
        raise RuntimeError(f"numba: {error}") from error


@njit(cache=True)
def grow(cones: Cones, edges: Array, limits: Limits) -> tuple[int, Array, Indices, Array, Array]:
    """Grow the polytope.

    Args:
        cones: Of the set.
        edges: Local forces whose wrenches span what the set spans, (n, 3k), contiguous.
        limits: When to stop.

    Returns:
        How it ended; local forces of the points, (p, 3k); corners, (m, 6), and normals, (m, 6), of
        the simplices; the direction of least support found, (6,).
    """
    weakest, upper = np.zeros(D), np.inf
    forces, points = np.empty((limits.points, edges.shape[1])), np.empty((limits.points, D))
    hull, slack = _hull(ROOM), _begin(cones.G, edges, limits, forces, points)
    if slack < 0.0 or not _first(hull, points):
        return FLAT, forces[:0], hull.corners[:0], hull.normals[:0], weakest
    count = D + 1
    while True:
        lowest = _lowest(hull)
        support = _support(cones, hull.normals[lowest], forces[count])
        if support < upper:
            upper = support
            weakest[:] = hull.normals[lowest]
        full = count + 1 == limits.points or hull.counts[0] > limits.simplices
        if upper <= slack or full or upper - hull.offsets[lowest] <= limits.gap * upper:
            break
        _wrench(cones.G, forces[count], points[count])
        seen, ridges = _look(hull, points[count], lowest, slack, count)
        if seen == 0:
            break
        if hull.counts[0] + ridges > len(hull.offsets):
            hull = _larger(hull)
        _raise(hull, hull.seen[:seen], count, slack)
        if not _join(hull, hull.seen[:seen], slack):
            return LOST, forces[:0], hull.corners[:0], hull.normals[:0], weakest
        _bury(hull, hull.seen[:seen])
        count += 1
    inside = upper > slack and hull.offsets[_lowest(hull)] > 0.0
    live = np.flatnonzero(hull.offsets[: hull.counts[0]] < DEAD)
    return (
        GROWN if inside else OUTSIDE, forces[:count].copy(), hull.corners[live],
        hull.normals[live], weakest,
    )  # fmt: skip


@njit(cache=True)
def _hull(room: int) -> Hull:
    return Hull(
        np.empty((room, D)), np.empty(room), np.empty((room, D), np.int64),
        np.empty((room, D), np.int64), np.empty(room, np.int64), np.empty(room),
        np.zeros(room, np.int64), np.empty((room, D), np.int64), np.empty(room, np.int64),
        np.empty(room, np.int64), np.zeros(2, np.int64),
    )  # fmt: skip


@njit(cache=True)
def _larger(hull: Hull) -> Hull:
    """The same with room for at least twice as many simplices."""
    used = len(hull.offsets)
    larger = _hull(2 * used + D * hull.counts[0])
    larger.normals[:used], larger.offsets[:used] = hull.normals, hull.offsets
    larger.corners[:used], larger.neighbors[:used] = hull.corners, hull.neighbors
    larger.sums[:used], larger.heights[:used] = hull.sums, hull.heights
    larger.rounds[:used], larger.made[:used] = hull.rounds, hull.made
    larger.seen[:used], larger.free[:used] = hull.seen, hull.free
    larger.counts[:] = hull.counts
    return larger


@njit(cache=True)
def _begin(G: Array, edges: Array, limits: Limits, forces: Array, points: Array) -> float:
    """Fill in seven widely spread points; the height at which points see, -1 if all are flat."""
    n = len(edges)
    wrenches = np.empty((n, D))
    for i in range(n):
        _wrench(G, edges[i], wrenches[i])
    rest = wrenches.copy()
    for j in range(D):
        rest[:, j] -= rest[:, j].mean()
    flat = 0.0
    for step in range(D + 1):
        squares = (rest * rest).sum(axis=1)
        farthest = squares.argmax()
        if step > 0 and squares[farthest] <= flat:
            return -1.0
        forces[step], points[step] = edges[farthest], wrenches[farthest]
        if step == 0:
            rest = wrenches - wrenches[farthest]
            flat = (limits.flat * np.abs(rest).max()) ** 2
            continue
        unit = rest[farthest] / np.sqrt(squares[farthest])
        for i in range(n):
            rest[i] -= (rest[i] * unit).sum() * unit
    extent = 0.0
    for j in range(D):
        extent = max(extent, points[: D + 1, j].max() - points[: D + 1, j].min())
    return limits.above * extent


@njit(cache=True)
def _first(hull: Hull, points: Array) -> bool:
    """Put the seven simplices around the first points: false if these are nearly flat.

    With A the points as columns over ones, row i of inv(A) is the affine function that is one at
    point i and zero at the others.
    """
    n = D + 1
    A = np.zeros((n, 2 * n))
    for i in range(n):
        A[:D, i], A[D, i], A[i, n + i] = points[i], 1.0, 1.0
    if not _eliminate(A):
        return False
    for i in range(n):
        length = np.sqrt((A[i, n : n + D] ** 2).sum())
        hull.normals[i] = -A[i, n : n + D] / length
        hull.offsets[i] = A[i, n + D] / length
        hull.sums[i] = D * n // 2 - i
        for j in range(D):
            hull.corners[i, j] = hull.neighbors[i, j] = j if j < i else j + 1
    hull.counts[0] = n
    return True


@njit(cache=True)
def _eliminate(A: Array) -> bool:
    """Turn (A, 1) into (1, inv(A)); false if A is nearly singular."""
    for i in range(len(A)):
        best = i + np.abs(A[i:, i]).argmax()
        if abs(A[best, i]) <= SINGULAR:
            return False
        for j in range(A.shape[1]):
            A[i, j], A[best, j] = A[best, j], A[i, j]
        A[i] /= A[i, i]
        for k in range(len(A)):
            if k != i:
                A[k] -= A[k, i] * A[i]
    return True


@njit(cache=True)
def _lowest(hull: Hull) -> int:
    """The simplex with the least offset."""
    lowest = 0
    for i in range(hull.counts[0]):
        if hull.offsets[i] < hull.offsets[lowest]:
            lowest = i
    return lowest


@njit(cache=True)
def _support(cones: Cones, y: Array, force: Array) -> float:
    """Support of the set in the direction y; fills in the local forces that attain it."""
    total, best, at = 0.0, -np.inf, np.empty(3)
    force[:] = 0.0
    for i in range(len(cones.friction)):
        for j in range(3):
            at[j] = 0.0
            for row in range(D):
                at[j] += y[row] * cones.G[row, 3 * i + j]
        across = np.sqrt(at[1] * at[1] + at[2] * at[2])
        reached = at[0] + cones.friction[i] * across
        if cones.linf:
            if reached <= 0.0:
                continue
            total += reached
        elif reached > best:
            best = reached
            force[:] = 0.0
        else:
            continue
        slide = cones.friction[i] / across if across > 0.0 else 0.0
        force[3 * i], force[3 * i + 1], force[3 * i + 2] = 1.0, slide * at[1], slide * at[2]
    return total if cones.linf else best


@njit(cache=True)
def _wrench(G: Array, force: Array, point: Array) -> None:
    point[:] = 0.0
    for i in range(len(force)):
        if force[i] != 0.0:
            for row in range(D):
                point[row] += G[row, i] * force[i]


@njit(cache=True)
def _look(hull: Hull, point: Array, lowest: int, slack: float, now: int) -> tuple[int, int]:
    """Fill in what the point sees: how many simplices, and how many ridges around them."""
    normals, offsets, neighbors = hull.normals, hull.offsets, hull.neighbors
    heights, rounds, seen = hull.heights, hull.rounds, hull.seen
    count, ridges, at = 0, 0, 0
    heights[lowest], rounds[lowest] = _height(normals, offsets, lowest, point), now
    if heights[lowest] > slack:
        seen[0] = lowest
        count = 1
    while at < count:
        for j in range(D):
            other = neighbors[seen[at], j]
            new = rounds[other] != now
            if new:
                heights[other], rounds[other] = _height(normals, offsets, other, point), now
            if heights[other] <= slack:
                ridges += 1
            elif new:
                seen[count] = other
                count += 1
        at += 1
    return count, ridges


@njit(cache=True)
def _height(normals: Array, offsets: Array, i: int, point: Array) -> float:
    height = -offsets[i]
    for j in range(D):
        height += normals[i, j] * point[j]
    return height


@njit(cache=True)
def _raise(hull: Hull, seen: Indices, point: int, slack: float) -> None:
    """Make a new simplex wherever a seen one has a neighbour that is not seen."""
    normals, offsets, corners, neighbors = hull.normals, hull.offsets, hull.corners, hull.neighbors
    sums, heights, free, counts = hull.sums, hull.heights, hull.free, hull.counts
    for f in seen:
        for j in range(D):
            outer = neighbors[f, j]
            if heights[outer] > slack:
                continue
            new = _vacant(free, counts)
            hull.made[f, j] = new
            e, u = heights[f], heights[outer]
            for i in range(D):
                normals[new, i] = e * normals[outer, i] - u * normals[f, i]
                corners[new, i] = corners[f, i]
                neighbors[new, i] = -1
            offsets[new] = e * offsets[outer] - u * offsets[f]
            _normalize(normals, offsets, new)
            beyond = sums[outer] - sums[f] + corners[f, j]
            neighbors[outer, _place(corners, outer, beyond)] = new
            neighbors[new, j] = outer
            sums[new] = sums[f] - corners[f, j] + point
            corners[new, j], hull.rounds[new] = point, 0


@njit(cache=True)
def _vacant(free: Indices, counts: Indices) -> int:
    """A place for a new simplex: of a dead one, or at the end."""
    if counts[1] > 0:
        counts[1] -= 1
        return int(free[counts[1]])
    counts[0] += 1
    return counts[0] - 1


@njit(cache=True)
def _normalize(normals: Array, offsets: Array, i: int) -> None:
    square = 0.0
    for j in range(D):
        square += normals[i, j] * normals[i, j]
    shrink = 1.0 / np.sqrt(square)
    for j in range(D):
        normals[i, j] *= shrink
    offsets[i] *= shrink


@njit(cache=True)
def _join(hull: Hull, seen: Indices, slack: float) -> bool:
    """Make new simplices neighbours: false if one of them has none."""
    corners, neighbors, made = hull.corners, hull.neighbors, hull.made
    sums, heights = hull.sums, hull.heights
    for f in seen:
        for j in range(D):
            if heights[neighbors[f, j]] > slack:
                continue
            new = made[f, j]
            for c in range(D):
                if neighbors[new, c] >= 0:
                    continue
                here, i, kept, steps = f, c, corners[f, j], 0
                there = neighbors[here, i]
                while heights[there] > slack:
                    beyond = sums[there] - sums[here] + corners[here, i]
                    here, i, kept = there, _place(corners, there, kept), beyond
                    there = neighbors[here, i]
                    steps += 1
                    if steps > len(seen):
                        return False
                other = made[here, i]
                neighbors[new, c] = other
                neighbors[other, _place(corners, here, kept)] = new
    return True


@njit(cache=True)
def _bury(hull: Hull, seen: Indices) -> None:
    """Free the places of simplices."""
    for f in seen:
        hull.offsets[f] = DEAD
        hull.free[hull.counts[1]] = f
        hull.counts[1] += 1


@njit(cache=True)
def _place(corners: Indices, i: int, corner: int) -> int:
    """Where a simplex has a corner; 0 if it has not, which the checks of the answer find out."""
    place = 0
    for j in range(D):  # without a way out, which would be predicted wrongly most of the time
        if corners[i, j] == corner:
            place = j
    return place
