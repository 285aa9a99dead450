"""Constructs regulus grasps: two pairs of lines of force that pass at equal pitch.

Solved: for four convex faces with a force cone each, grouped into the pairs (0, 1) and
(2, 3), four contacts near the middle of their faces and forces in the cones whose lines lie
on one regulus. The cones must positively span whatever direction each contributes (P3).

Derivation. With axes a_ij, planes P_i, and u along both planes as for pencils, let N_i be the
unit normal of P_i and v_i = N_i x u. The two lines of pair i pass the focus line on either side
of c_i = x0 +- k u, at d_i1 = c_i + l_i N_i and d_i2 = c_i - l_i N_i, along

    f_i1 = x_i u + y_i v_i + z_i N_i,      f_i2 = x_i u - y_i v_i - z_i N_i,             (1)

and the contacts are x_ij = d_ij - f_ij. With equal weights the two forces of a pair amount to
the force 2 x_i u with the moment 2 x_i (x0 x u) - 2 l_i y_i u, so pairs 1 and 2 cancel iff

    l_1 y_1 / x_1 = l_2 y_2 / x_2                                      (equal pitch).    (2)

The paper calls the lines "clearly linearly dependent", but without this equation they are
independent in general, and of the grasps its program returns on random polyhedra two in five
are not in equilibrium.
The equation is bilinear. Fixing both slopes tau_i = y_i / x_i makes it linear: l_1 = p tau_2 and
l_2 = p tau_1 with one free p. The projection of f_ij into P_i stays within psi of a_ij, so if
phi_ij is the angle of a_ij from the resultant of its pair, +u or -u, then

    max_j phi_ij - psi <= atan|tau_i| <= min(min_j phi_ij + psi, pi / 2),                (3)

an interval of which a few values are tried; tau_i has the sign of x_i. It is empty unless the
pair is nearly symmetric about u, |phi_i1 - phi_i2| <= 2 psi. In (x0, k, p, x_i, z_i, t) the
program is linear:

    minimise t  subject to  x_ij inside its face,                                        (4)
                            |x_ij - centre| <= t along both axes of the face,            (5)
                            f_ij in an inscribed pyramid,                                (6)
                            n_ij.f_ij >= a least depth,                                  (7)
                            p beyond a least gap, on either side.                        (8)

The last two keep out the zero force, and lines that meet: those are pencils. The program is solved
for some slopes of both pairs, on either side of the focus line: compiled code chooses the ones
whose contacts are nearest to the faces' middles, and whole programs confirm its choice.

Source: Sudsang & Ponce 1995, section 3.3; the pitch equation and its use are this project's.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns, inscribed_facets
from grasp_core.cones.spanning import angles_between
from grasp_core.families.placements import (
    Attempts,
    FaceTable,
    NoPlacement,
    Placement,
    balanced_forces,
    face_table,
    focus_direction,
)
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.lp import RESIDUAL, LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import nearest_optimum
from grasp_core.values import FINGERS, ForceCone

LEAST_DEPTH = 0.02
"""Least height of the passing points over their faces, in object radii."""
LEAST_INSET = 1e-3
"""Least distance of a contact from the edges of its face, in object radii."""
LEAST_GAP = 0.01
"""Least distance l_i, along N_i, at which a line passes the focus line, in object radii."""
X0, K, P, X, Z, T = slice(0, 3), 3, 4, slice(5, 7), slice(7, 9), 9
"""Places of the variables x0, k, p, x_i, z_i and t."""
VARIABLES = 10
RESULTANTS = np.array([1.0, 1.0, -1.0, -1.0])
"""Signs of the resultants of the fingers' pairs along u."""
SLOPES = (0.5, 0.2, 0.8)
"""Shares of the interval (3) at which each slope's angle is tried."""
SAME_OFFSET = 1e-9
"""Difference between offsets that counts as none; of equal slopes, those tried first win."""
GIVEN_UP = 1e-9
"""Offset given up in favour of the least variables: giving up less makes the contacts of two
pairings differ from each other's."""
KERNEL = "grasp_core.families.regulus_kernel"
SIDES = (1.0, -1.0)
"""Signs of p: the side of the focus line on which the first finger's line passes it."""
Choice: TypeAlias = tuple[int, int, int]
"""A choice to try: indices of the two pairs' slopes in `SLOPES`, and of the side in `SIDES`."""
CHOICES: tuple[Choice, ...] = tuple(
    product(range(len(SLOPES)), range(len(SLOPES)), range(len(SIDES)))
)


