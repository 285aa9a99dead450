"""Contacts on bodies, moved about at random."""

import numpy as np

from scenes.example_objects import example_object
from tests.judges import random_rotation

OPPOSITE = np.array([[-0.05, 0, 0], [0.05, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
"""Two contacts that push towards each other."""


def on_faces(name):
    """Sampler of contacts on flat faces: half of the time on as many different ones as it can."""
    body = example_object(name)
    pieces = [
        ((piece - body.center_of_mass) / body.radius, face.normal, face.area / len(face.pieces))
        for face in body.faces for piece in face.pieces
    ]  # fmt: skip
    areas = np.array([area for *_, area in pieces])

    def contacts(rng, count):
        drawn = rng.choice(len(pieces), count, p=areas / areas.sum())
        apart = rng.permutation(np.resize(rng.permutation(len(pieces)), count))
        chosen = [pieces[place] for place in (apart if rng.uniform() < 0.5 else drawn)]
        points = [rng.dirichlet(np.ones(len(polygon))) @ polygon for polygon, *_ in chosen]
        return np.array(points), np.array([normal for _, normal, _ in chosen])

    return contacts


def on_a_sphere(rng, count):
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points, -points


BODIES = {name: on_faces(name) for name in ("box", "tetrahedron", "l-bracket")}
BODIES |= {"sphere": on_a_sphere}
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
