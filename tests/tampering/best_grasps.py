"""Whether a bound on all grasps of an object is true, as far as many contacts can tell."""

import numpy as np

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.quality.measures import resisted_loads
from tests.tampering import wrench_bounds

SETS, MEASURED = 400, 12


def proof(found, rng):
    """No contacts at random places and corners of the polygons exceed the bound.

    They are ordered by an upper bound of their quality, and the first are measured.
    """
    grounds = found.grounds
    polygons = grounds.polygons()
    on = rng.integers(len(polygons), size=(SETS, 4))
    if found.owners is not None:  # each finger on pieces of its own
        own = [np.flatnonzero(np.asarray(found.owners) == finger) for finger in range(4)]
        if not all(map(len, own)):
            return True  # about no contacts
        on = np.stack([rng.choice(each, size=SETS) for each in own], axis=1)
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
    demands = np.array([wrench_bounds.demand(found.measure, each) for each in y])
    supports = (along + found.friction * across).max(axis=1)
    upper = (supports / np.maximum(demands, 1e-9)).min(axis=1)
    for row in np.argsort(-upper)[:MEASURED]:
        if measured(found, x[row], normals[row]).lower > found.bound:
            return False
    return True


def measured(found, x, normals):
    if found.measure.name == "ferrari-canny":
        return gc.ferrari_canny(x, normals, found.friction, torque_scale=1.0, gap=0.05)
    wrenches = WrenchSet.at(x, normals, np.full(len(x), found.friction))
    return resisted_loads(wrenches, found.measure, 0.05)


def best(found, rng):
    usual = found.proof.measure.name == "ferrari-canny"
    true = wrench_bounds.quality if usual else wrench_bounds.resisted
    return proof(found.proof, rng) and true(found.quality, rng)


def ceiling(found, rng):
    return found.proof.owners is not None and proof(found.proof, rng)
