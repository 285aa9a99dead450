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

Each is a linear program in (x0, k, R, r_11..r_22). The paper's text leaves out the order:
outside both cells extending L beyond e_1 and e_2 can magnify its offset without limit. The
paper's program often ends there, and some of its regions then hold contacts out of equilibrium.
As (3) is needed, the radii are at most depth times tan(theta / 2) when axis = normal.

Where the surface of a curved patch is up to eps off its plane, contacts are that much nearer to the
borders of their cones and farther from P_i: the right sides of (2) and of R >= r_ij in (3) grow by
eps, and the bound of (5) loses eps |n_ij.u|. (6)

Source: Sudsang & Ponce 1995, section 3.2; the order and the two cells are this project's.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.discs_kernel import Program, balance, room_for_program
from grasp_core.families.placements import LEAST_RADIUS, Fingers, Placed
from grasp_core.geometry.vectors_kernel import angle_between, dotted, focus_direction
from grasp_core.values import FINGERS

PENCIL_K, INNER_RADIUS, PENCIL_RADII, PENCIL_VARIABLES = 3, 4, 5, 9
"""Indices of k, R and the first radius among (x0, k, R, r_11 .. r_22), and their number."""
ONE = 4
"""Place of the constant in functions of (x0, k)."""


@loop("numpy", once=True)
def pencil_program(fingers: Fingers, signs: Array) -> Program:
    """Build the program of one attempt for one order of the foci, by signs of k u as in (4).

    The common radius leaves R = r + the largest depth, by (3) and (6).
    """
    near, u = signs[0] > 0.0, focus_direction(fingers.axes)
    common = 1 + FINGERS + fingers.edges.sum() + (FINGERS if near else 0)
    program = room_for_program(
        common, common + FINGERS, INNER_RADIUS, PENCIL_VARIABLES, fingers.depths.max()
    )
    A, b = program.A, program.b
    s, y = _centers(fingers, u, signs)
    # the foci are 2 k apart
    A[0, PENCIL_K], b[0] = -2.0, -LEAST_RADIUS
    row = _disc_rows(fingers, (s, y), A, b)
    if near:
        row = _near_rows(fingers, u, s, (A, b), row)
    for i in range(FINGERS):
        # (3) loses eps by (6)
        A[row, PENCIL_RADII + i], A[row, INNER_RADIUS], b[row] = 1.0, -1.0, -fingers.depths[i]
        row += 1
    return program


@loop("numpy")
def _centers(fingers: Fingers, u: Array, signs: Array) -> tuple[Array, Array]:
    """Write (1) as functions of (x0, k, 1): depths s (4, 5), plane points of centres (4, 2, 5)."""
    s, y = np.empty((FINGERS, 5)), np.empty((FINGERS, 2, 5))
    for i in range(FINGERS):
        n, o, T, axis = fingers.normals[i], fingers.origins[i], fingers.frames[i], fingers.axes[i]
        turned, along = signs[i] * u, dotted(n, axis)
        _heights(n, turned, o, s[i])
        for j in range(5):
            s[i, j] /= along
        for t in range(2):
            _heights(T[:, t], turned, o, y[i, t])
            back = dotted(T[:, t], axis)
            for j in range(5):
                y[i, t, j] -= back * s[i, j]
    return s, y


@loop("numpy")
def _heights(d: Array, turned: Array, o: Array, found: Array) -> None:
    """Write the height d.(c - o) of a focus c = x0 + k (+-u) as a function of (x0, k, 1)."""
    for j in range(3):
        found[j] = d[j]
    found[PENCIL_K], found[ONE] = dotted(d, turned), -dotted(d, o)


@loop("numpy", once=True)
def _disc_rows(fingers: Fingers, centers: tuple[Array, Array], A: Array, b: Array) -> int:
    """Fill in, from row 1 on, the rows (2) and those that keep discs in faces; return the next."""
    (s, y), psi, row = centers, fingers.half_angle, 1
    for i in range(FINGERS):
        r, lean = PENCIL_RADII + i, angle_between(fingers.normals[i], fingers.axes[i])
        # (2), with eps off the limit by (6)
        for j in range(ONE):
            A[row, j] = -np.sin(psi) * s[i, j]
        A[row, INNER_RADIUS], A[row, r] = 1.0, 1.0 if lean >= psi else np.cos(psi - lean)
        b[row] = np.sin(psi) * s[i, ONE] - fingers.depths[i]
        row += 1
        for e in range(fingers.edges[i]):
            E = fingers.E[i, e]
            for j in range(ONE):
                A[row, j] = E[0] * y[i, 0, j] + E[1] * y[i, 1, j]
            A[row, r] = 1.0
            b[row] = fingers.b[i, e] - (E[0] * y[i, 0, ONE] + E[1] * y[i, 1, ONE])
            row += 1
    return row


@loop("numpy", once=True)
def _near_rows(fingers: Fingers, u: Array, s: Array, rows: tuple[Array, Array], row: int) -> int:
    """Fill in the rows (5), which keep the foci of cell B near each other; return the next row."""
    A, b = rows
    for i in range(FINGERS):
        T = fingers.frames[i]
        # u_1 = u and u_2 = -u
        toward = (1.0 if i < FINGERS // 2 else -1.0) * dotted(fingers.axes[i], u)
        for j in range(ONE):
            A[row, j] = -toward * s[i, j]
        A[row, PENCIL_K] += 2.0
        A[row, PENCIL_RADII + i] = np.hypot(dotted(T[:, 0], u), dotted(T[:, 1], u))
        # (6) takes eps |n.u| from the limit
        off = fingers.depths[i] * abs(dotted(fingers.normals[i], u))
        b[row] = toward * s[i, ONE] - off
        row += 1
    return row


@loop("numpy", once=True)
def take_pencil(fingers: Fingers, a: int, signs: Array, x: Array, placed: Placed) -> None:
    """Fill in contacts, forces along the axes and foci from the program's variables."""
    u = focus_direction(fingers.axes)
    _, y = _centers(fingers, u, signs)
    for i in range(FINGERS):
        first, second = y[i, 0, ONE], y[i, 1, ONE]
        for j in range(ONE):
            first += y[i, 0, j] * x[j]
            second += y[i, 1, j] * x[j]
        for j in range(3):
            T = fingers.frames[i, j]
            placed.positions[a, i, j] = fingers.origins[i, j] + T[0] * first + T[1] * second
    for pair in range(2):
        for j in range(3):
            placed.foci[a, pair, j] = x[j] + signs[2 * pair] * x[PENCIL_K] * u[j]
    balance(fingers.axes, fingers.normals, placed.forces[a])