def nearly_symmetric(axes: Array, half_angles: Array) -> NDArray[np.bool_]:
    """Return whether both pairs of each quadruple leave their slopes an interval (3), (q,)."""
    least, largest = _slope_angles(axes, half_angles[:, None])
    return np.all(least < largest, axis=1)


def _slope_angles(axes: Array, half_angles: Array) -> tuple[Array, Array]:
    """Return the least and largest angle of (3) for both pairs of axes (..., 4, 3), (..., 2)."""
    resultants = focus_direction(axes)[..., None, :] * RESULTANTS[:, None]
    phi = angles_between(axes, resultants)
    in_pairs = (*phi.shape[:-1], 2, 2)
    least = (phi - half_angles).reshape(in_pairs).max(axis=-1)
    largest = (phi + half_angles).reshape(in_pairs).min(axis=-1)
    return least, np.minimum(largest, np.pi / 2.0)


class Pair(NamedTuple):
    """Frame (u, v, N) of one pair, each (3,), and the angles (3) that its slope may have [rad]."""

    u: Array
    v: Array
    N: Array
    resultant: float  # +1 where the pair pushes along u, -1 where it pushes against u
    least_angle: float
    largest_angle: float


class Line(NamedTuple):
    """Force direction F v and contact D v - F v as functions of the variables v, each (3, 10)."""

    D: Array
    F: Array


def frames_of_pairs(cones: Sequence[ForceCone]) -> list[Pair]:
    """Return the frames of the pairs (0, 1) and (2, 3), with the angles of their slopes."""
    axes = np.array([cone.axis for cone in cones])
    u = focus_direction(axes)
    least, largest = _slope_angles(axes, np.array([cone.half_angle for cone in cones]))
    pairs: list[Pair] = []
    for pair, resultant in enumerate((1.0, -1.0)):
        a, c = axes[2 * pair], axes[2 * pair + 1]
        # turned so that v has the first axis on its side
        across = np.cross(a, c) * np.sign(np.cross(np.cross(a, c), u) @ a)
        N = np.asarray(across / np.linalg.norm(across), dtype=np.float64)
        angles = float(least[pair]), float(largest[pair])
        pairs.append(Pair(u, np.asarray(np.cross(N, u)), N, resultant, *angles))
    return pairs


def slope_at(pair: Pair, share: float) -> float:
    """Return the slope y / x at a share of its interval (3), with the sign of x."""
    width = pair.largest_angle - pair.least_angle
    return pair.resultant * math.tan(pair.least_angle + share * width)


def line_of(pairs: Sequence[Pair], slopes: Sequence[float], finger: int) -> Line:
    """Return a finger's line of force as a function of the variables, the slopes being given."""
    i, side = finger // 2, 1.0 if finger % 2 == 0 else -1.0
    pair = pairs[i]
    D = np.zeros((3, VARIABLES))
    # d of (1), with l_i = p tau of the other pair by (2)
    D[:, X0], D[:, K] = np.eye(3), pair.resultant * pair.u
    D[:, P] = side * slopes[1 - i] * pair.N
    F = np.zeros((3, VARIABLES))
    # f of (1), with y = tau x
    F[:, X.start + i] = pair.u + side * slopes[i] * pair.v
    F[:, Z.start + i] = side * pair.N
    return Line(D, F)


def regulus_program(
    pieces: Sequence[FacePiece],
    facets: Sequence[Array],
    lines: Sequence[Line],
    slopes: Sequence[float],
    side: float,
) -> LinearProgram:
    """Build the program for the least offset t, for given slopes and side of the focus line."""
    offset = np.eye(VARIABLES)[T]
    gap = -side * np.eye(VARIABLES)[P]
    # (8), for both pairs: l_i is p times the slope of the other
    rows: list[Array] = [gap[None]]
    limits: list[Array | float] = [-LEAST_GAP / min(abs(slope) for slope in slopes)]
    for piece, G, line in zip(pieces, facets, lines, strict=True):
        flat, middle = piece.frame.T @ (line.D - line.F), piece.frame.T @ piece.origin
        # (4), (5) with both signs, (6) and (7)
        rows += [piece.E @ flat, flat - offset, -flat - offset, -G @ line.F, -piece.normal @ line.F]
        inside = piece.b - LEAST_INSET + piece.E @ middle
        limits += [inside, middle, -middle, np.zeros(len(G)), -LEAST_DEPTH]
    # contacts lie in the planes of their faces
    normals = np.array([piece.normal for piece in pieces])
    A_eq = np.array([n @ (line.D - line.F) for n, line in zip(normals, lines, strict=True)])
    b_eq = np.array([piece.normal @ piece.origin for piece in pieces])
    return LinearProgram(-offset, np.vstack(rows), np.hstack(limits), A_eq, b_eq)


