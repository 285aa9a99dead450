"""Pyramids inside and around the cones of contacts with torsion."""

import itertools

import numpy as np

OPPOSITE = np.array([[-0.05, 0, 0], [0.05, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])


def ball_edges(sides):
    """Unit vectors whose hull is inside the unit ball and holds the ball of `inradius`."""
    angles, tilts = 2.0 * np.pi / sides, np.pi / (sides // 2)
    ring = [
        [np.sin(tilt) * np.cos(a), np.sin(tilt) * np.sin(a), np.cos(tilt)]
        for tilt, a in itertools.product(
            tilts * (np.arange(sides // 2) + 0.5), angles * np.arange(sides)
        )
    ]
    return np.array([*ring, [0, 0, 1.0], [0, 0, -1.0]])


def inradius(sides):
    """No direction is farther from an edge than half a step around and half a step of tilt; so the
    hull of the edges has a support of at least the cosine of that in every direction."""
    return np.cos(np.pi / sides + np.pi / (sides // 2))


def wrenches_of(x, n, mu, mu_t, edges):
    """Wrenches about the origin of unit pushes, with friction and torsion along the edges."""
    rows = []
    for point, normal, friction, torsion in zip(x, n, mu, mu_t, strict=True):
        tangents = np.linalg.svd(normal[None])[2][1:]
        f = normal + friction * edges[:, :2] @ tangents
        rows.append(np.hstack([f, np.cross(point, f) + np.outer(torsion * edges[:, 2], normal)]))
    return np.vstack(rows)
