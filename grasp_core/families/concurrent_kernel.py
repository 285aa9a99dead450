"""Constructs concurrent grasps: four lines of force that meet in one focus point.

Solved: for four convex faces and a force cone at each, the focus point x0 and four discs of
the largest common radius r, one inside each face, such that x0 lies in the force cone of
every point of every disc. When the four force cones positively span R^3 whatever direction
each contributes (P3), any four contacts in the discs are then in equilibrium.

Derivation. On face i the points are o_i + T_i y. Let g run over the inward unit normals of
the facets of a pyramid inscribed in force cone i. A contact at y can aim at x0 iff
g.(x0 - o_i - T_i y) >= 0 for all g. Over a disc of radius r around y_i the worst case is
g.(x0 - o_i - T_i y_i) - r |T_i'g|, and the disc lies inside the face iff e.y_i + r <= b for
its edges. All of it is linear in (x0, y_1..y_4, r):

    maximise r  subject to  g.x0 - (T_i'g).y_i - r |T_i'g| >= g.o_i    for all i, g      (1)
                            e.y_i + r <= b                             for all i, edges  (2)

A curved patch has its surface at o_i + T_i y + h n_i, |h| <= eps: the left side of (1) loses

    eps |g.n_i|.                                                                         (3)

The disc centres stay variables: eliminating them by shrinking the face over-estimates r as
soon as an edge of the shrunk face vanishes. In the code each disc has its own radius r_i, and
r is the smallest of them, see `discs_kernel`.

The lines of force have to meet, not the forces: fingers may also push away from a focus behind
them, as from inside a hole. For such a finger side = -1, and the cone has to hold

    side (x0 - o_i - T_i y).                                                             (4)

As P3 makes the weights of the force directions positive, nothing else changes. The focus before
all fingers and behind all of them is tried first; mixed sides follow on faces that would have no
regions. With axis = normal, half-angle = theta and all sides +1 this is section 3.1 of the paper:
(1) for r = 0 and a circular cone says that x0 projects into the face grown by d tan(theta).

Before any program, `disc_bounds` bounds discs by the distance s_i along the axis between the
planes across it through the focus and through the disc's centre. The two points of the disc's
border across the axis see the focus at no less than r, hence

    r <= s_i tan(half_angle).                                                            (5)

The region of a finger is where the inverted cone of section 3.1 meets its face: all y that (1) and
(2) leave with x0 fixed and r = 0.

Source: Sudsang & Ponce 1995, section 3.1 and Proposition 5; the far side is this project's.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.families.discs_kernel import (
    FACET_TURNS,
    Program,
    balance,
    facets,
    fingers_of,
    largest_last,
    room_for_program,
)
from grasp_core.families.placements import Attempts, FaceTable, Fingers, Footprints, Placed
from grasp_core.geometry.polygons import ON_LINE
from grasp_core.geometry.vectors_kernel import dotted
from grasp_core.solvers.lp_kernel import empty_rows
from grasp_core.values import FINGERS

Y, DISC_RADII, CONCURRENT_VARIABLES = 3, 11, 15
"""Indices of the first disc centre and of the first radius among (x0, y_1 .. y_4, r_1 .. r_4), and
the number of these variables."""
TRIANGLE = 3


@loop("numpy", once=True)
def concurrent_program(fingers: Fingers, sides: Array) -> Program:
    """Build the program of one attempt for given sides (4) of its fingers."""
    each, (E, limits) = len(FACET_TURNS), (fingers.E, fingers.b)
    count = FINGERS * each + fingers.edges.sum()
    program, row = room_for_program(count, count, DISC_RADII, CONCURRENT_VARIABLES, 0.0), 0
    A, b = program.A, program.b
    for i in range(FINGERS):
        y, r = Y + 2 * i, DISC_RADII + i
        _aim_rows(fingers, i, sides[i], (y, r), (A[row : row + each], b[row : row + each]))
        row += each
        # (2): the disc stays inside the face
        for e in range(fingers.edges[i]):
            A[row, y], A[row, y + 1], A[row, r] = E[i, e, 0], E[i, e, 1], 1.0
            b[row] = limits[i, e]
            row += 1
    return program


@loop("numpy")
def _aim_rows(
    fingers: Fingers, i: int, side: float, columns: tuple[int, int], rows: tuple[Array, Array]
) -> None:
    """Fill in the rows (1) of one finger, with its disc's centre and radius in given columns."""
    (y, r), (A, b) = columns, rows
    T, o, n = fingers.frames[i], fingers.origins[i], fingers.normals[i]
    G = facets(fingers.axes[i], fingers.half_angle, T)
    for m in range(len(G)):
        # (4): the sign of the facets is the side
        for j in range(3):
            G[m, j] *= side
            A[m, j] = -G[m, j]
        A[m, y], A[m, y + 1] = dotted(T[:, 0], G[m]), dotted(T[:, 1], G[m])
        A[m, r] = np.sqrt(A[m, y] ** 2 + A[m, y + 1] ** 2)
        # (3) takes eps |g.n| from the limit
        b[m] = -dotted(G[m], o) - fingers.depths[i] * abs(dotted(G[m], n))


