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
for some slopes of both pairs, on either side of the focus line. Those count whose contacts are
nearest to the faces' middles. Of their best contacts the ones with the least variables are taken
(see `ties`), which meet every row: that they are there shows that the bound is reached.

A program is first solved without its gap: if p stays beyond the gap anyway, that side was the
better one. As the cones span (P3), x_i is on the side of its pair's resultant; there the rows (6)
are bounds on z_i / x_i, of which the tightest imply the others.

Source: Sudsang & Ponce 1995, section 3.3; the pitch equation and its use are this project's.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.discs_kernel import ACCURACY, FACET_TURNS, balance, facets, fingers_of
from grasp_core.families.placements import (
    CONTACTS_PLACED,
    NOT_DECIDED,
    NOTHING_HELD,
    Attempts,
    FaceTable,
    Fingers,
    Placed,
)
from grasp_core.geometry.vectors_kernel import angle_between, cross, dotted, focus_direction
from grasp_core.solvers.lp_kernel import LpRows, Vertex, bounded, empty_rows, vertex_of
from grasp_core.solvers.nearest_point_kernel import nearest
from grasp_core.solvers.ties import CONDITIONS_MET, FEASIBLE
from grasp_core.values import FINGERS

LEAST_DEPTH = 0.02
"""Least height of the passing points over their faces, in object radii."""
REGULUS_INSET = 1e-3
"""Least distance of a contact from the edges of its face, in object radii."""
LEAST_PASS = 0.01
"""Least distance l_i, along N_i, at which a line passes the focus line, in object radii."""
REGULUS_K, P, X, Z, T, REGULUS_VARIABLES = 3, 4, 5, 7, 9, 10
"""Indices of k, p, x_1, z_1 and t among the variables, and their number."""
ANGLE_SHARES = (0.5, 0.2, 0.8)
"""Shares of the interval (3) at which each slope's angle is tried."""
SAME_OFFSET = 1e-9
"""Difference between offsets that counts as none; of equal slopes, those tried first win."""
NO_BOUND = 1e-12
"""Size of a facet's component along N below which the facet does not bound z / x: it allows every
value or none."""
GIVEN_UP = (1e-9, 1e-8, 1e-7)
"""Offset given up in favour of the least variables: giving up less makes the contacts of two
pairings differ from each other's. The next is tried where rounding leaves no room in one."""


class PairFrames(NamedTuple):
    """Frames of both pairs of an attempt, with the slopes to try."""

    u: Array
    """Unit vector along the focus line, which lies in both pairs' planes, (3,)."""
    v: Array
    """Unit vectors in each pair's plane, perpendicular to the focus line's direction u, (2, 3)."""
    N: Array
    """Unit normals of the planes, (2, 3)."""
    tau: Array
    """Slopes y / x of the lines of force that are tried for each pair, (2, slopes)."""
    tight: Array
    """Rows (alpha, beta) of alpha x + beta z >= 0 that bound z / x from below and from above, for
    each slope, (2, slopes, 2, 2)."""
    usable: NDArray[np.bool_]
    """Whether the two rows in `tight` leave any z / x between them, (2, slopes)."""


@loop()
def nearly_symmetric(axes: Array, half_angles: Array, found: NDArray[np.bool_]) -> None:
    """Tell whether both pairs of each quadruple leave their slopes an interval (3), (q,)."""
    for q in range(len(found)):
        u = focus_direction(axes[q])
        least, largest = _interval(axes[q], half_angles[q], u, 0)
        lowest, highest = _interval(axes[q], half_angles[q], u, 1)
        found[q] = least < largest and lowest < highest


@loop()
def _interval(axes: Array, half_angle: float, u: Array, pair: int) -> tuple[float, float]:
    """Return the least and largest angle (3) of a pair's slope."""
    least, largest = -np.pi, np.pi / 2.0
    for finger in (2 * pair, 2 * pair + 1):
        phi = angle_between(axes[finger], u if pair == 0 else -u)
        least, largest = max(least, phi - half_angle), min(largest, phi + half_angle)
    return least, largest


