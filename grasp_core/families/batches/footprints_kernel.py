"""Cuts faces to the regions of concurrent grasps, as `families.concurrent.cone_footprint` does."""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.attempts_kernel import FINGERS, facet_sines
from grasp_core.families.batches.discs_kernel import optimum
from grasp_core.families.batches.placed import PLACED, Footprints, Placed
from grasp_core.families.kernel_tables import Attempts, FaceTable
from grasp_core.geometry.polygons import ON_LINE
from grasp_core.geometry.vectors_kernel import across, dotted

FEWEST = 3
"""Fewest corners of a polygon."""


@loop("numpy")
def footprints(
    faces: FaceTable,
    attempts: Attempts,
    turns: Array,
    placed: Placed,
    cut: Footprints,
) -> None:
    """Cut the faces of each placed attempt to where a line in the force cone meets the focus.

    Takes `turns` (m, 2).
    """
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
