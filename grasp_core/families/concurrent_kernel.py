"""Places and bounds concurrent grasps for many attempts, with the program of `concurrent`.

Numbers in comments are those of its derivation. Regions are cut as its `cone_footprint` does.
Bounds are those of the program with one common radius, over (x0, y_1 .. y_4, r), for a focus before
and behind all fingers; `discs_kernel` says why one radius is enough. `turns` (m, 2) are the
directions of a pyramid's facets.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.concurrent import RADII, SMALLEST
from grasp_core.families.discs_kernel import (
    Program,
    bounded,
    edges_of,
    facet_sines,
    largest_discs,
    optimum,
    reaches,
    room_for,
)
from grasp_core.families.placements import (
    LEFT,
    NONE,
    PLACED,
    Attempts,
    Corners,
    FaceTable,
    Footprints,
    Placed,
)
from grasp_core.geometry.polygons import ON_LINE
from grasp_core.geometry.vectors_kernel import across, balancing_weights, dotted
from grasp_core.solvers.ties import SAME_SHARE
from grasp_core.values import FINGERS

VARIABLES, FIRST_RADIUS, LEAST = SMALLEST + 1, RADII.start, SMALLEST
FEWEST = 3
"""Fewest corners of a polygon."""
BOUND_VARIABLES = 12
"""Number of variables (x0, y_1 .. y_4, r) of a bound's program."""


@loop("numpy")
def place(
    faces: FaceTable,
    attempts: Attempts,
    turns: Array,
    patterns: Array,
    least: Array,
    placed: Placed,
) -> None:
    """Place a focus and the largest four equal discs for each attempt."""
    x = np.empty(VARIABLES)
    for a in range(len(least)):
        count = FINGERS * (len(turns) + 1) + edges_of(faces, attempts, a)
        worth, placed.ends[a] = least[a], NONE
        for p in range(len(patterns)):
            program = Program(
                np.zeros((count + 2, VARIABLES)), np.zeros(count + 2), FIRST_RADIUS, LEAST
            )
            row = 0
            for finger in range(FINGERS):
                facets, r = (turns, patterns[p, finger]), FIRST_RADIUS + finger
                place = (a, finger, row)
                row = _finger_rows(faces, attempts, place, facets, program.A, program.b, r)
                # r <= r_i: the program maximises the smallest radius
                program.A[row, LEAST], program.A[row, r] = 1.0, -1.0
                row += 1
            end, merit = largest_discs(program, worth, x)
            if end == LEFT:
                placed.ends[a] = LEFT
                break
            if end == PLACED:
                placed.ends[a], placed.merits[a] = PLACED, merit
                worth = merit + SAME_SHARE * abs(merit)
                _take(faces, attempts, a, patterns[p], x, placed)


@loop("numpy")
def _finger_rows(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int, int],
    facets: tuple[Array, float],
    A: Array,
    b: Array,
    r: int,
) -> int:
    """Fill in rows (1) and (2) of one finger, its radius in column r; return the next place."""
    (a, finger, row), (turns, side) = place, facets
    sine, cosine = facet_sines(attempts.half_angles[a], len(turns))
    # (4): the sign of the facets is the side
    sine, cosine = side * sine, side * cosine
    face, y = attempts.faces[a, finger], 3 + 2 * finger
    axis, T, o = attempts.axes[a, finger], faces.frames[face], faces.origins[face]
    first, second = across(axis, T)
    for m in range(len(turns)):
        flat, flat_too, height, lean = 0.0, 0.0, 0.0, 0.0
        for j in range(3):
            g = sine * axis[j] - cosine * (turns[m, 0] * first[j] + turns[m, 1] * second[j])
            A[row, j] = -g
            flat += g * T[j, 0]
            flat_too += g * T[j, 1]
            height += g * o[j]
            lean += g * faces.normals[face, j]
        # r |T'g| of (1), for this disc
        A[row, y], A[row, y + 1] = flat, flat_too
        A[row, r] = np.sqrt(flat * flat + flat_too * flat_too)
        # (3) takes eps |g.n| from the limit
        b[row] = -height - faces.depths[face] * abs(lean)
        row += 1
    # (2): the disc stays inside the face
    for e in range(faces.edges[face]):
        A[row, y], A[row, y + 1] = faces.E[face, e, 0], faces.E[face, e, 1]
        A[row, r], b[row] = 1.0, faces.b[face, e]
        row += 1
    return row


@loop("numpy")
def _take(
    faces: FaceTable, attempts: Attempts, a: int, sides: Array, x: Array, placed: Placed
) -> None:
    ways, weights, pushes = np.empty((FINGERS, 3)), np.empty(FINGERS), 0.0
    for finger in range(FINGERS):
        face, y = attempts.faces[a, finger], 3 + 2 * finger
        placed.radii[a, finger] = x[FIRST_RADIUS + finger]
        for j in range(3):
            T = faces.frames[face, j]
            placed.positions[a, finger, j] = faces.origins[face, j] + T[0] * x[y] + T[1] * x[y + 1]
            ways[finger, j] = sides[finger] * (x[j] - placed.positions[a, finger, j])
    balancing_weights(ways, weights)
    for finger in range(FINGERS):
        face = attempts.faces[a, finger]
        pushes += weights[finger] * dotted(ways[finger], faces.normals[face])
    for finger in range(FINGERS):
        for j in range(3):
            placed.forces[a, finger, j] = weights[finger] * ways[finger, j] / pushes
    for j in range(3):
        placed.foci[a, 0, j] = x[j]