@loop()
def pair_frames(fingers: Fingers) -> PairFrames:
    """Compute the frames of one attempt; slopes of too asymmetric pairs are not usable."""
    axes, half_angle, slopes = fingers.axes, fingers.half_angle, len(ANGLE_SHARES)
    u, normal = focus_direction(axes), np.empty(3)
    frames = PairFrames(
        u, np.empty((2, 3)), np.empty((2, 3)), np.zeros((2, slopes)),
        np.zeros((2, slopes, 2, 2)), np.zeros((2, slopes), dtype=np.bool_),
    )  # fmt: skip
    for pair in range(2):
        resultant, first = (1.0 if pair == 0 else -1.0), axes[2 * pair]
        cross(first, axes[2 * pair + 1], normal)
        cross(normal, u, frames.v[pair])
        # turned so that v has the first axis on its side
        scale = np.sign(dotted(frames.v[pair], first)) / np.sqrt(dotted(normal, normal))
        for j in range(3):
            frames.N[pair, j] = scale * normal[j]
            frames.v[pair, j] *= scale
        least, largest = _interval(axes, half_angle, u, pair)
        if largest <= least:
            continue
        along = _facets_along(fingers, pair, frames)
        for s in range(slopes):
            # the sign of the slope is that of x
            tau = resultant * np.tan(least + ANGLE_SHARES[s] * (largest - least))
            frames.tau[pair, s] = tau
            frames.usable[pair, s] = _tightest(along, resultant, tau, frames.tight[pair, s])
    return frames


@loop(once=True)
def _facets_along(fingers: Fingers, pair: int, frames: PairFrames) -> Array:
    """Compute normals of the facets of a pair's pyramids along u, v, N, (2, facets, 3)."""
    found = np.empty((2, len(FACET_TURNS), 3))
    for each in range(2):
        finger = 2 * pair + each
        G = facets(fingers.axes[finger], fingers.half_angle, fingers.frames[finger])
        for m in range(len(G)):
            found[each, m, 0] = dotted(G[m], frames.u)
            found[each, m, 1] = dotted(G[m], frames.v[pair])
            found[each, m, 2] = dotted(G[m], frames.N[pair])
    return found


@loop(once=True)
def _tightest(facets: Array, resultant: float, tau: float, tight: Array) -> bool:
    """Find the rows alpha x + beta z >= 0 that bound z / |x|, for x on the resultant's side."""
    lower, upper = -np.inf, np.inf
    tight[:] = 0.0
    for each, side in ((0, 1.0), (1, -1.0)):
        for m in range(facets.shape[1]):
            # g.f of a force x (u +- tau v) +- z N
            alpha = facets[each, m, 0] + side * tau * facets[each, m, 1]
            beta = side * facets[each, m, 2]
            if abs(beta) <= NO_BOUND:
                if resultant * alpha < -NO_BOUND:
                    return False
                continue
            bound = -resultant * alpha / beta
            if beta > 0.0 and bound > lower:
                lower, tight[0, 0], tight[0, 1] = bound, alpha, beta
            elif beta < 0.0 and bound < upper:
                upper, tight[1, 0], tight[1, 1] = bound, alpha, beta
    return lower <= upper


class _Line(NamedTuple):
    """A line through the point D along F, both linear functions of the program's variables."""

    pair: int
    k: Array
    """Change of the point D with the variable k, (3,)."""
    p: Array
    """Change of the point D with the variable p, (3,)."""
    x: Array
    """Change of the direction F with the pair's variable x, (3,)."""
    z: Array
    """Change of the direction F with the pair's variable z, (3,)."""


@loop()
def regulus_bounds(faces: FaceTable, attempts: Attempts, bounds: Array) -> None:
    """Fill in minus infinity where no slopes are feasible, and infinity where some may be, (a,)."""
    for a in range(len(bounds)):
        fingers = fingers_of(faces, attempts, a)
        best, _, _ = _best_choice(fingers, pair_frames(fingers), -np.inf)
        bounds[a] = best if best == -np.inf else np.inf


@loop()
def place(faces: FaceTable, attempts: Attempts, placed: Placed) -> None:
    """Place contacts for each attempt on the lines of its best regulus.

    The merit is minus the largest offset from the middles of the faces.
    """
    x = np.empty(REGULUS_VARIABLES)
    for a in range(len(placed.ends)):
        fingers = fingers_of(faces, attempts, a)
        frames = pair_frames(fingers)
        best, slopes, side = _best_choice(fingers, frames, -SAME_OFFSET)
        placed.ends[a] = NOTHING_HELD if best == -np.inf else NOT_DECIDED
        for sign in (side, -side):  # the bound holds; rounding may have told the side falsely
            undecided = placed.ends[a] == NOT_DECIDED and abs(best) < np.inf
            if undecided and _nearest_optimum(fingers, frames, slopes, sign, best, x):
                _take(fingers, frames, slopes, a, x, placed)
                placed.ends[a], placed.merits[a] = CONTACTS_PLACED, best


