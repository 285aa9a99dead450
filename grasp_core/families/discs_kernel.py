"""Finds four discs of the largest common radius in compiled code, and bounds them from above.

The programs of `concurrent_kernel` and `pencil_kernel` have a radius for each disc. Rows only get
tighter as a radius grows, so the largest smallest radius r is found with all of them equal, by the
same rows with the columns of the radii summed. With one radius every program is feasible for a
small enough one, so the multipliers alone, checked here, bound every radius.

A second program keeps the smallest radius, but for a share, and maximises the sum of the four, so
that contacts whose discs have room do not end up against an arbitrary edge. Among its optima the
point nearest to the origin of the variables is taken (see `ties`). Every answer is checked here by
its residuals, with the limits of `solvers.lp` and `solvers.ties`. Where a check fails, nothing is
claimed, and the attempt is undecided.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns
from grasp_core.families.placements import (
    CONTACTS_PLACED,
    NOT_DECIDED,
    NOTHING_HELD,
    RADIUS_GIVEN_UP,
    Attempts,
    FaceTable,
    Fingers,
)
from grasp_core.geometry.vectors_kernel import across, balancing_weights, dotted
from grasp_core.solvers.lp import LP_RESIDUAL
from grasp_core.solvers.lp_kernel import LpRows, bounded, empty_rows, vertex_of
from grasp_core.solvers.nearest_point_kernel import nearest
from grasp_core.solvers.ties import CONDITIONS_MET, FEASIBLE, SAME_VALUE
from grasp_core.values import FINGERS

FACET_TURNS = facet_turns(PYRAMID_SIDES)
"""Directions in which the facets of a pyramid lean, (facets, 2)."""
ADDED_ROWS = FINGERS + 1
"""Number of rows that the second program adds."""
ACCURACY = 1e-11
"""Error up to which multipliers give the objective: even if a focus is a thousand object radii
away, the bound changes by no more than the accuracy of a program's answer."""


class Program(NamedTuple):
    """Rows A x <= b that keep four discs; the last four variables are their radii."""

    A: Array
    """Rows, (rows + `ADDED_ROWS`, n); the last ones are zeros, filled in by `largest_discs`."""
    b: Array
    """Limits of the rows, (rows + `ADDED_ROWS`,)."""
    common: int
    """Number of rows that count where all radii are equal; the others only compare radii."""
    radii: int
    """First of the variables that equal the common radius, or exceed it by a constant."""
    excess: float
    """By how much the variable `radii` exceeds the common radius; the later ones equal it."""


@loop("numpy")
def room_for_program(common: int, rows: int, radii: int, n: int, excess: float) -> Program:
    """Make a program of zeros."""
    return Program(
        np.zeros((rows + ADDED_ROWS, n)), np.zeros(rows + ADDED_ROWS), common, radii, excess
    )


@loop("numpy")
def fingers_of(faces: FaceTable, attempts: Attempts, a: int) -> Fingers:
    """Take the faces and cones of one attempt from their tables."""
    four = attempts.faces[a]
    return Fingers(
        faces.normals[four], faces.origins[four], faces.frames[four], faces.E[four], faces.b[four],
        faces.edges[four], faces.depths[four], attempts.axes[a], attempts.half_angles[a],
    )  # fmt: skip


@loop("numpy")
def facets(axis: Array, half_angle: float, T: Array) -> Array:
    """Compute the normals g of `pyramid_facets` in `cones.pyramids`, for the usual pyramid."""
    first, second = across(axis, T)
    tangent = np.tan(half_angle) * np.cos(np.pi / len(FACET_TURNS))
    sine, cosine = tangent / np.hypot(1.0, tangent), 1.0 / np.hypot(1.0, tangent)
    g = np.empty((len(FACET_TURNS), 3))
    for m in range(len(FACET_TURNS)):
        for j in range(3):
            g[m, j] = sine * axis[j] - cosine * (
                FACET_TURNS[m, 0] * first[j] + FACET_TURNS[m, 1] * second[j]
            )
    return g


@loop("numpy")
def balance(ways: Array, normals: Array, forces: Array) -> None:
    """Scale spanning directions, (4, 3), to balanced forces with normal parts that sum to one."""
    weights, pushes = np.empty(FINGERS), 0.0
    balancing_weights(ways, weights)
    for finger in range(FINGERS):
        pushes += weights[finger] * dotted(ways[finger], normals[finger])
    for finger in range(FINGERS):
        for j in range(3):
            forces[finger, j] = weights[finger] * ways[finger, j] / pushes


@loop("numpy")
def of_equal_radii(program: Program) -> LpRows:
    """Write a program over one common radius, the last variable."""
    A, b, count, radii, excess = program
    rows = empty_rows(radii + 1, count, 0)
    for j in range(radii):
        for k in range(count):
            rows.At[j, k] = A[k, j]
    for k in range(count):
        for j in range(radii, A.shape[1]):
            rows.At[radii, k] += A[k, j]
        rows.b[k] = b[k] - excess * A[k, radii]
    return rows


@loop("numpy")
def largest_last(rows: LpRows, least: float) -> float:
    """Bound the last variable from above; above `least` the bound is the tightest one."""
    c = np.zeros(len(rows.At))
    c[-1] = 1.0
    return bounded(c, rows, least, ACCURACY, vertex_of(len(c)))


@loop("numpy", once=True)
def largest_discs(program: Program, least: float, x: Array) -> tuple[int, float]:
    """Find the largest four equal discs, then enlarge each; return the end and the radius."""
    first = largest_last(of_equal_radii(program), least)
    if not least <= first < np.inf:
        return (NOTHING_HELD if first < least else NOT_DECIDED), first
    A, b, n = program.A, program.b, len(x)
    count, c = len(b) - ADDED_ROWS, np.zeros(n)
    # the sum of the radii, where the smallest one stays nearly as large
    for finger in range(FINGERS):
        r = n - FINGERS + finger
        c[r] = 1.0
        A[count + finger, r], b[count + finger] = -1.0, -first * (1.0 - RADIUS_GIVEN_UP)
        A[-1, r] = -1.0
    rows = empty_rows(n, len(b) - 1, 0)
    for k in range(len(b) - 1):
        rows.b[k] = b[k]
        for j in range(n):
            rows.At[j, k] = A[k, j]
    # multipliers are large here, and how large the sum can be is needed to few digits
    second = bounded(c, rows, -np.inf, LP_RESIDUAL, vertex_of(n))
    if not abs(second) < np.inf:
        return NOT_DECIDED, first
    b[-1] = -(second - SAME_VALUE * (1.0 + abs(second)))
    # that there is such a point shows that both bounds are reached
    unmet, excess = nearest(A, b, x)
    return (
        CONTACTS_PLACED if unmet <= CONDITIONS_MET and excess <= FEASIBLE else NOT_DECIDED
    ), first
