"""The programs of the three constructions as plain rows in NumPy, each row as its theorem has it.

Numbers in comments are those of `concurrent_kernel`, `pencil_kernel` and `regulus_kernel`.
"""

import math

import numpy as np

from grasp_core.cones.pyramids import PYRAMID_SIDES, pyramid_facets
from grasp_core.cones.spanning import angles_between
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.families.regulus_kernel import LEAST_DEPTH, LEAST_PASS, REGULUS_INSET
from grasp_core.geometry.polygons import clip
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from tests.judges import balancing_weights

SHARES = (0.5, 0.2, 0.8)
"""Where in its interval each slope of a regulus is tried."""


def facets_of(piece, cone):
    """Inward normals of the pyramid in a force cone."""
    return pyramid_facets(cone.axis, cone.half_angle, piece.frame[:, 0], PYRAMID_SIDES)


def best(c, rows, limits, *equalities):
    """The optimum of a program, or minus infinity where nothing is feasible."""
    found = maximize(LinearProgram(c, np.vstack(rows), np.concatenate(limits), *equalities))
    return found.value if isinstance(found, Optimum) else -math.inf


def concurrent(pieces, cones, sides):
    """The largest r over (x0, y_1 .. y_4, r)."""
    rows, limits = [], []
    for i, (piece, cone, side) in enumerate(zip(pieces, cones, sides, strict=True)):
        G = side * facets_of(piece, cone)  # (4)
        y = slice(3 + 2 * i, 5 + 2 * i)
        aim, inside = np.zeros((len(G), 12)), np.zeros((len(piece.E), 12))
        # a contact aims at the focus: (1), less (3)
        aim[:, :3], aim[:, y] = -G, G @ piece.frame
        aim[:, -1] = np.linalg.norm(G @ piece.frame, axis=1)
        # the disc stays in the face: (2)
        inside[:, y], inside[:, -1] = piece.E, 1.0
        rows += [aim, inside]
        limits += [-G @ piece.origin - piece.depth * np.abs(G @ piece.normal), piece.b]
    return best(np.eye(12)[-1], rows, limits)


def footprint(piece, cone, focus, contact):
    """A piece cut to the inverted cone of section 3.1 on the contact's side of a focus, (k, 3)."""
    G = np.sign(cone.axis @ (focus - contact)) * facets_of(piece, cone)
    limits = G @ (focus - piece.origin) - piece.depth * np.abs(G @ piece.normal)
    return piece.origin + clip(piece.corners, G @ piece.frame, limits) @ piece.frame.T


def direction(axes):
    """The direction u of the focus line: what the first pair contributes to a balance."""
    w = balancing_weights(axes)[:2] @ axes[:2]
    return w / np.linalg.norm(w)


def pencil(pieces, cones, signs):
    """The largest r over (x0, k, R, r), for the order of the foci c_i = x0 + signs k u."""
    u, v = direction(np.array([cone.axis for cone in cones])), np.eye(6)
    rows, limits = [-2.0 * v[3:4]], [[-LEAST_RADIUS]]
    for i, (piece, cone) in enumerate(zip(pieces, cones, strict=True)):
        n, a, T, psi = piece.normal, cone.axis, piece.frame, cone.half_angle
        c = np.zeros((3, 6))
        c[:, :3], c[:, 3] = np.eye(3), signs[i] * u
        # (1): s v + s0 and q v + q0
        s, s0 = n @ c / (n @ a), -(n @ piece.origin) / (n @ a)
        q, q0 = T.T @ (c - np.outer(a, s)), -T.T @ (s0 * a + piece.origin)
        lean = angles_between(n, a)
        kappa = 1.0 if lean >= psi else math.cos(psi - lean)
        # the ball about the focus: (2) and (3), less (6)
        rows += [[v[4] + kappa * v[5] - math.sin(psi) * s], [v[5] - v[4]]]
        limits += [[math.sin(psi) * s0 - piece.depth], [-piece.depth]]
        rows.append(piece.E @ q + v[5])
        limits.append(piece.b - piece.E @ q0)
        if signs[0] > 0.0:  # (5)
            toward = (1.0 if i < 2 else -1.0) * (a @ u)
            rows.append([2.0 * v[3] - toward * s + np.linalg.norm(T.T @ u) * v[5]])
            limits.append([toward * s0 - piece.depth * abs(n @ u)])
    return best(v[-1], rows, limits)


def regulus(pieces, cones):
    """Minus the least t over (x0, k, p, x_1, x_2, z_1, z_2, t), all slopes and both sides."""
    axes, v, frames = np.array([cone.axis for cone in cones]), np.eye(10), []
    u = direction(axes)
    for i, resultant in ((0, 1.0), (1, -1.0)):
        a, psi = axes[2 * i : 2 * i + 2], cones[0].half_angle
        N = np.cross(*a) * np.sign(np.cross(np.cross(*a), u) @ a[0])
        N /= np.linalg.norm(N)
        phi = angles_between(a, resultant * u)
        least, largest = max(phi) - psi, min(*(phi + psi), np.pi / 2.0)  # (3)
        if least >= largest:
            return -math.inf
        slopes = [resultant * math.tan(least + share * (largest - least)) for share in SHARES]
        frames.append((N, np.cross(N, u), resultant, slopes))
    return max(
        _with_slopes(pieces, cones, u, v, frames, (one, other), side)
        for one in frames[0][3] for other in frames[1][3] for side in (1.0, -1.0)
    )  # fmt: skip


def _with_slopes(pieces, cones, u, v, frames, slopes, side):
    rows, limits = [-side * v[4:5]], [[-LEAST_PASS / min(map(abs, slopes))]]  # (8)
    A_eq, b_eq = [], []
    for finger, (piece, cone) in enumerate(zip(pieces, cones, strict=True)):
        i, sign = finger // 2, 1.0 if finger % 2 == 0 else -1.0
        N, across, resultant, _ = frames[i]
        # (1), with l_i = p tau of the other pair by (2), and y = tau x
        d = np.eye(3, 10) + np.outer(resultant * u, v[3]) + np.outer(sign * slopes[1 - i] * N, v[4])
        f = np.outer(u + sign * slopes[i] * across, v[5 + i]) + np.outer(sign * N, v[7 + i])
        flat, middle = piece.frame.T @ (d - f), piece.frame.T @ piece.origin
        G = facets_of(piece, cone)
        # (4), (5) with both signs, (6) and (7)
        rows += [piece.E @ flat, flat - v[9], -flat - v[9], -G @ f, [-piece.normal @ f]]
        inside = piece.b - REGULUS_INSET + piece.E @ middle
        limits += [inside, middle, -middle, np.zeros(len(G)), [-LEAST_DEPTH]]
        A_eq.append(piece.normal @ (d - f))
        b_eq.append(piece.normal @ piece.origin)
    return best(-v[9], rows, limits, np.array(A_eq), np.array(b_eq))
