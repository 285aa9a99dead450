"""Whether a bound on all grasps of an object is true, as far as many contacts can tell."""

import numpy as np

import grasp_core as gc
from tests.tampering import wrench_bounds

SETS, MEASURED = 400, 12


def proof(found, rng):
    """No contacts at random places and corners of the polygons exceed the bound.

    They are ordered by an upper bound of their quality, and the first are measured.
    """
    grounds = found.grounds
    polygons = grounds.polygons()
    on = rng.integers(len(polygons), size=(SETS, 4))
    weights = [[rng.dirichlet(np.full(len(polygons[p]), 0.3)) for p in row] for row in on]
    x = np.array(
        [
            [grounds.places(p, (w @ polygons[p])[None])[0] for p, w in zip(row, each, strict=True)]
            for row, each in zip(on, weights, strict=True)
        ]
    )
    normals = grounds.normals[on]
    y = rng.normal(size=(100, 6))
    y /= np.linalg.norm(y, axis=1)[:, None]
    u = y[:, :3] + np.cross(y[:, 3:], x[:, :, None])
    along = np.einsum("sfnj,sfj->sfn", u, normals)
    across = np.linalg.norm(u - along[..., None] * normals[:, :, None], axis=3)
    upper = (along + found.friction * across).max(axis=1).min(axis=1)
    for row in np.argsort(-upper)[:MEASURED]:
        here = gc.ferrari_canny(x[row], normals[row], found.friction, torque_scale=1.0, gap=0.05)
        if here.lower > found.bound:
            return False
    return True


def best(found, rng):
    return proof(found.proof, rng) and wrench_bounds.quality(found.quality, rng)
