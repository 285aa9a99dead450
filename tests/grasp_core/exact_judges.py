"""Judges of force closure in rational arithmetic, for tests: no tolerance, no code of the package.

They correct forces by weighted least squares and twists by the reduced echelon form, where the
package takes the first columns that are independent.
"""

import math
from fractions import Fraction

import numpy as np

AT_REST = 1e-9
"""Speed of contacts that a unit twist is meant to leave at rest."""


def exactly(numbers):
    """Floats as an array of fractions, whose sums and products lose nothing."""
    return np.vectorize(Fraction, otypes=[object])(np.asarray(numbers, dtype=float))


def reduced(rows):
    """Reduced echelon form without its empty rows, and the pivots' columns."""
    rows, pivots = rows.copy(), []
    for column in range(rows.shape[1]):
        place = len(pivots)
        leads = place + np.flatnonzero(rows[place:, column])
        if len(leads):
            rows[[place, leads[0]]] = rows[[leads[0], place]]
            rows[place] /= rows[place, column]
            others = np.arange(len(rows)) != place
            rows[others] -= np.outer(rows[others, column], rows[place])
            pivots.append(column)
    return rows[: len(pivots)], pivots


def grasp_matrix(positions):
    """Wrenches about the first contact of unit forces along the axes, (6, 3k)."""
    arms, units = exactly(positions) - exactly(positions[0]), exactly(np.eye(3))
    return np.hstack([np.vstack([units, np.cross(arm, units).T]) for arm in arms])


def squares(vectors, normals):
    """Parts along normals (k,), and the squares of what is across them, times normals squared."""
    along = (vectors * normals).sum(axis=1)
    return along, (vectors**2).sum(axis=1) * (normals**2).sum(axis=1) - along**2


def closed_exactly(forces, positions, normals, friction):
    """Whether forces next to these balance exactly, strictly inside cones that span everything.

    Columns are weighted by how deep a force is in its cone, so that only deep ones change much.
    """
    n, f, G = exactly(normals), exactly(forces), grasp_matrix(positions)
    across = np.linalg.norm(np.cross(forces, normals), axis=1)
    depths = friction * (f * n).sum(axis=1).astype(float) - across
    if depths.min() <= 0.0:
        return False
    weights = np.repeat(exactly(depths) ** 2, 3)
    rows, pivots = reduced(np.column_stack([G * weights @ G.T, G @ f.ravel()]))
    if pivots != list(range(6)):
        return False
    along, across = squares(f - (weights * (rows[:, 6] @ G)).reshape(-1, 3), n)
    return bool((along > 0).all() and (across < Fraction(friction) ** 2 * along**2).all())


def open_exactly(twist, positions, normals, friction):
    """Whether a twist next to this one, (6,), about the first contact, has no cone against it."""
    size = np.linalg.norm(positions - positions[0], axis=1).max() or 1.0
    length = math.hypot(*twist[:3], *(size * twist[3:]))
    speeds = np.linalg.norm(twist[:3] + np.cross(twist[3:], positions - positions[0]), axis=1)
    y, n, none = exactly(twist), exactly(normals), [exactly(np.zeros((0, 6)))]
    moves = grasp_matrix(positions).T.reshape(-1, 3, 6)
    for own, normal, slow in zip(moves, n, speeds <= AT_REST * length, strict=True):
        if slow:
            none.append(own)
        elif friction == math.inf:  # velocity x normal
            none.append(np.cross(own.T, normal).T)
    for row, pivot in zip(*reduced(np.vstack(none)), strict=True):
        y[pivot] -= row @ y
    along, across = squares(moves @ y, n)
    if friction == math.inf:
        return bool(y.any() and (along <= 0).all() and (across == 0).all())
    kept = (along <= 0) & (Fraction(friction) ** 2 * across <= along**2)
    return bool(y.any() and kept.all())
