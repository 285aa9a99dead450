"""Grows a polytope inside a set of wrenches until its nearest plane touches the set's border.

Solved: the method of `ferrari_canny`, from the first simplex to the last, for one set. The answer
gives the forces at the points, the points that bound each simplex, and the normals; `ferrari_canny`
checks that these simplices enclose zero and takes its bounds from them.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.solvers.hull_kernel import (
    DEAD,
    D,
    enclose,
    extend,
    larger,
    look,
    lowest,
    vacant_hull,
)

FLATNESS = 1e-9
"""Points closer than this to a common plane, relative to their extent, span nothing more."""
ABOVE = 1e-12
"""Height from which on a point sees a simplex, relative to the extent: some thousand roundings."""
ROOM = 2048
"""Number of simplices for which there is room at first; it is at least doubled when it is full."""
GROWN, OUTSIDE, FLAT, LOST = 0, 1, 2, 3
"""How growing ends: with a polytope around zero, with zero outside, with all points in a plane, or
with a hull that rounding has broken."""


class Cones(NamedTuple):
    """The friction cones of the contacts, whose wrenches make up the set."""

    G: Array
    """Matrix from local contact forces to their wrench, (6, 3k), or (6, 4k) with torsion,
    contiguous."""
    friction: Array
    linf: bool
    """Whether each normal force is bounded; otherwise their sum is."""


@loop()
def grow(
    cones: Cones, edges: Array, gap: float, most_simplices: int, most_points: int
) -> tuple[int, Array, Indices, Array, Array]:
    """Grow a polytope inside the set of wrenches, around zero if that is inside, up to a gap.

    Gives how it ended; local forces of the points, (p, 3k); corners, (m, 6), and normals, (m, 6),
    of the simplices; the direction of least support found, (6,).
    """
    weakest, upper = np.zeros(D), np.inf
    forces, points = np.empty((most_points, edges.shape[1])), np.empty((most_points, D))
    hull, slack = vacant_hull(ROOM), _begin(cones.G, edges, forces, points)
    if slack < 0.0 or not enclose(hull, points):
        return FLAT, forces[:0], hull.corners[:0], hull.normals[:0], weakest
    count = D + 1
    while True:  # each turn adds a point, up to `most_points`
        nearest = lowest(hull)
        support = _support(cones, hull.normals[nearest], forces[count])
        if support < upper:
            upper, weakest = support, hull.normals[nearest].copy()
        full = count + 1 == most_points or hull.counts[0] > most_simplices
        if upper <= slack or full or upper - hull.offsets[nearest] <= gap * upper:
            break
        _wrench(cones.G, forces[count], points[count])
        seen, ridges = look(hull, points[count], nearest, slack, count)
        if seen == 0:
            break
        if hull.counts[0] + ridges > len(hull.offsets):
            hull = larger(hull)
        if not extend(hull, seen, count, slack):
            return LOST, forces[:0], hull.corners[:0], hull.normals[:0], weakest
        count += 1
    inside = upper > slack and hull.offsets[lowest(hull)] > 0.0
    live = np.flatnonzero(hull.offsets[: hull.counts[0]] < DEAD)
    status = GROWN if inside else OUTSIDE
    return status, forces[:count].copy(), hull.corners[live], hull.normals[live], weakest


@loop()
def _support(cones: Cones, y: Array, force: Array) -> float:
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


@loop()
def _begin(G: Array, edges: Array, forces: Array, points: Array) -> float:
    """Choose seven points, each as far as possible from the affine hull of those before.

    Gives the height from which on points see a simplex; -1 if all points are flat.
    """
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
        forces[step], points[step] = edges[farthest], wrenches[farthest]
        if step == 0:
            rest = wrenches - points[0]
            flat = (FLATNESS * np.abs(rest).max()) ** 2
        else:
            unit, along = rest[farthest] / np.sqrt(squares[farthest]), np.zeros(len(rest))
            for j in range(D):
                along += rest[:, j] * unit[j]
            for j in range(D):
                rest[:, j] -= along * unit[j]
    # the extent of the seven points along the axis on which it is largest
    extent = 0.0
    for j in range(D):
        extent = max(extent, points[: D + 1, j].max() - points[: D + 1, j].min())
    return ABOVE * extent
