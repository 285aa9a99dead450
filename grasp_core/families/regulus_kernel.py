"""Searches in compiled code for the best slopes of a regulus, by the programs of `regulus`.

A program, over (x0, k, p, x_1, x_2, z_1, z_2, t), is first solved without its gap: if p stays
beyond the gap anyway, that side was the better one. As the cones span (P3), x_i is on the side of
its pair's resultant; there the rows that keep the forces of a pair in their pyramids are bounds on
z_i / x_i, of which the tightest imply the others. `regulus` builds the best program whole and
solves it again. Numbers in comments are those of `regulus`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.families.discs_kernel import edges_of, facet_sines, measure, room_for, vertex_of
from grasp_core.families.placements import Attempts, FaceTable
from grasp_core.families.regulus import (
    LEAST_DEPTH,
    LEAST_GAP,
    LEAST_INSET,
    SAME_OFFSET,
    SLOPES,
    VARIABLES,
    K,
    P,
    T,
)
from grasp_core.geometry.vectors_kernel import across, angle_between, cross, dotted, focus_direction
from grasp_core.solvers.lp_kernel import (
    INFEASIBLE,
    LOST,
    Rows,
    Vertex,
    proved_bound,
    proved_empty,
    solve,
)
from grasp_core.values import FINGERS

FLAT = 1e-12
"""Size of a facet's component along N below which the facet does not bound z / x: it allows every
value or none."""
X, Z = 5, 7
"""Indices of the first x_i and z_i among the variables."""
ACCURACY, FARTHEST = 1e-11, 1e4
"""Error up to which multipliers give the objective, and the size |x|_1 of the variables up to which
a proof of infeasibility must hold."""
NONE, PLUS, MINUS = -1, 0, 1
"""Codes of the side: no slopes are feasible, p > 0, p < 0."""


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
def pair_frames(faces: FaceTable, attempts: Attempts, a: int, turns: Array) -> PairFrames:
    """Compute the frames of one attempt; slopes of too asymmetric pairs are not usable."""
    axes, slopes = attempts.axes[a], len(SLOPES)
    u, normal = focus_direction(axes), np.empty(3)
    frames = PairFrames(
        u, np.empty((2, 3)), np.empty((2, 3)), np.empty((2, slopes)),
        np.empty((2, slopes, 2, 2)), np.zeros((2, slopes), dtype=np.bool_),
    )  # fmt: skip
    for pair in range(2):
        resultant = 1.0 if pair == 0 else -1.0
        first, second = axes[2 * pair], axes[2 * pair + 1]
        cross(first, second, normal)
        cross(normal, u, frames.v[pair])
        scale = np.sign(dotted(frames.v[pair], first)) / np.sqrt(dotted(normal, normal))
        for j in range(3):
            frames.N[pair, j] = scale * normal[j]
            frames.v[pair, j] *= scale
        # the interval (3) of `regulus`
        least, largest = -np.pi, np.pi / 2.0
        for axis in (first, second):
            phi = angle_between(axis, resultant * u)
            least = max(least, phi - attempts.half_angles[a])
            largest = min(largest, phi + attempts.half_angles[a])
        if largest <= least:
            continue
        facets = _facets(faces, attempts, (a, pair), frames, turns)
        for s in range(slopes):
            angle = least + SLOPES[s] * (largest - least)
            frames.tau[pair, s] = resultant * np.tan(angle)
            frames.usable[pair, s] = _tightest(
                facets, resultant, frames.tau[pair, s], frames.tight[pair, s]
            )
    return frames


@loop()
def _facets(
    faces: FaceTable, attempts: Attempts, place: tuple[int, int], frames: PairFrames, turns: Array
) -> Array:
    """Compute normals of the facets of a pair's pyramids along u, v, N, (2, facets, 3)."""
    a, pair = place
    found = np.empty((2, len(turns), 3))
    sine, cosine = facet_sines(attempts.half_angles[a], len(turns))
    for each in range(2):
        axis = attempts.axes[a, 2 * pair + each]
        first, second = across(axis, faces.frames[attempts.faces[a, 2 * pair + each]])
        for along, direction in enumerate((frames.u, frames.v[pair], frames.N[pair])):
            middle = dotted(axis, direction)
            lean, lean_too = dotted(first, direction), dotted(second, direction)
            for m in range(len(turns)):
                lies = turns[m, 0] * lean + turns[m, 1] * lean_too
                found[each, m, along] = sine * middle - cosine * lies
    return found


