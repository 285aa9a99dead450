"""Contact forces to wrenches, as matrices.

A wrench is (force, torque), (6,), with the torque about a stated centre. A contact force is
what the finger applies to the object, in the object's frame.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.polygons import plane_frame


def grasp_map(positions: Array, center: Array | None = None) -> Array:
    """Matrix from stacked contact forces (3k,) to their wrench about `center`, (6, 3k).

    Args:
        positions: Contact points, (k, 3) [m].
        center: (3,) [m]; the origin when None.
    """
    arms = positions if center is None else positions - center
    blocks = [np.vstack([np.eye(3), cross_matrix(arm)]) for arm in arms]
    return np.hstack(blocks)


def local_grasp_map(arms: Array, frames: Array) -> Array:
    """Matrix from local contact forces, (normal, tangent, tangent) each, to wrenches, (6, 3k).

    Args:
        arms: Contact points from the centre of torques, (k, 3).
        frames: As `contact_frames`, (k, 3, 3).
    """
    torques = np.cross(arms[:, None], frames.transpose(0, 2, 1)).reshape(-1, 3)
    forces = frames.transpose(0, 2, 1).reshape(-1, 3)
    return np.vstack([forces.T, torques.T])


def cross_matrix(vector: Array) -> Array:
    """Matrix C of a cross product: C @ b is vector x b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def contact_frames(normals: Array) -> Array:
    """Orthonormal frames with the columns (normal, tangent, tangent), (k, 3, 3)."""
    return np.array([np.column_stack([normal, plane_frame(normal)]) for normal in normals])


def normal_and_tangential(forces: Array, normals: Array) -> tuple[Array, Array]:
    """Normal components (k,) and lengths of the tangential parts (k,) of forces (k, 3)."""
    along = np.einsum("ki,ki->k", forces, normals)
    return along, np.linalg.norm(forces - along[:, None] * normals, axis=1)