@loop("numpy")
def footprints(
    faces: FaceTable, attempts: Attempts, turns: Array, placed: Placed, cut: Footprints
) -> None:
    """Cut the faces of each placed attempt to where a line in the force cone meets the focus."""
    polygons, counts, radii = cut
    most = polygons.shape[2]
    flat, heights = np.empty((2, most, 2)), np.empty(most)
    for a in range(len(counts)):
        if placed.ends[a] != PLACED:
            continue
        for finger in range(FINGERS):
            count = _cut(faces, attempts, (a, finger), turns, placed, (flat, heights))
            radius = _inscribed_radius(flat[0], count)
            if radius < 0.0:
                continue
            counts[a, finger], radii[a, finger] = count, radius
            face = attempts.faces[a, finger]
            T, o = faces.frames[face], faces.origins[face]
            for k in range(count):
                for j in range(3):
                    polygons[a, finger, k, j] = (
                        o[j] + T[j, 0] * flat[0, k, 0] + T[j, 1] * flat[0, k, 1]
                    )


@loop("numpy")
def _cut(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int],
    turns: Array,
    placed: Placed,
    room: tuple[Array, Array],
) -> int:
    """Fill in the footprint's corners in plane coordinates; return how many there are.

    `room` holds the corners, (2, c, 2), the first of which count, and their heights over a row.
    """
    (a, finger), (flat, heights) = place, room
    face, axis = attempts.faces[a, finger], attempts.axes[a, finger]
    T, o = faces.frames[face], faces.origins[face]
    count, way, corner = int(faces.edges[face]), np.empty(3), np.empty(3)
    for k in range(count):
        for j in range(3):
            corner[j] = faces.corners[face, k, j] - o[j]
        flat[0, k, 0], flat[0, k, 1] = dotted(T[:, 0], corner), dotted(T[:, 1], corner)
    for j in range(3):
        way[j] = placed.foci[a, 0, j] - placed.positions[a, finger, j]
    side = 1.0 if dotted(axis, way) > 0.0 else -1.0
    for j in range(3):
        way[j] = placed.foci[a, 0, j] - o[j]
    sine, cosine = facet_sines(attempts.half_angles[a], len(turns))
    first, second = across(axis, T)
    g = np.empty(3)
    for m in range(len(turns)):
        for j in range(3):
            lean = turns[m, 0] * first[j] + turns[m, 1] * second[j]
            g[j] = side * (sine * axis[j] - cosine * lean)
        # (1) and (3) of `concurrent` with r = 0 and x0 fixed bound the point y alone
        limit = dotted(g, way) - float(faces.depths[face]) * abs(dotted(g, faces.normals[face]))
        count = _clip(flat, heights, count, (dotted(T[:, 0], g), dotted(T[:, 1], g), limit))
    return count


@loop("numpy")
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


@loop("numpy")
def _inscribed_radius(polygon: Array, count: int) -> float:
    """Compute the radius of the largest disc in a convex polygon; negative where it is left."""
    if count < FEWEST:
        return -1.0
    A, b, c, x = np.ones((count, 3)), np.empty(count), np.zeros(3), np.empty(3)
    for k in range(count):
        after = (k + 1) % count
        u, v = polygon[after, 0] - polygon[k, 0], polygon[after, 1] - polygon[k, 1]
        length = np.hypot(u, v)
        if not length > 0.0:
            return -1.0
        A[k, 0], A[k, 1] = v / length, -u / length
        b[k] = A[k, 0] * polygon[k, 0] + A[k, 1] * polygon[k, 1]
    c[2] = 1.0
    end, radius = optimum(c, A, b, -np.inf, x)
    return radius if end == PLACED else -1.0


@loop()
def concurrent_bounds(
    faces: FaceTable, attempts: Attempts, turns: Array, least: float, bounds: Array
) -> None:
    """Bound the discs of concurrent grasps, with the focus before or behind all fingers."""
    corners = Corners(faces.corners, faces.edges)
    room = np.empty((BOUND_VARIABLES + 2) * FINGERS * (len(turns) + faces.E.shape[1]))
    for a in range(len(bounds)):
        rows = room_for(room, BOUND_VARIABLES, FINGERS * len(turns) + edges_of(faces, attempts, a))
        before, behind = reaches(corners, attempts.faces[a], attempts.axes[a])
        bounds[a] = -np.inf
        for side, reach in ((1.0, before), (-1.0, behind)):
            # (5): no program is needed where this limit is small enough
            limit = reach * np.tan(attempts.half_angles[a])
            if limit <= max(least, bounds[a]):
                bounds[a] = max(bounds[a], limit)
                continue
            row = 0
            for finger in range(FINGERS):
                place, r = (a, finger, row), BOUND_VARIABLES - 1
                row = _finger_rows(faces, attempts, place, (turns, side), rows.At.T, rows.b, r)
            bounds[a] = max(bounds[a], bounded(rows, max(least, bounds[a])))