@loop()
def _tightest(facets: Array, resultant: float, tau: float, tight: Array) -> bool:
    """Find the rows alpha x + beta z >= 0 that bound z / |x|, for x on the resultant's side."""
    lower, upper = -np.inf, np.inf
    tight[:] = 0.0
    for each, side in ((0, 1.0), (1, -1.0)):
        for m in range(facets.shape[1]):
            # g.f of a force x (u +- tau v) +- z N
            alpha = facets[each, m, 0] + side * tau * facets[each, m, 1]
            beta = side * facets[each, m, 2]
            if abs(beta) <= FLAT:
                if resultant * alpha < -FLAT:
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
def regulus_bounds(
    faces: FaceTable,
    attempts: Attempts,
    turns: Array,
    enough: float,
    bounds: Array,
    chosen: Indices,
) -> None:
    """Bound the merit, minus the largest offset t, over slopes until one is above `enough`."""
    others = 1 + FINGERS * (4 + 1 + 1) + 4  # gap; offsets, depth, equality; bounds on z / x
    room = np.empty((VARIABLES + 2) * (others + FINGERS * faces.E.shape[1]))
    slopes, vertex = len(SLOPES), vertex_of(VARIABLES)
    for a in range(len(bounds)):
        frames = pair_frames(faces, attempts, a, turns)
        count = others + edges_of(faces, attempts, a)
        bounds[a], chosen[a] = -np.inf, NONE
        for i in range(slopes):
            for j in range(slopes):
                if not (frames.usable[0, i] and frames.usable[1, j]) or bounds[a] > enough:
                    continue
                rows = room_for(room, VARIABLES, count)
                rows = Rows(rows.At, rows.b, rows.norms, FINGERS)
                _fill(faces, attempts.faces[a], frames, (i, j), rows)
                gap = LEAST_GAP / min(abs(frames.tau[0, i]), abs(frames.tau[1, j]))
                worth = bounds[a] + SAME_OFFSET
                best, side = _best_side(rows, gap, worth, vertex)
                if best > worth:
                    bounds[a] = best
                    chosen[a, 0], chosen[a, 1], chosen[a, 2] = i, j, side


@loop()
def _best_side(rows: Rows, gap: float, worth: float, vertex: Vertex) -> tuple[float, int]:
    """Solve the programs for p > gap and p < -gap; return the better bound and its side."""
    either = _bounded(rows, worth, vertex)
    p = vertex.x[P]  # anything where `either` is infinite: the sides decide then, or nothing does
    if either <= worth or p >= gap:
        return either, PLUS
    rows.At[P, 0], rows.b[0] = -1.0, -gap
    plus = _bounded(rows, worth, vertex)
    if plus >= either - SAME_OFFSET:
        return plus, PLUS
    if p <= -gap:
        return either, MINUS
    worth = max(worth, plus + SAME_OFFSET)
    rows.At[P, 0] = 1.0
    minus = _bounded(rows, worth, vertex)
    return (minus, MINUS) if minus > worth else (plus, PLUS)


@loop()
def _bounded(rows: Rows, worth: float, vertex: Vertex) -> float:
    """Bound a program from above: minus infinity if infeasible, infinity if undecided."""
    c = np.zeros(VARIABLES)
    c[T] = -1.0
    measure(rows)
    status, against = solve(c, rows, worth, vertex)
    if status == INFEASIBLE:
        return -np.inf if proved_empty(rows, vertex, against, FARTHEST) else np.inf
    return np.inf if status == LOST else proved_bound(c, rows, vertex, ACCURACY)


@loop()
def _fill(
    faces: FaceTable,
    quadruple: Indices,
    frames: PairFrames,
    slopes: tuple[int, int],
    rows: Rows,
) -> None:
    """Fill in all rows but the first, which is left for the gap (8); equalities come last."""
    row, equality = 1, len(rows.b) - FINGERS
    rows.b[0] = 0.0
    for finger in range(FINGERS):
        face, line = quadruple[finger], _line(frames, slopes, finger)
        row = _edge_rows(faces, face, line, rows, row)
        row = _offset_rows(faces, face, line, rows, row)
        n = faces.normals[face]
        # (7): the passing point is high enough over the face
        _add(line, n, (0.0, -1.0), rows, row)
        rows.b[row] = -LEAST_DEPTH
        # the contact lies in the plane of its face
        _add(line, n, (1.0, -1.0), rows, equality + finger)
        rows.b[equality + finger] = dotted(n, faces.origins[face])
        row += 1
    for pair in range(2):
        for bound in range(2):
            # (6), as bounds on z / x
            tight = frames.tight[pair, slopes[pair], bound]
            rows.At[X + pair, row], rows.At[Z + pair, row] = -tight[0], -tight[1]
            rows.b[row] = 0.0
            row += 1


@loop()
def _edge_rows(faces: FaceTable, face: int, line: _Line, rows: Rows, row: int) -> int:
    """Fill in the rows (4), which keep the contact D - F of a line inside its face."""
    edge, frame = np.empty(3), faces.frames[face]
    for e in range(faces.edges[face]):
        for j in range(3):
            edge[j] = frame[j, 0] * faces.E[face, e, 0] + frame[j, 1] * faces.E[face, e, 1]
        _add(line, edge, (1.0, -1.0), rows, row)
        rows.b[row] = faces.b[face, e] - LEAST_INSET + dotted(edge, faces.origins[face])
        row += 1
    return row


@loop()
def _offset_rows(faces: FaceTable, face: int, line: _Line, rows: Rows, row: int) -> int:
    """Fill in the rows (5), which make t the largest offset from the middle of the face."""
    along = np.empty(3)
    for axis in range(2):
        for sign in (1.0, -1.0):
            for j in range(3):
                along[j] = sign * faces.frames[face][j, axis]
            _add(line, along, (1.0, -1.0), rows, row)
            rows.At[T, row], rows.b[row] = -1.0, dotted(along, faces.origins[face])
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
def _add(line: _Line, d: Array, shares: tuple[float, float], rows: Rows, row: int) -> None:
    """Fill in a row that adds shares of d.D and d.F, for `shares` = (passing, force)."""
    passing, force = shares
    for j in range(3):
        rows.At[j, row] = passing * d[j]
    rows.At[K, row], rows.At[P, row] = passing * dotted(d, line.k), passing * dotted(d, line.p)
    rows.At[X + line.pair, row] = force * dotted(d, line.x)
    rows.At[Z + line.pair, row] = force * dotted(d, line.z)
