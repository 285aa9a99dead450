"""Contacts on bodies, moved about at random."""

import numpy as np

from tests.judges import TETRAHEDRON, random_rotation

OPPOSITE = np.array([[-0.05, 0, 0], [0.05, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
"""Two contacts that push towards each other."""


def box_faces(low, high):
    """Faces of a box as (corner, edge, edge), with edge x edge into the body."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    x, y, z = np.diag(high - low)
    pairs = ((x, y), (y, z), (z, x))
    return [(low, one, two) for one, two in pairs] + [(high, -two, -one) for one, two in pairs]


def bracket_faces():
    """An L of two arms one thick and one wide, along x to 3 and along z to 2, with a reflex edge.

    Each of its two ends, themselves an L, is two rectangles.
    """
    x, y, z = np.eye(3)
    return [
        ((0, 0, 0), 3 * x, y), ((3, 0, 0), z, y), ((3, 0, 1), -2 * x, y),
        ((1, 0, 1), z, y), ((1, 0, 2), -x, y), ((0, 0, 2), -2 * z, y),
        ((0, 0, 0), z, 3 * x), ((0, 0, 1), z, x), ((0, 1, 0), 3 * x, z), ((0, 1, 1), x, z),
    ]  # fmt: skip


def tetrahedron_faces():
    """Of each triangle a corner and two edges."""
    for vertex in range(4):
        a, b, c = np.delete(TETRAHEDRON, vertex, axis=0)
        inward = np.cross(b - a, c - a) @ TETRAHEDRON[vertex] > 0.0
        yield (a, b - a, c - a) if inward else (a, c - a, b - a)


def on_faces(faces, *, triangles=False):
    """Sampler of contacts on flat faces: half of the time on as many different ones as it can."""
    corner, one, two = (np.array(part, dtype=float) for part in zip(*faces, strict=True))
    into = np.cross(one, two)
    areas = np.linalg.norm(into, axis=1)

    def contacts(rng, count):
        drawn = rng.choice(len(areas), count, p=areas / areas.sum())
        apart = rng.permutation(np.resize(rng.permutation(len(areas)), count))
        chosen = apart if rng.uniform() < 0.5 else drawn
        share = rng.uniform(size=(2, count, 1))
        if triangles:
            share = np.where(share.sum(axis=0) > 1.0, 1.0 - share, share)
        points = corner[chosen] + share[0] * one[chosen] + share[1] * two[chosen]
        return points, (into / areas[:, None])[chosen]

    return contacts


def on_a_sphere(rng, count):
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points, -points


BODIES = {
    "box": on_faces(box_faces((-1.0, -0.7, -0.5), (1.0, 0.7, 0.5))),
    "tetrahedron": on_faces(tetrahedron_faces(), triangles=True),
    "sphere": on_a_sphere,
    "bracket": on_faces(bracket_faces()),
}
"""Samplers of contacts."""


def moved(rng, positions, normals, size):
    turn = random_rotation(rng)
    turned = normals @ turn.T
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return size * (positions @ turn.T + rng.normal(size=3)), turned


def from_edges(polygon, normal, point):
    """How far a point is inside of each edge's line; edges go round the normal."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    heights = np.einsum("kj,kj->k", np.cross(normal, edges), point - polygon)
    return heights / np.linalg.norm(edges, axis=1)
