"""Constructs pencil grasps: two pairs of lines of force, each with a focus on a common line.

Solved: for four convex faces with a force cone each, grouped into the pairs (0, 1) and
(2, 3), two focus points c_1, c_2 and discs of the largest common radius r, one inside each
face, such that any four contacts in the discs have equilibrium forces forming two flat
pencils. The four cones must positively span whatever direction each contributes (P3).

Derivation. Let a_ij be the axes of pair i, P_i the plane they span with unit normal N_i, and
lam > 0 the weights with sum lam_ij a_ij = 0. Then w = lam_11 a_11 + lam_12 a_12 lies in both
planes; u = w / |w| is the direction of the focus line c_1 c_2. From c_i the axis a_ij leads
back to the disc centre

    q_ij = c_i - s_ij a_ij,    s_ij = n_ij.(c_i - o_ij) / (n_ij.a_ij).                       (1)

A ball of radius R about c_i lies in the cone of every point of the disc of radius r_ij iff

    s_ij sin(psi) >= R + kappa_ij r_ij,   kappa = 1 if the axis leans by alpha >= psi from   (2)
                                          the normal, else cos(psi - alpha).

Now take any contacts x_ij in the discs and project them along N_i into the plane of the focus
line and P_i. The direction c_i - x_ij stays in the cone when projected, and P3 keeps it off
the line u and on the side of a_ij; the two axes are on opposite sides. So the line L_i through
x_i1 and x_i2 passes the focus line at some e_i with an offset along N_i of at most

    max_j r_ij <= R,                                                                         (3)

and c_1 - e_1 and e_2 - c_2, sums of cone directions, point along +w. Join the two crossing
points by a line L. If c_1 and c_2 lie between e_1 and e_2, the offset of L there is a convex
combination of two offsets of at most R, so L meets both balls, in z_1 and z_2. The lines
(x_ij, z_i) lie in the cones and form two flat pencils that share L: dependent, and by P3 in
equilibrium. The order is safe in two cells, c_1 = x0 -+ k u, c_2 = x0 +- k u with k >= 0:

    A   (c_2 - c_1).w >= 0: e_1 < c_1 <= c_2 < e_2 whatever the contacts;                    (4)
    B   (c_2 - c_1).w <= 0 and 2 k <= s_ij a_ij.u_i - r_ij |T_ij'u|, u_1 = u, u_2 = -u: the  (5)
        right side bounds |c_i - e_i| from below, so neither focus passes the other crossing.

Each is a linear program in (x0, k, R, r_11..r_22, r). The paper's text leaves out the order:
outside both cells extending L beyond e_1 and e_2 can magnify its offset without limit. The
paper's program often ends there, and some of its regions then hold contacts out of equilibrium.
As (3) is needed, the radii are at most depth times tan(theta / 2) when axis = normal.

Where the surface of a curved patch is up to eps off its plane, contacts are that much nearer to the
borders of their cones and farther from P_i: the right sides of (2) and of R >= r_ij in (3) grow by
eps, and the bound of (5) loses eps |n_ij.u|. (6)

Source: Sudsang & Ponce 1995, section 3.2; the order and the two cells are this project's.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cones.spanning import angles_between
from grasp_core.families.placements import (
    LEAST_RADIUS,
    NoPlacement,
    Placement,
    balanced_forces,
    focus_direction,
    largest_discs,
)
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.ties import surpassing
from grasp_core.values import FINGERS, FaceQuadruple, ForceCone

Cell: TypeAlias = tuple[float, float]
CELL_A, CELL_B = (-1.0, 1.0), (1.0, -1.0)
"""Signs of k u in c_1 and c_2 for the two orders of the foci, by (4) and (5)."""
X0, K, BALL, RADII, SMALLEST = slice(0, 3), 3, 4, slice(5, 9), 9
"""Indices of the variables: x0, k, R, the radii r_ij and their lower bound r."""
VARIABLES = 10


def place_pencil(
    pieces: Sequence[FacePiece],
    cones: Sequence[ForceCone],
    least: float,
    least_gap: float = LEAST_RADIUS,
    cells: Sequence[Cell] = (CELL_A, CELL_B),
) -> Placement | NoPlacement:
    """Place two foci and the largest four equal discs, for the better order of the foci."""
    u = focus_direction(np.array([cone.axis for cone in cones]))
    best, bound = None, -math.inf
    for cell in cells:
        found = _place_in_cell(pieces, cones, u, cell, least, least_gap)
        if isinstance(found, Placement):
            best, least = found, surpassing(found.merit)
        else:
            bound = max(bound, found.bound)
    return best or NoPlacement(bound)


def pencil_radius_bounds(
    reaches: Array, widths: Array, half_angles: Array, orders: Sequence[FaceQuadruple]
) -> Array:
    """Bound the disc radii of pencil grasps from above, for several finger orders.

    With kappa >= cos(psi), (2) and (3) leave r <= s tan(psi / 2) for each finger, and so for the
    mean of any fingers. Two fingers of a pair share a focus, hence the mean of their s is at most
    half of the bound on s_i + s_j.

    With positive weights of sum lam a = 0, (1) gives sum lam_ij s_ij = -sum lam_ij a_ij.q_ij - (c_2
    - c_1).w. In cell A the last term only lowers it. In cell B it is 2 k |w|, at most half of the
    left side, which can therefore double.
    """
    depths = [
        np.minimum(2.0 * reaches, 0.5 * np.minimum(widths[..., i, j], widths[..., k, m]))
        for i, j, k, m in orders
    ]
    return np.stack(depths, axis=-1) * np.tan(half_angles / 2.0)[..., None]


@dataclass(frozen=True, slots=True, eq=False)
class _Discs:
    """Disc centres (1) as functions of the variables v: depths s v + s0, plane points Q v + q."""

    C: Array  # maps from the variables to the focus of each finger, (4, 3, VARIABLES)
    s: Array  # linear part of the depths, (4, VARIABLES); `s0` is the constant part, (4,)
    s0: Array
    Q: Array  # linear part of the centres in their planes, (4, 2, VARIABLES)
    q: Array  # constant part of the centres, (4, 2)


def _place_in_cell(
    pieces: Sequence[FacePiece],
    cones: Sequence[ForceCone],
    u: Array,
    cell: Cell,
    least: float,
    least_gap: float,
) -> Placement | NoPlacement:
    discs = _discs(pieces, cones, u, cell)
    rows, limits = _rows(pieces, cones, discs, least_gap)
    if cell == CELL_B:
        near, ends = _near_rows(pieces, cones, discs, u)
        rows, limits = np.concatenate([rows, near]), np.concatenate([limits, ends])
    found = largest_discs(rows, limits, RADII, SMALLEST, least)
    if isinstance(found, NoPlacement):
        return found
    v, merit = found
    centers = discs.Q @ v + discs.q
    return Placement(
        positions=np.array([p.point(y) for p, y in zip(pieces, centers, strict=True)]),
        forces=balanced_forces(pieces, np.array([cone.axis for cone in cones])),
        foci=discs.C[[0, 2]] @ v,
        radii=v[RADII],
        merit=merit,
    )


def _discs(pieces: Sequence[FacePiece], cones: Sequence[ForceCone], u: Array, cell: Cell) -> _Discs:
    """Express disc centres and depths as linear functions of the variables."""
    n = np.array([piece.normal for piece in pieces])
    o = np.array([piece.origin for piece in pieces])
    T = np.array([piece.frame for piece in pieces])
    a = np.array([cone.axis for cone in cones])
    C = np.zeros((FINGERS, 3, VARIABLES))
    C[:, :, X0] = np.eye(3)
    C[:, :, K] = np.repeat(cell, 2)[:, None] * u
    along = np.einsum("fi,fi->f", n, a)[:, None]
    s = np.einsum("fi,fiv->fv", n, C) / along
    s0 = -np.einsum("fi,fi->f", n, o)[:, None] / along
    # (1), solved for s and then for q in plane coordinates
    Q = np.einsum("fit,fiv->ftv", T, C - a[:, :, None] * s[:, None, :])
    return _Discs(C, s, s0[:, 0], Q, -np.einsum("fit,fi->ft", T, s0 * a + o))


def _rows(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], discs: _Discs, least_gap: float
) -> tuple[Array, Array]:
    """Build the rows of both cells: the gap, three rows per finger, the edges of the faces."""
    depths = np.array([piece.depth for piece in pieces])
    sines = np.sin([cone.half_angle for cone in cones])
    fingers = np.arange(FINGERS)
    ball, inside, below = (np.zeros((FINGERS, VARIABLES)) for _ in range(3))
    # (2): R + kappa r - sin(psi) s <= 0, eps off the limit by (6)
    ball[:, BALL] = 1.0
    for finger, (piece, cone) in enumerate(zip(pieces, cones, strict=True)):
        # kappa: how far a disc of radius one reaches towards a cone's facets
        lean, psi = float(angles_between(piece.normal, cone.axis)), cone.half_angle
        ball[finger, RADII.start + finger] = 1.0 if lean >= psi else math.cos(psi - lean)
    ball -= sines[:, None] * discs.s
    # (3), and r <= r_ij
    inside[fingers, RADII.start + fingers], inside[:, BALL] = 1.0, -1.0
    below[fingers, RADII.start + fingers], below[:, SMALLEST] = -1.0, 1.0
    # the foci are 2 k apart
    gap = np.zeros((1, VARIABLES))
    gap[0, K] = -2.0
    # the disc about Q v + q stays inside the face
    edges = [piece.E @ Q for piece, Q in zip(pieces, discs.Q, strict=True)]
    for finger, rows in enumerate(edges):
        rows[:, RADII.start + finger] += 1.0
    rooms = [piece.b - piece.E @ q for piece, q in zip(pieces, discs.q, strict=True)]
    limits = [np.array([-least_gap]), sines * discs.s0 - depths, -depths, np.zeros(FINGERS)]
    return np.concatenate([gap, ball, inside, below, *edges]), np.concatenate([*limits, *rooms])


def _near_rows(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], discs: _Discs, u: Array
) -> tuple[Array, Array]:
    """Build the rows (5), which keep the foci of cell B near each other, one row per finger."""
    # u_1 = u and u_2 = -u
    toward = np.repeat(CELL_A, 2) * -np.array([float(cone.axis @ u) for cone in cones])
    across = np.array([abs(float(piece.normal @ u)) for piece in pieces])
    rows, fingers = -toward[:, None] * discs.s, np.arange(FINGERS)
    rows[:, K] += 2.0
    rows[fingers, RADII.start + fingers] += [np.linalg.norm(piece.frame.T @ u) for piece in pieces]
    # eps |n.u| off the limit by (6)
    depths = np.array([piece.depth for piece in pieces])
    return rows, toward * discs.s0 - depths * across
