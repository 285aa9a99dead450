"""Grows a polytope inside a set of wrenches until its nearest plane touches the set's border.

Solved: the method of `ferrari_canny`, from the first simplex to the last, for one set. The answer
gives the forces at the points, the points that bound each simplex, and the normals; `ferrari_canny`
checks that these simplices enclose zero and takes its bounds from them.

The hull grows point by point. A point sees simplices, first the lowest one, then neighbours of
those it sees. Across each corner j of a seen simplex f lies a neighbour: if it is not seen, the
point takes the place of corner j. That new simplex adjoins

    across the point             the neighbour that is not seen,
    across another corner c      the new simplex found by turning around the corners that both
                                 keep: from f across c into the next seen simplex, then across
                                 the corner that has been common to the last two, until what
                                 lies across is not seen.

Turning needs no look-up of ridges, and pairs the right ones where a ridge has more than two
simplices. Functions take arrays out of the hull once: in loops that would cost more than the
arithmetic.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop

D = 6
"""Number of coordinates of each point of the hull."""
DEAD = 1e300
"""Offset that marks a simplex as removed."""
LEAST_FIRST_PIVOT = 1e-13
"""Smallest pivot accepted while the first simplex is built, whose points are widely spread."""
SMALLEST_DIVISOR = 1e-300
FLATNESS = 1e-9
"""Points closer than this to a common plane, relative to their extent, span nothing more."""
IN_SIGHT = 1e-12
"""Height from which on a point sees a simplex, relative to the extent: some thousand roundings."""
GROWN, ZERO_OUTSIDE, IN_A_PLANE, BROKEN_HULL = 0, 1, 2, 3
"""How growing ends: with a polytope around zero, with zero outside, with all points in a plane, or
with a hull that rounding has broken."""


class SetCones(NamedTuple):
    """The friction cones of the contacts, whose wrenches make up the set."""

    G: Array
    """Matrix from local contact forces to their wrench, (6, 3k), or (6, 4k) with torsion,
    contiguous."""
    friction: Array
    linf: bool
    """Whether each normal force is bounded; otherwise their sum is."""


@loop()
def grow(
    cones: SetCones, edges: Array, gap: float, most_simplices: int, most_points: int
) -> tuple[int, Array, Indices, Array, Array]:
    """Grow a polytope inside the set of wrenches, around zero if that is inside, up to a gap.

    Gives how it ended; local forces of the points, (p, 3k); corners, (m, 6), and normals, (m, 6),
    of the simplices; the direction of least support found, (6,).
    """
    weakest, upper = np.zeros(D), np.inf
    forces, points = np.empty((most_points, edges.shape[1])), np.empty((most_points, D))
    room = most_simplices  # memory that is not written to is never taken
    hull = Hull(
        np.empty((room, D)), np.empty(room), np.empty((room, D), np.int64),
        np.empty((room, D), np.int64), np.empty(room), np.empty(room, np.int64),
        np.empty((room, D), np.int64), np.empty(room, np.int64), np.empty(room, np.int64),
        np.zeros(2, np.int64),
    )  # fmt: skip
    slack = _begin(cones.G, edges, forces, points)
    if slack < 0.0 or not _enclose(hull, points):
        return IN_A_PLANE, forces[:0], hull.corners[:0], hull.normals[:0], weakest
    count = D + 1
    while True:  # each turn adds a point, up to `most_points`
        nearest = _lowest(hull)
        support = _support(cones, hull.normals[nearest], forces[count])
        if support < upper:
            upper, weakest = support, hull.normals[nearest].copy()
        near = upper - hull.offsets[nearest] <= gap * upper
        if upper <= slack or near or count + 1 == most_points:
            break
        _wrench(cones.G, forces[count], points[count])
        found, ridges = _look(hull, points[count], nearest, slack, count)
        made, free = hull.counts
        if found == 0 or made - free + ridges > most_simplices:
            break
        seen = hull.seen[:found]
        _raise(hull, seen, count, slack)
        if not _join(hull, seen, slack):
            return BROKEN_HULL, forces[:0], hull.corners[:0], hull.normals[:0], weakest
        for f in seen:
            hull.offsets[f] = DEAD
            hull.free[hull.counts[1]] = f
            hull.counts[1] += 1
        count += 1
    inside = upper > slack and hull.offsets[_lowest(hull)] > 0.0
    live = np.flatnonzero(hull.offsets[: hull.counts[0]] < DEAD)
    status = GROWN if inside else ZERO_OUTSIDE
    return status, forces[:count].copy(), hull.corners[live], hull.normals[live], weakest


@loop(once=True)
def _support(cones: SetCones, y: Array, force: Array) -> float:
    """Return the support of the set in direction y, and fill in the local forces that attain it."""
    total, best, at = 0.0, -np.inf, np.zeros(4)
    width = cones.G.shape[1] // len(cones.friction)
    force.fill(0.0)
    for i in range(len(cones.friction)):
        for j in range(width):
            at[j] = 0.0
            for row in range(D):
                at[j] += y[row] * cones.G[row, width * i + j]
        across = np.sqrt(at[1] * at[1] + at[2] * at[2] + at[3] * at[3])
        reached = at[0] + cones.friction[i] * across
        if cones.linf:
            if reached <= 0.0:
                continue
            total += reached
        elif reached > best:
            best = reached
            force.fill(0.0)
        else:
            continue
        slide = cones.friction[i] / across if across > 0.0 else 0.0
        force[width * i] = 1.0
        for j in range(1, width):
            force[width * i + j] = slide * at[j]
    return total if cones.linf else best


@loop()
def _wrench(G: Array, force: Array, point: Array) -> None:
    point.fill(0.0)
    for i in range(len(force)):
        if force[i] != 0.0:
            for row in range(D):
                point[row] += G[row, i] * force[i]


@loop(once=True)
def _begin(G: Array, edges: Array, forces: Array, points: Array) -> float:
    """Choose seven points, each farthest from the hull of others; return the slack, -1 if flat."""
    wrenches, mean = np.empty((len(edges), D)), np.zeros(D)
    for i in range(len(edges)):
        _wrench(G, edges[i], wrenches[i])
        mean += wrenches[i] / len(edges)
    rest, flat = wrenches - mean, -1.0
    for step in range(D + 1):
        squares = np.zeros(len(rest))
        for j in range(D):
            squares += rest[:, j] * rest[:, j]
        farthest = np.argmax(squares)
        if squares[farthest] <= flat:
            return -1.0
        copy(edges[farthest], forces[step])
        copy(wrenches[farthest], points[step])
        if step == 0:
            rest = wrenches - points[0]
            flat = (FLATNESS * np.abs(rest).max()) ** 2
        else:
            unit = rest[farthest] / np.sqrt(squares[farthest])
            for i in range(len(rest)):
                along = 0.0
                for j in range(D):
                    along += rest[i, j] * unit[j]
                for j in range(D):
                    rest[i, j] -= along * unit[j]
    # the extent of the seven points along the axis on which it is largest
    extent = 0.0
    for j in range(D):
        extent = max(extent, points[: D + 1, j].max() - points[: D + 1, j].min())
    return IN_SIGHT * extent


class Hull(NamedTuple):
    """The simplices of a hull, kept and removed, with what the latest point sees."""

    normals: Array
    """Outward unit normals of the simplices, (room, 6)."""
    offsets: Array
    corners: Indices
    """Indices of the points of each simplex, (room, 6)."""
    neighbors: Indices
    """Neighbour of each simplex across the ridge opposite each corner, (room, 6)."""
    heights: Array
    """Height, above each simplex, of the latest point that was compared with it, (room,)."""
    rounds: Indices
    """Index of the latest point that was compared with each simplex, (room,)."""
    made: Indices
    """New simplex across the ridge opposite each corner of a seen simplex, (room, 6)."""
    seen: Indices
    """Indices of the simplices that the latest point sees, (room,)."""
    free: Indices
    """Indices of removed simplices, which new ones may replace, (room,)."""
    counts: Indices
    """Number of simplices ever made, and number of free places, (2,)."""


@loop(once=True)
def _enclose(hull: Hull, points: Array) -> bool:
    """Make the seven simplices around the first points; return False if these are nearly flat.

    With the points as columns over ones in the matrix A, row i of inv(A) is the affine function
    that is one at point i and zero at the others.
    """
    n = D + 1
    A = np.zeros((n, 2 * n))
    for i in range(n):
        A[D, i] = A[i, n + i] = 1.0
        for j in range(D):
            A[j, i] = points[i, j]
    if not _eliminate(A):
        return False
    for i in range(n):
        for j in range(D):
            hull.normals[i, j] = -A[i, n + j]
            hull.corners[i, j] = hull.neighbors[i, j] = j if j < i else j + 1
        hull.offsets[i] = A[i, n + D]
        _normalize(hull.normals, hull.offsets, i)
        hull.rounds[i] = 0
    hull.counts[0] = n
    return True


@loop(once=True)
def _eliminate(A: Array) -> bool:
    """Turn (A, 1) into (1, inv(A)); return False if A is nearly singular."""
    for i in range(len(A)):
        best = i
        for k in range(i, len(A)):
            if abs(A[k, i]) > abs(A[best, i]):
                best = k
        pivot = A[best, i]
        if abs(pivot) <= LEAST_FIRST_PIVOT:
            return False
        for j in range(A.shape[1]):
            A[i, j], A[best, j] = A[best, j], A[i, j]
            A[i, j] /= pivot
        for k in range(len(A)):  # column i is zero in the other rows
            share = A[k, i] if k != i else 0.0
            for j in range(A.shape[1]):
                A[k, j] -= share * A[i, j]
    return True


@loop()
def _lowest(hull: Hull) -> int:
    offsets, found = hull.offsets, 0
    for i in range(hull.counts[0]):
        if offsets[i] < offsets[found]:
            found = i
    return found


@loop(once=True)
def _look(hull: Hull, point: Array, first: int, slack: float, now: int) -> tuple[int, int]:
    """Find the simplices that a point sees; return their number and that of ridges around them."""
    normals, offsets, neighbors = hull.normals, hull.offsets, hull.neighbors
    heights, rounds, seen = hull.heights, hull.rounds, hull.seen
    count, ridges, at = 0, 0, 0
    heights[first], rounds[first] = _height(normals, offsets, first, point), now
    if heights[first] > slack:
        seen[0] = first
        count = 1
    while at < count:  # a simplex is listed once, as it is compared with the point only once
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


@loop()
def _height(normals: Array, offsets: Array, i: int, point: Array) -> float:
    along = 0.0
    for j in range(D):
        along += normals[i, j] * point[j]
    return along - offsets[i]


@loop(once=True)
def _raise(hull: Hull, seen: Indices, point: int, slack: float) -> None:
    """Make a new simplex wherever a seen simplex has a neighbour that is not seen."""
    normals, offsets, corners, neighbors = hull.normals, hull.offsets, hull.corners, hull.neighbors
    heights, free, counts = hull.heights, hull.free, hull.counts
    for f in seen:
        for j in range(D):
            outer = neighbors[f, j]
            if heights[outer] > slack:
                continue
            if counts[1] > 0:
                counts[1] -= 1
                new = int(free[counts[1]])
            else:
                new = counts[0]
                counts[0] += 1
            hull.made[f, j] = new
            e, u = heights[f], heights[outer]
            for i in range(D):
                normals[new, i] = e * normals[outer, i] - u * normals[f, i]
                corners[new, i], neighbors[new, i] = corners[f, i], -1
            offsets[new] = e * offsets[outer] - u * offsets[f]
            _normalize(normals, offsets, new)
            neighbors[outer, _place(neighbors, outer, f)] = new
            neighbors[new, j] = outer
            corners[new, j], hull.rounds[new] = point, 0


@loop()
def _normalize(normals: Array, offsets: Array, i: int) -> None:
    square = 0.0
    for j in range(D):
        square += normals[i, j] * normals[i, j]
    shrink = 1.0 / np.sqrt(max(square, SMALLEST_DIVISOR))
    for j in range(D):
        normals[i, j] *= shrink
    offsets[i] *= shrink


@loop(once=True)
def _join(hull: Hull, seen: Indices, slack: float) -> bool:
    """Connect new simplices with their neighbours; return False if one has no neighbour."""
    corners, neighbors, made, heights = hull.corners, hull.neighbors, hull.made, hull.heights
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
                    beyond = corners[there, _place(neighbors, there, here)]
                    here, i, kept = there, _place(corners, there, kept), beyond
                    there = neighbors[here, i]
                    steps += 1
                    if steps > len(seen):
                        return False
                other = made[here, i]
                neighbors[new, c] = other
                neighbors[other, _place(corners, here, kept)] = new
    return True


@loop()
def _place(rows: Indices, i: int, wanted: int) -> int:
    """Return where a simplex has a corner or a neighbour; 0 if nowhere, which checks detect."""
    place = 0
    for j in range(D):  # without a way out, which would be predicted wrongly most of the time
        if rows[i, j] == wanted:
            place = j
    return place