@loop("numpy", once=True)
def take_concurrent(fingers: Fingers, a: int, sides: Array, x: Array, placed: Placed) -> None:
    """Fill in contacts, forces and the focus from the program's variables."""
    ways = np.empty((FINGERS, 3))
    copy(x[:Y], placed.foci[a, 0])
    for i in range(FINGERS):
        o, y, z = fingers.origins[i], x[Y + 2 * i], x[Y + 2 * i + 1]
        for j in range(3):
            T = fingers.frames[i, j]
            placed.positions[a, i, j] = o[j] + T[0] * y + T[1] * z
            ways[i, j] = sides[i] * (x[j] - placed.positions[a, i, j])
    balance(ways, fingers.normals, placed.forces[a])


@loop("numpy")
def footprints(
    faces: FaceTable, attempts: Attempts, foci: Array, positions: Array, cut: Footprints
) -> None:
    """Cut faces to where a line in the force cone meets the focus, on the side of the contact."""
    polygons, counts, radii = cut
    most = polygons.shape[2]
    flat, heights, way = np.empty((2, most, 2)), np.empty(most), np.empty(3)
    A, b = np.empty((len(FACET_TURNS), 6)), np.empty(len(FACET_TURNS))
    for a in range(len(counts)):
        fingers = fingers_of(faces, attempts, a)
        for finger in range(FINGERS):
            T, o = fingers.frames[finger], fingers.origins[finger]
            for j in range(3):
                way[j] = foci[a, j] - positions[a, finger, j]
            side = 1.0 if dotted(fingers.axes[finger], way) > 0.0 else -1.0
            _aim_rows(fingers, finger, side, (3, 5), (A, b))
            count = int(fingers.edges[finger])
            copy(faces.flat[attempts.faces[a, finger], :count], flat[0, :count])
            for m in range(len(A)):
                row = A[m, 3], A[m, 4], b[m] - dotted(A[m], foci[a])
                count = _clip(flat, heights, count, row)
            counts[a, finger], radii[a, finger] = count, _inscribed_radius(flat[0], count)
            for k in range(count):
                for j in range(3):
                    polygons[a, finger, k, j] = (
                        o[j] + T[j, 0] * flat[0, k, 0] + T[j, 1] * flat[0, k, 1]
                    )


@loop("numpy", once=True)
def _clip(flat: Array, heights: Array, count: int, row: tuple[float, float, float]) -> int:
    """Cut a convex polygon by one row, as `clip` of `geometry.polygons`; return its corners."""
    largest, kept, fresh = 0.0, 0, flat[1]
    for k in range(count):
        largest = max(largest, abs(flat[0, k, 0]), abs(flat[0, k, 1]))
    for k in range(count):
        heights[k] = flat[0, k, 0] * row[0] + flat[0, k, 1] * row[1] - row[2]
        if abs(heights[k]) <= ON_LINE * largest:
            heights[k] = 0.0
    for k in range(count):
        after = (k + 1) % count
        if heights[k] <= 0.0:
            fresh[kept, 0], fresh[kept, 1] = flat[0, k, 0], flat[0, k, 1]
            kept += 1
        if heights[k] * heights[after] < 0.0:
            share = heights[k] / (heights[k] - heights[after])
            fresh[kept, 0] = flat[0, k, 0] + share * (flat[0, after, 0] - flat[0, k, 0])
            fresh[kept, 1] = flat[0, k, 1] + share * (flat[0, after, 1] - flat[0, k, 1])
            kept += 1
    for k in range(kept):
        flat[0, k, 0], flat[0, k, 1] = fresh[k, 0], fresh[k, 1]
    return kept


@loop("numpy", once=True)
def _inscribed_radius(polygon: Array, count: int) -> float:
    """Compute the radius of the largest disc in a convex polygon; not finite where it is left."""
    if count < TRIANGLE:
        return np.inf
    rows = empty_rows(3, count, 0)
    for k in range(count):
        after = (k + 1) % count
        u, v = polygon[after, 0] - polygon[k, 0], polygon[after, 1] - polygon[k, 1]
        length = np.hypot(u, v)
        if not length > 0.0:
            return np.inf
        rows.At[0, k], rows.At[1, k], rows.At[2, k] = v / length, -u / length, 1.0
        rows.b[k] = rows.At[0, k] * polygon[k, 0] + rows.At[1, k] * polygon[k, 1]
    return largest_last(rows, -np.inf)