@loop()
def _best_choice(
    fingers: Fingers, frames: PairFrames, enough: float
) -> tuple[float, tuple[int, int], float]:
    """Find the slopes and the side of p with the largest bound, until one is above `enough`."""
    best, slopes, side, vertex = -np.inf, (0, 0), 1.0, vertex_of(REGULUS_VARIABLES)
    for i in range(len(ANGLE_SHARES)):
        for j in range(len(ANGLE_SHARES)):
            if frames.usable[0, i] and frames.usable[1, j] and best <= enough:
                # ties go to the first choice: rounding must not decide between equal ones
                worth = best + SAME_OFFSET
                rows, gap = _rows(fingers, frames, (i, j))
                found, sign = _best_side(rows, gap, worth, vertex)
                if found > worth:
                    best, slopes, side = found, (i, j), sign
    return best, slopes, side


@loop(once=True)
def _nearest_optimum(
    fingers: Fingers, frames: PairFrames, slopes: tuple[int, int], side: float, best: float,
    x: Array,
) -> bool:  # fmt: skip
    """Fill in the optimum with the least variables; return whether it meets every row."""
    rows, gap = _rows(fingers, frames, slopes)
    rows.At[P, 0], rows.b[0] = -side, -gap
    count, room = len(rows.b), len(rows.b) + rows.equalities + 1
    A, b = np.zeros((room, REGULUS_VARIABLES)), np.empty(room)
    for k in range(room - 1):
        # equalities hold from both sides
        sign, row = (1.0, k) if k < count else (-1.0, k - rows.equalities)
        b[k] = sign * rows.b[row]
        for j in range(REGULUS_VARIABLES):
            A[k, j] = sign * rows.At[j, row]
    A[-1, T] = 1.0
    for given_up in GIVEN_UP:
        b[-1] = given_up * (1.0 + abs(best)) - best
        unmet, excess = nearest(A, b, x)
        if unmet <= CONDITIONS_MET and excess <= FEASIBLE:
            return True
    return False


@loop(once=True)
def _take(
    fingers: Fingers, frames: PairFrames, slopes: tuple[int, int], a: int, x: Array, placed: Placed
) -> None:
    """Fill in contacts, forces and foci from the variables of a program."""
    ways = np.empty((FINGERS, 3))
    placed.foci[a] = 0.0
    for finger in range(FINGERS):
        line, n = _line(frames, slopes, finger), fingers.normals[finger]
        contact, way = placed.positions[a, finger], ways[finger]
        for d in range(3):
            passing = x[d] + x[REGULUS_K] * line.k[d] + x[P] * line.p[d]
            way[d] = x[X + line.pair] * line.x[d] + x[Z + line.pair] * line.z[d]
            contact[d] = passing - way[d]
            placed.foci[a, line.pair, d] += 0.5 * passing
        # takes away what the program's answer may be off the plane
        off = 0.0
        for d in range(3):
            off += n[d] * (contact[d] - fingers.origins[finger, d])
        for d in range(3):
            contact[d] -= off * n[d]
    balance(ways, fingers.normals, placed.forces[a])


@loop(once=True)
def _best_side(rows: LpRows, gap: float, worth: float, vertex: Vertex) -> tuple[float, float]:
    """Solve the programs for p > gap and p < -gap; return the better bound and the sign of p."""
    either = _bounded(rows, worth, vertex)
    p = vertex.x[P]  # anything where `either` is infinite: the sides decide then, or nothing does
    if either <= worth or p >= gap:
        return either, 1.0
    rows.At[P, 0], rows.b[0] = -1.0, -gap
    plus = _bounded(rows, worth, vertex)
    if plus >= either - SAME_OFFSET:
        return plus, 1.0
    if p <= -gap:
        return either, -1.0
    worth = max(worth, plus + SAME_OFFSET)
    rows.At[P, 0] = 1.0
    minus = _bounded(rows, worth, vertex)
    return (minus, -1.0) if minus > worth else (plus, 1.0)


