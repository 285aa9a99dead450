"""Finds the smallest forces that balance at the corners of four faces.

Solved: forces f at contacts on the corners of faces, all at least some depth inside their friction
cones, that balance, have normal parts that sum to one, and have the least sum of squares:

    minimise |f|  subject to  G f = 0,  sum_k n_k.f_k = 1,     (1)
                              g.f_k >= depth,                  (2)

g over the inward facet normals of a pyramid inscribed in each cone. As |f| is strictly convex, the
answer is unique: it turns with the object and rounding does not move it, unlike the point at which
an interior-point solver stops. With f = f_0 + Z z, f_0 the smallest solution of (1) and the columns
of Z an orthonormal basis of its null space, |f|^2 = |f_0|^2 + |z|^2 leaves a least-distance program
in z.
"""

import math
from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrenches import grasp_map
from grasp_core.cones.pyramids import pyramid_facets
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.nearest_point import least_distance

SIDES = 8
"""Number of facets of the pyramids inscribed in friction cones."""
DEPENDENT = 1e-6
"""Size of a singular value, relative to the largest, below which it counts as zero."""


def smallest_forces(
    pieces: Sequence[FacePiece], points: Array, normals: Array, friction: float, depth: float
) -> Array | None:
    """Find the smallest balanced forces at points of pieces, (k, 3); None if there are none.

    Args:
        pieces: The piece of each point, k of them.
        points: Contact points, (k, 3).
        normals: Inward unit normals, (k, 3).
        friction: Coulomb coefficient at every point.
        depth: Least distance of the forces from the facets of their pyramids.
    """
    # (1): f_0 is the least-squares solution, Z spans what it leaves free
    conditions = np.vstack([grasp_map(points), normals.reshape(1, -1)])
    left, sizes, right = np.linalg.svd(conditions)
    rank = int((sizes > DEPENDENT * sizes[0]).sum())
    Z = right[rank:].T
    f_0 = right[:rank].T @ (left[-1, :rank] / sizes[:rank])
    toward = np.array([piece.frame[:, 0] for piece in pieces])
    facets = pyramid_facets(normals, math.atan(friction), toward, SIDES)
    # (2) in z: -(G_f Z) z <= G_f f_0 - depth
    rows = np.einsum("ksi,kiz->ksz", facets, Z.reshape(len(points), 3, -1)).reshape(-1, Z.shape[1])
    here = np.einsum("ksi,ki->ks", facets, f_0.reshape(-1, 3)).ravel()
    (z,) = least_distance(-rows, (here - depth)[None])
    return None if np.isnan(z).any() else (f_0 + Z @ z).reshape(-1, 3)
