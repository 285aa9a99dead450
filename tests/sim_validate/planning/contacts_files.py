"""Contacts as files for `analyze` list them, and as its answers do."""

import numpy as np

from tests.judges import TETRA_CENTERS, TETRA_NORMALS

CROSS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
"""Four contacts that push towards the origin along x and y."""


def contacts(positions, normals):
    pairs = zip(np.asarray(positions).tolist(), np.asarray(normals).tolist(), strict=True)
    return [{"position_m": position, "normal": normal} for position, normal in pairs]


TETRAHEDRON = {
    "contacts": contacts(TETRA_CENTERS, TETRA_NORMALS), "friction": 0.5,
    "center_m": [0.0, 0.0, 0.0], "torque_scale_m": 1.0,
}  # fmt: skip


def arms_and_normals(grasp):
    """The contacts of an answer as seen from its center."""
    return np.array(grasp["positions_m"]) - grasp["center_m"], np.array(grasp["normals"])