def placed_on_lines(
    pieces: Sequence[FacePiece], lines: Sequence[Line], x: Array, merit: float
) -> Placement:
    """Return the placement at a point x of the program, (10,), with the pieces, lines and merit."""
    positions: list[Array] = []
    for piece, line in zip(pieces, lines, strict=True):
        # takes away what the program's answer may be off the plane
        contact = (line.D - line.F) @ x
        positions.append(contact - piece.normal * (piece.normal @ (contact - piece.origin)))
    passing = np.array([line.D @ x for line in lines])
    return Placement(
        positions=np.array(positions),
        forces=balanced_forces(pieces, np.array([line.F @ x for line in lines])),
        foci=np.array([passing[:2].mean(axis=0), passing[2:].mean(axis=0)]),
        radii=np.zeros(FINGERS),
        merit=merit,
    )


def place_regulus(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone]
) -> Placement | NoPlacement:
    """Place four contacts on the lines of one regulus, near the centres of the faces.

    The merit is minus the largest offset t; no placement means none for the slopes tried.
    """
    known = _best_choice(pieces, cones)
    if known is not None:
        merit, choices = known
        best = _best_of(pieces, cones, choices)
        # whole programs, solved again, have to confirm what compiled code chose
        if _merit(best) == merit or abs(_merit(best) - merit) <= RESIDUAL:
            return best
    return _best_of(pieces, cones, CHOICES)


def regulus_bounds(
    table: FaceTable, attempts: Attempts, enough: float = -SAME_OFFSET
) -> tuple[Array, Indices]:
    """Bound the merits of regulus grasps for many attempts, in compiled code.

    Gives the merits of the best choices, (a,): minus infinity where a proof excludes every choice,
    infinity where a choice was not decided. Then these choices, (a, 3), -1 where there is none.
    """
    bounds = np.empty(len(attempts.faces))
    chosen = np.empty((len(bounds), 3), dtype=np.int64)
    turns = np.array(facet_turns(PYRAMID_SIDES))
    compiled(KERNEL).regulus_bounds(table, attempts, turns, enough, bounds, chosen)
    return bounds, chosen


def _best_choice(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone]
) -> tuple[float, tuple[Choice, ...]] | None:
    """Find the best choices of slopes and side, with their merit; None if half-angles differ."""
    half_angle = cones[0].half_angle
    if any(cone.half_angle != half_angle for cone in cones):
        return None
    attempt = Attempts(
        np.arange(FINGERS)[None], np.array([[cone.axis for cone in cones]]), np.array([half_angle])
    )
    (merit,), (chosen,) = regulus_bounds(face_table(pieces), attempt)
    first, second, side = (int(each) for each in chosen)
    return float(merit), ((first, second, side),) if first >= 0 else ()


def _best_of(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], choices: Iterable[Choice]
) -> Placement | NoPlacement:
    pairs = frames_of_pairs(cones)
    best: Placement | NoPlacement = NoPlacement(-math.inf)
    if any(pair.largest_angle <= pair.least_angle for pair in pairs):
        return best  # too far from symmetric
    facets = [inscribed_facets(c, p.frame[:, 0]) for c, p in zip(cones, pieces, strict=True)]
    for *which, side in choices:
        slopes = [slope_at(pair, SLOPES[each]) for pair, each in zip(pairs, which, strict=True)]
        lines = [line_of(pairs, slopes, finger) for finger in range(FINGERS)]
        program = regulus_program(pieces, facets, lines, slopes, SIDES[side])
        found = maximize(program)
        # ties go to the first choice: rounding must not decide between equal ones
        if isinstance(found, Optimum) and found.value > _merit(best) + SAME_OFFSET:
            x = nearest_optimum(program, found, GIVEN_UP)
            best = placed_on_lines(pieces, lines, x, found.value)
    return best


def _merit(found: Placement | NoPlacement) -> float:
    return found.merit if isinstance(found, Placement) else -math.inf
