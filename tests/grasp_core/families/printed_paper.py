"""Solves the paper's programs exactly as printed, to show that they fail.

Sections 3.2 and 3.3 of Sudsang & Ponce leave conditions out that the constructions in `grasp_core`
have. The printed pencil program (force lines in two flat pencils) leaves the order of the two foci
open, so its discs hold contacts out of equilibrium. The printed regulus program (four lines of one
ruled quadric) lacks the equation of equal pitch, so its lines are often independent and cannot
balance.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cones.pyramids import PYRAMID_SIDES, pyramid_facets
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.values import ForceCone
from tests.judges import balancing_weights

LEAST = 1e-3
"""Smallest disc radius accepted from the printed pencil program, in object radii."""
PAIR = (0, 0, 1, 1)
"""The pair, 0 or 1, to which each of the four fingers belongs."""


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """One disc per face, all of one radius; lengths are in object radii."""

    centers: Array
    radii: Array
    foci: Array
    """The two foci, (2, 3)."""


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Contacts and forces of the printed regulus program, (4, 3), and the largest offset t."""

    positions: Array
    forces: Array
    offset: float


def focus_line(quad: Sequence[FacePiece]) -> tuple[list[Array], Array]:
    """N_1, N_2 and u = N_1 x N_2; the paper leaves the sign of u open, as k is free."""
    n = [piece.normal for piece in quad]
    N = [unit(np.cross(n[0], n[1])), unit(np.cross(n[2], n[3]))]
    return N, unit(np.cross(N[0], N[1]))


def focus_gap(quad: Sequence[FacePiece], foci: Array) -> float:
    """(c_2 - c_1).w / |w|, not negative where the foci are in the right order (cell A).

    w is what pair 1 contributes to a combination of the normals that vanishes.
    """
    normals = np.array([piece.normal for piece in quad])
    w = balancing_weights(normals)[:2] @ normals[:2]
    return float((foci[1] - foci[0]) @ unit(w))


def unit(vector: Array) -> Array:
    """Divide a vector by its length."""
    return vector / np.linalg.norm(vector)


def printed_pencil(quad: Sequence[FacePiece], theta: float) -> Discs | None:
    """Solve section 3.2 with R = r, over (x0, k, r); None without a disc of radius `LEAST`."""
    _, u = focus_line(quad)
    foci = [np.column_stack([np.eye(3), sign * u]) for sign in (1.0, -1.0)]
    rows, limits = [np.array([[0.0] * 4 + [-1.0]])], [np.array([-LEAST])]
    for i, piece in zip(PAIR, quad, strict=True):
        T, n = piece.frame, piece.normal
        edges = piece.E @ T.T @ foci[i]
        rows += [
            np.column_stack([edges, np.ones(len(edges))]),
            np.array([[*(-math.sin(theta) * n @ foci[i]), 1.0 + math.cos(theta)]]),
        ]
        limits += [
            piece.b + piece.E @ T.T @ piece.origin,
            np.array([-math.sin(theta) * n @ piece.origin]),
        ]
    v = _best(np.array([0.0] * 4 + [1.0]), rows, limits)
    if v is None:
        return None
    c = np.array([C @ v[:4] for C in foci])
    depths = [p.normal @ (c[i] - p.origin) for i, p in zip(PAIR, quad, strict=True)]
    centers = [c[i] - d * p.normal for i, d, p in zip(PAIR, depths, quad, strict=True)]
    return Discs(np.array(centers), np.full(4, v[4]), c)


def printed_regulus(
    quad: Sequence[FacePiece], cones: Sequence[ForceCone], least_depth: float
) -> Lines | None:
    """Solve section 3.3 over (x0, k, l_1, l_2, (x_i, y_i, z_i), t) with n.f >= least_depth."""
    v, least = np.eye(13), np.array([-least_depth])
    N, u = focus_line(quad)
    rows, limits, A_eq, b_eq = list[Array](), list[Array](), list[Array](), list[float]()
    D, F = list[Array](), list[Array]()
    for finger, (piece, cone) in enumerate(zip(quad, cones, strict=True)):
        i, sign = PAIR[finger], 1.0 if finger % 2 == 0 else -1.0
        n, T, middle = piece.normal, piece.frame, piece.frame.T @ piece.origin
        c = np.eye(3, 13) + (1.0 - 2.0 * i) * u[:, None] * v[3]
        D.append(c + sign * N[i][:, None] * v[4 + i])
        x, y, z = v[6 + 3 * i : 9 + 3 * i]
        across = np.asarray(np.cross(N[i], u), dtype=np.float64)
        F.append(u[:, None] * x + sign * (across[:, None] * y + N[i][:, None] * z))
        contact = D[-1] - F[-1]
        flat, G = T.T @ contact, pyramid_facets(cone.axis, cone.half_angle, T[:, 0], PYRAMID_SIDES)
        rows += [piece.E @ flat, flat - v[12], -flat - v[12], -G @ F[-1], -(n @ F[-1])[None]]
        limits += [piece.b + piece.E @ middle, middle, -middle, np.zeros(len(G)), least]
        A_eq.append(n @ contact)
        b_eq.append(float(n @ piece.origin))
    best = _best(-v[12], rows, limits, np.array(A_eq), np.array(b_eq))
    if best is None:
        return None
    forces = np.array(F) @ best
    return Lines(np.array(D) @ best - forces, forces, float(best[12]))


def _best(
    c: Array, rows: Sequence[Array], limits: Sequence[Array], A_eq: Array | None = None,
    b_eq: Array | None = None,
) -> Array | None:  # fmt: skip
    program = LinearProgram(c, np.vstack(rows), np.concatenate(limits), A_eq, b_eq)
    answer = maximize(program)
    return answer.x if isinstance(answer, Optimum) else None