@loop()
def _bounded(rows: LpRows, worth: float, vertex: Vertex) -> float:
    """Bound minus the offset from above."""
    c = np.zeros(REGULUS_VARIABLES)
    c[T] = -1.0
    return bounded(c, rows, worth, ACCURACY, vertex)


@loop("numpy")
def _rows(fingers: Fingers, frames: PairFrames, slopes: tuple[int, int]) -> tuple[LpRows, float]:
    """Build the rows, the first left for the gap (8) and equalities last; return also the gap."""
    count = 1 + FINGERS * (4 + 1 + 1) + 4 + fingers.edges.sum()
    rows = empty_rows(REGULUS_VARIABLES, count, FINGERS)
    row, equality = 1, count - FINGERS
    for finger in range(FINGERS):
        line, n = _line(frames, slopes, finger), fingers.normals[finger]
        row = _edge_rows(fingers, finger, line, rows, row)
        row = _offset_rows(fingers, finger, line, rows, row)
        # (7): the passing point is high enough over the face
        _add(line, n, (0.0, -1.0), rows, row)
        rows.b[row] = -LEAST_DEPTH
        # the contact lies in the plane of its face
        _add(line, n, (1.0, -1.0), rows, equality + finger)
        rows.b[equality + finger] = dotted(n, fingers.origins[finger])
        row += 1
    for pair in range(2):
        for bound in range(2):
            # (6), as bounds on z / x
            tight = frames.tight[pair, slopes[pair], bound]
            rows.At[X + pair, row], rows.At[Z + pair, row] = -tight[0], -tight[1]
            row += 1
    # (8) for both pairs: by (2), l_i is p times the slope of the other
    flattest = min(abs(frames.tau[0, slopes[0]]), abs(frames.tau[1, slopes[1]]))
    return rows, LEAST_PASS / flattest


@loop()
def _edge_rows(fingers: Fingers, i: int, line: _Line, rows: LpRows, row: int) -> int:
    """Fill in the rows (4), which keep the contact D - F of a line inside its face."""
    edge, frame, E = np.empty(3), fingers.frames[i], fingers.E[i]
    for e in range(fingers.edges[i]):
        for j in range(3):
            edge[j] = frame[j, 0] * E[e, 0] + frame[j, 1] * E[e, 1]
        _add(line, edge, (1.0, -1.0), rows, row)
        rows.b[row] = fingers.b[i, e] - REGULUS_INSET + dotted(edge, fingers.origins[i])
        row += 1
    return row


@loop()
def _offset_rows(fingers: Fingers, i: int, line: _Line, rows: LpRows, row: int) -> int:
    """Fill in the rows (5), which make t the largest offset from the middle of the face."""
    along = np.empty(3)
    for axis in range(2):
        for sign in (1.0, -1.0):
            for j in range(3):
                along[j] = sign * fingers.frames[i, j, axis]
            _add(line, along, (1.0, -1.0), rows, row)
            rows.At[T, row], rows.b[row] = -1.0, dotted(along, fingers.origins[i])
            row += 1
    return row


@loop()
def _line(frames: PairFrames, slopes: tuple[int, int], finger: int) -> _Line:
    pair, side = finger // 2, 1.0 if finger % 2 == 0 else -1.0
    resultant, other = (1.0 if pair == 0 else -1.0), 1 - pair
    tau, tau_other = frames.tau[pair, slopes[pair]], frames.tau[other, slopes[other]]
    line = _Line(pair, np.empty(3), np.empty(3), np.empty(3), np.empty(3))
    for j in range(3):
        line.k[j] = resultant * frames.u[j]
        line.p[j] = side * tau_other * frames.N[pair, j]
        line.x[j] = frames.u[j] + side * tau * frames.v[pair, j]
        line.z[j] = side * frames.N[pair, j]
    return line


@loop()
def _add(line: _Line, d: Array, shares: tuple[float, float], rows: LpRows, row: int) -> None:
    """Fill in a row that adds shares of d.D and d.F, for `shares` = (passing, force)."""
    passing, force = shares
    for j in range(3):
        rows.At[j, row] = passing * d[j]
    rows.At[REGULUS_K, row], rows.At[P, row] = (
        passing * dotted(d, line.k),
        passing * dotted(d, line.p),
    )
    rows.At[X + line.pair, row] = force * dotted(d, line.x)
    rows.At[Z + line.pair, row] = force * dotted(d, line.z)
