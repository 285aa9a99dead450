"""Judges of force closure in rational arithmetic, for tests: no tolerance, no code of the package.

They correct forces by weighted least squares and twists by the reduced echelon form, where the
package takes the first columns that are independent.
"""

import math
from fractions import Fraction

import numpy as np

AT_REST = 1e-9
"""Speed of contacts that a unit twist is meant to leave at rest."""


def exactly(rows):
    return [[Fraction(x) for x in row] for row in np.asarray(rows, dtype=float).tolist()]


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def cross(a, b):
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def reduced(rows):
    """Reduced echelon form without its empty rows, and the pivots' columns."""
    rows, pivots = [list(row) for row in rows], []
    for column in range(len(rows[0]) if rows else 0):
        lead = next((i for i in range(len(pivots), len(rows)) if rows[i][column]), None)
        if lead is None:
            continue
        place = len(pivots)
        rows[place], rows[lead] = rows[lead], rows[place]
        rows[place] = [x / rows[place][column] for x in rows[place]]
        for i, row in enumerate(rows):
            if i != place and row[column]:
                rows[i] = [x - row[column] * y for x, y in zip(row, rows[place], strict=True)]
        pivots.append(column)
    return rows[: len(pivots)], pivots


def arms_of(positions):
    points = exactly(positions)
    return [[x - o for x, o in zip(point, points[0], strict=True)] for point in points]


def columns(arm):
    """Wrenches of unit forces along the axes, three of (6,)."""
    return [[*unit, *cross(arm, unit)] for unit in exactly(np.eye(3))]


def in_cone(force, normal, friction):
    """Strictly inside."""
    along = dot(force, normal)
    across = dot(force, force) * dot(normal, normal) - along**2
    return along > 0 and across < Fraction(friction) ** 2 * along**2


def closed_exactly(forces, positions, normals, friction):
    """Whether forces next to these balance exactly, strictly inside cones that span everything.

    Columns are weighted by how deep a force is in its cone, so that only deep ones change much.
    """
    n, f = exactly(normals), exactly(forces)
    depths = [
        friction * float(dot(a, b)) - np.linalg.norm(np.cross(p, q))
        for a, b, p, q in zip(f, n, forces, normals, strict=True)
    ]
    if min(depths) <= 0.0:
        return False
    weights = [Fraction(float(depth)) ** 2 for depth in depths for _ in range(3)]
    G = [column for arm in arms_of(positions) for column in columns(arm)]
    total = [dot([column[w] for column in G], [x for force in f for x in force]) for w in range(6)]
    weighted = [[x * weight for x in g] for g, weight in zip(G, weights, strict=True)]
    gram = [
        [dot([g[v] for g in weighted], [g[w] for g in G]) for v in range(6)] + [total[w]]
        for w in range(6)
    ]
    rows, pivots = reduced(gram)
    if pivots != list(range(6)):
        return False
    change = [row[6] for row in rows]
    for i, force in enumerate(f):
        for axis in range(3):
            force[axis] -= weights[3 * i] * dot(G[3 * i + axis], change)
    return all(in_cone(force, normal, friction) for force, normal in zip(f, n, strict=True))


def open_exactly(twist, positions, normals, friction):
    """Whether a twist next to this one, (6,), about the first contact, has no cone against it."""
    size = np.linalg.norm(positions - positions[0], axis=1).max() or 1.0
    length = math.hypot(*twist[:3], *(size * twist[3:]))
    speeds = np.linalg.norm(twist[:3] + np.cross(twist[3:], positions - positions[0]), axis=1)
    arms, y = arms_of(positions), [Fraction(float(x)) for x in twist]
    n, none = exactly(normals), []
    for arm, normal, slow in zip(arms, n, speeds <= AT_REST * length, strict=True):
        moves = columns(arm)
        if slow:
            none += moves
        elif friction == math.inf:
            none += slides(moves, normal)
    rows, pivots = reduced(none)
    for row, pivot in zip(rows, pivots, strict=True):
        y[pivot] = -dot([x for i, x in enumerate(row) if i != pivot],
                        [x for i, x in enumerate(y) if i != pivot])  # fmt: skip
    return any(y) and all(
        departs([dot(row, y) for row in columns(arm)], normal, friction)
        for arm, normal in zip(arms, n, strict=True)
    )


def slides(moves, normal):
    """Rows whose products with a twist are velocity x normal, from those of the velocity."""
    return [
        [a * normal[i - 1] - b * normal[i - 2]
         for a, b in zip(moves[i - 2], moves[i - 1], strict=True)]
        for i in range(3)
    ]  # fmt: skip


def departs(velocity, normal, friction):
    along = dot(velocity, normal)
    across = dot(velocity, velocity) * dot(normal, normal) - along**2
    if friction == math.inf:
        return along <= 0 and across == 0
    return along <= 0 and Fraction(friction) ** 2 * across <= along**2
