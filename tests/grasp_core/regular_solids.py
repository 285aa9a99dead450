"""Normals of the regular solids, for answers that are known in closed form."""

import math
from itertools import combinations, product

import numpy as np

from tests.judges import TETRA_NORMALS

TOLERANCE = 1e-7
"""Ten times the residual at which a program's answer is accepted, in object radii; a critical
friction is bracketed ten times as narrowly."""
GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0


def units(vectors):
    vectors = np.asarray(vectors, dtype=float)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def all_signs(count):
    return np.array(list(product((1.0, -1.0), repeat=count)))


def in_three_planes(x, y):
    """(0, +-x, +-y) and its cyclic images: twelve vectors."""
    flat = np.column_stack([np.zeros(4), all_signs(2) * (x, y)])
    return np.vstack([np.roll(flat, turn, axis=1) for turn in range(3)])


SOLIDS = {
    "tetrahedron": TETRA_NORMALS,
    "cube": np.vstack([np.eye(3), -np.eye(3)]),
    "octahedron": units(all_signs(3)),
    "dodecahedron": units(in_three_planes(1.0, GOLDEN)),
    "icosahedron": units(np.vstack([all_signs(3), in_three_planes(1.0 / GOLDEN, GOLDEN)])),
}
"""Normals of the faces of the regular solids; the centres of the faces are opposite to them."""


def quadruples(rows):
    return [rows[list(chosen)] for chosen in combinations(range(len(rows)), 4)]
