"""Best grasps, and what any contacts on their faces answer and resist, by the definitions."""

import itertools
from functools import cache

import numpy as np

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.quality.measures import resisted_loads
from scenes.example_objects import example_object

FRICTION = 0.5
LIFT = np.array(
    [[0.0, 0.0, -3.0, 0.0, 0.0, 0.0], [1.0, 0.0, -3.0, 0.0, 0.02, 0.0],
     [0.0, 0.0, 0.0, 0.0, 0.0, 0.1]]
)  # fmt: skip
"""A task: an object of three newtons that is lifted, lifted and pushed, and unscrewed."""


@cache
def best(name, measure, gap, **settings):
    wrenches = LIFT if measure == "task" else None
    return gc.best_grasp(
        example_object(name), FRICTION, gap=gap, measure=measure, wrenches=wrenches, **settings
    )


def grid_of_contacts(found):
    """Pieces (n,) and plane coordinates (n, 2) of a grid of points on all faces."""
    rows, points = [], []
    for p, polygon in enumerate(found.proof.grounds.polygons()):
        for weights in itertools.product(range(4), repeat=len(polygon)):
            if sum(weights) == 3:
                rows.append(p)
                points.append(np.array(weights) / 3.0 @ polygon)
    return np.array(rows), np.array(points)


def some_twists(found, rng, count):
    """Random unit twists, and as many of the proof."""
    y = rng.normal(size=(count, 6))
    return np.vstack([y / np.linalg.norm(y, axis=1)[:, None], found.proof.twists[:count]])


def supports(found, on, at, twists):
    """The support of each contact in each twist by the definition, (count, 4, n)."""
    grounds = found.proof.grounds
    x = grounds.origins[on] + np.einsum("...ij,...j->...i", grounds.frames[on], at)
    u = twists[:, :3] + np.cross(twists[:, 3:], x[..., None, :])
    along = np.einsum("...nj,...j->...n", u, grounds.normals[on])
    across = np.sqrt(np.maximum((u * u).sum(axis=-1) - along**2, 0.0))
    return along + found.proof.friction * across


def demands(found, twists, radius):
    """How much of the loads twists ask for, by the definition, (n,)."""
    if found.measure == "task":
        loads = LIFT / np.repeat([1.0, radius], 3)
        return np.array([max(0.0, *(-load @ y for load in loads)) for y in twists])
    return np.linalg.norm(twists[:, : 3 if found.measure == "weight" else 6], axis=1)


def upper_bounds(answers, asked):
    """What twists allow of the largest of the contacts' supports, (..., n) each."""
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = np.where(asked > 0.0, answers / asked, np.inf)
    return np.where(answers < 0.0, -1.0, allowed).min(axis=-1)


def measured(found, on, at):
    """The measure of contacts on pieces (4,) at plane coordinates (4, 2), with a rough gap."""
    grounds = found.proof.grounds
    x = np.array([grounds.places(p, y[None])[0] for p, y in zip(on, at, strict=True)])
    wrenches = WrenchSet.at(x, grounds.normals[on], np.full(4, FRICTION))
    if found.measure == "ferrari-canny":
        return wrench_set_quality(wrenches, 0.02)
    return resisted_loads(wrenches, found.proof.measure, 0.02)
