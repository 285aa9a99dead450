"""Solves the min-weight programs of many grasps one after the other (see `metrics`).

Solved: for each grasp, with its N wrenches w_j and their mean m, a best vertex y of

    maximise N m.y  subject to  N (m - w_j).y <= 1

and the multipliers of the six rows that meet there. The dual simplex method names the rows; the
vertex and the multipliers are solved for afresh, by elimination.
"""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.closure.wrenches import WRENCH
from grasp_core.compiled import loop
from grasp_core.solvers.lp_kernel import OPTIMAL, Rows, Vertex, solve


@loop("numpy")
def vertices(wrenches: Array, twists: Array, multipliers: Array, rows: Indices) -> None:
    """Find a best vertex of the min-weight program of each grasp.

    Takes `twists`, `multipliers`, `rows` (g, 6).
    """
    count = wrenches.shape[1]
    At, b, norms = np.empty((WRENCH, count)), np.ones(count), np.empty(count)
    c, x, M = np.empty(WRENCH), np.empty(WRENCH), np.empty((WRENCH, WRENCH))
    for g in range(len(wrenches)):
        _program(wrenches[g], c, At, norms)
        status, _ = solve(c, Rows(At, b, norms, 0), -np.inf, Vertex(rows[g], multipliers[g], x))
        if status != OPTIMAL or rows[g].max() >= count:  # else it leans on the simplex method's box
            twists[g], rows[g] = np.nan, 0
            continue
        for j in range(WRENCH):
            twists[g, j], multipliers[g, j] = 1.0, c[j]
            for w in range(WRENCH):
                M[j, w] = At[w, rows[g, j]]
        _eliminate(M, twists[g])
        for j in range(WRENCH):
            for w in range(WRENCH):
                M[w, j] = At[w, rows[g, j]]
        _eliminate(M, multipliers[g])


@loop("numpy")
def _program(W: Array, c: Array, At: Array, norms: Array) -> None:
    """Fill in the objective, the rows as columns, and their lengths."""
    count = len(W)
    for w in range(WRENCH):
        c[w] = 0.0
        for j in range(count):
            c[w] += W[j, w]
    for j in range(count):
        square = 0.0
        for w in range(WRENCH):
            At[w, j] = c[w] - count * W[j, w]
            square += At[w, j] ** 2
        norms[j] = np.sqrt(square)


@loop("numpy")
def _eliminate(M: Array, x: Array) -> None:
    """Solve M x = b in place; NaN or infinity if M is singular."""
    n = len(x)
    for j in range(n):
        pivot = j
        for i in range(j + 1, n):
            pivot = i if abs(M[i, j]) > abs(M[pivot, j]) else pivot
        for h in range(j, n):
            M[j, h], M[pivot, h] = M[pivot, h], M[j, h]
        x[j], x[pivot] = x[pivot], x[j]
        for i in range(j + 1, n):
            share = M[i, j] / M[j, j]
            for h in range(j + 1, n):
                M[i, h] -= share * M[j, h]
            x[i] -= share * x[j]
    for j in range(n - 1, -1, -1):
        for h in range(j + 1, n):
            x[j] -= M[j, h] * x[h]
        x[j] /= M[j, j]
