"""Bounds discs from above by the corners of the faces alone, which costs almost no time.

Reach. With positive weights w of sum w_i a_i = 0 for the axes, and contacts c_i on the faces,
sum w_i a_i.(x0 - c_i) = -sum w_i a_i.c_i wherever the focus x0 is. So the weighted mean of the
distances along the axes is, over the corners of each face, at most

    -sum w_i min a_i.c_i for a focus before the fingers, sum w_i max a_i.c_i for one behind.  (1)

Width. If two axes lead from one focus back to their contacts, c_i = x - s_i a_i and
c_j = x - s_j a_j, then d = (a_i - a_j) / (1 - a_i.a_j) has d.a_i = 1 and d.a_j = -1, and so

    s_i + s_j = d.(c_j - c_i),                                                                (2)

which the corners of the two faces bound. See (5) of `concurrent_kernel` and
`pencil_radius_bounds` for what reach and width mean for discs.

Across. Let N be the unit vector across both axes of one pair of a pencil. It is across the line of
the foci too, so both foci c have the same height h = N.c, and so have the disc centres q_i and q_j
of that pair. As a disc of radius r reaches r |T'N| to either side, the heights of the corners, from
lo_i to hi_i, leave r |T_i'N| <= hi_i - h and r |T_j'N| <= h - lo_j, or

    r (|T_i'N| + |T_j'N|) <= hi_i - lo_j.                                                     (3)

A finger m of the other pair is at N.q_m = h - s_m N.a_m with s_m >= r / tan(psi / 2). In place of j
it makes the left side of (3) larger by

    r |N.a_m| / tan(psi / 2).                                                                 (4)

(3) and (4) spare programs that would find discs below the least radius, or below those already
found.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.families.placements import PAIRINGS, FaceCorners
from grasp_core.families.placing import PLACING_KERNEL
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS, FaceQuadruple

LEAST_SINE = 1e-6
"""Half angles between axes with a sine up to this are so small that they bound no width."""


def corners_of(body: Polyhedron) -> FaceCorners:
    """Return the corners of each face, padded, about the centre of mass and over the radius."""
    corners = [
        (np.vstack([face.polygon, *face.holes]) - body.center_of_mass) / body.radius
        for face in body.faces
    ]
    counts = np.array([len(each) for each in corners])
    most = int(counts.max(initial=0))
    padded = [np.vstack([each, np.repeat(each[:1], most - len(each), axis=0)]) for each in corners]
    return FaceCorners(np.array(padded), counts)


def disc_limits(
    corners: FaceCorners, normals: Array, faces: Indices, axes: Array, half_angles: Array
) -> Array:
    """Bound discs of quadruples from above, (q, 4): a concurrent grasp, then each of `PAIRINGS`."""
    limits = np.empty((len(faces), 1 + len(PAIRINGS)))
    given = map(np.ascontiguousarray, (normals, faces, axes, half_angles))
    compiled(PLACING_KERNEL).fill_limits(corners, *given, limits)
    return limits


def angle_limits(extent: float, widths: Array, half_angles: Array) -> Array:
    """Bound the discs from above where only the cones' half-angles are known, (q, 4)."""
    reaches = np.full(len(half_angles), extent)
    # (5) of `concurrent_kernel`: the least s_i is at most the weighted mean of all s_i
    concurrent: Array = reaches * np.tan(half_angles)
    pencil = pencil_radius_bounds(reaches, widths, half_angles)
    return np.hstack([concurrent[:, None], pencil])


def pencil_radius_bounds(
    reaches: Array, widths: Array, half_angles: Array, orders: Sequence[FaceQuadruple] = PAIRINGS
) -> Array:
    """Bound the disc radii of pencil grasps from above, for several finger orders.

    With kappa >= cos(psi), (2) and (3) of `pencil_kernel` leave r <= s tan(psi / 2) for each
    finger, and so for the mean of any fingers. Two fingers of a pair share a focus, hence the mean
    of their s is at most half of the bound on s_i + s_j.

    With positive weights of sum lam a = 0, (1) gives sum lam_ij s_ij = -sum lam_ij a_ij.q_ij - (c_2
    - c_1).w. In cell A the last term only lowers it. In cell B it is 2 k |w|, at most half of the
    left side, which can therefore double.
    """
    depths = [
        np.minimum(2.0 * reaches, 0.5 * np.minimum(widths[..., i, j], widths[..., k, m]))
        for i, j, k, m in orders
    ]
    return np.stack(depths, axis=-1) * np.tan(half_angles / 2.0)[..., None]


def distances(corners: FaceCorners) -> Array:
    """Bound the distance between points of two faces from above, (f, f)."""
    middles = corners.points.mean(axis=1)
    radii = np.linalg.norm(corners.points - middles[:, None], axis=-1).max(axis=1)
    between = np.linalg.norm(middles[:, None] - middles, axis=-1)
    # between the middles, and from each middle to the farthest corner
    return between + radii[:, None] + radii


def widths_apart(faces: Indices, apart: Array, halves: Array, leaning: Array) -> Array:
    """Bound the sum of two contacts' distances from a common focus, (q, 4, 4).

    These are the s_i + s_j of (2), for axes that lean from the normals by up to `leaning`. The
    vector d of (2) has the length 2 / |a_i - a_j|, and the angle between the axes differs from the
    angle between the normals, twice `halves` (f, f) [rad], by at most the sum of both leans.
    """
    widths = np.full((len(faces), FINGERS, FINGERS), np.inf)
    for i, j in combinations(range(FINGERS), 2):
        pair = faces[:, i], faces[:, j]
        # |a_i - a_j| is twice the sine of half the angle between them
        sines = np.sin(np.maximum(halves[pair] - leaning, 0.0))
        bound = np.where(sines > LEAST_SINE, apart[pair] / np.maximum(sines, LEAST_SINE), np.inf)
        widths[:, i, j] = widths[:, j, i] = bound
    return widths
