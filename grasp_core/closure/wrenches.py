"""Builds matrices from contact forces to wrenches, and the frames of contacts.

A wrench is (force, torque), (6,), with the torque about a stated centre. A contact force is what
the finger applies to the object, in the object's frame.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.frames import plane_tangents

WRENCH = 6
"""Number of components of a wrench."""


def grasp_map(positions: Array, center: Array | None = None) -> Array:
    """Build the matrix that maps stacked contact forces (3k,) to their wrench, (..., 6, 3k).

    Takes `positions` (..., k, 3) [m]; `center` (3,) [m].
    """
    arms = positions if center is None else positions - center
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    G = np.zeros((*arms.shape[:-2], WRENCH, arms.shape[-2], 3))
    G[..., 0, :, 0] = G[..., 1, :, 1] = G[..., 2, :, 2] = 1.0
    G[..., 3, :, 1], G[..., 3, :, 2] = -z, y
    G[..., 4, :, 0], G[..., 4, :, 2] = z, -x
    G[..., 5, :, 0], G[..., 5, :, 1] = -y, x
    return G.reshape(*arms.shape[:-2], WRENCH, 3 * arms.shape[-2])


def in_frames(G: Array, frames: Array) -> Array:
    """Rewrite a matrix on stacked forces (m, 3k) for coordinates in contact frames (k, 3, 3)."""
    m, k = len(G), len(frames)
    return np.einsum("mki,kij->mkj", G.reshape(m, k, 3), frames).reshape(m, 3 * k)


def cross_matrix(vector: Array) -> Array:
    """Build the matrix C of a cross product: C @ b is vector x b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def contact_frames(normals: Array) -> Array:
    """Build orthonormal contact frames, columns (normal, tangent, tangent), (..., 3, 3)."""
    rows = normals.reshape(-1, 3).tolist()
    columns = [((x, y, z), *plane_tangents(x, y, z)) for x, y, z in rows]
    return np.array(columns).reshape(*normals.shape, 3).swapaxes(-1, -2)


def normal_and_tangential(forces: Array, normals: Array) -> tuple[Array, Array]:
    """Split forces (..., k, 3) into normal components and tangential lengths."""
    along = np.einsum("...i,...i->...", forces, normals)
    across = forces - along[..., None] * normals
    return along, np.sqrt(np.einsum("...i,...i->...", across, across))
