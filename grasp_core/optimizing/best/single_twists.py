"""Bounds what contacts resist by one twist alone: where searches for cuts begin.

The support of a cone is convex in the contact's position, so that no contact on a polygon answers a
twist with more than the largest support at its corners; the largest of all polygons, over the
twist's demand, is what no four contacts exceed.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.optimizing.best.grounds import SEARCH_DIGITS
from grasp_core.optimizing.best.searching.parts import Steps
from grasp_core.optimizing.best.searching.search import CUTS, TWISTS, Searching
from grasp_core.optimizing.best.support_cuts import Slack
from grasp_core.solvers.ties import few_digits, first_best, on_grid

COUNT = 384
"""Random twists to begin with, as many as a wave hands on; a quarter of them is moved to where the
support of all polygons is smaller."""
FIRST_STEPS = 60
"""Steps of these descents: they settle within it."""
ROUNDED_UP = 1e-6
"""Share by which a threshold is rounded up at least, and less than three times as much."""


def lowered_twists(searching: Searching, rng: np.random.Generator) -> Array:
    """Return twists in which all polygons together resist little, and let the search know them.

    Gives unit twists, (n, 6).
    """
    grounds, loads = searching.grounds, searching.measure.loads
    points = [grounds.places(p, at) for p, at in enumerate(grounds.polygons())]
    on = np.repeat(np.arange(len(points)), [len(each) for each in points])
    corners, pieces = on_grid(np.vstack(points), SEARCH_DIGITS), searching.pieces
    found = rng.normal(size=(COUNT, 6))
    # a task's loads themselves, the other way, ask for most
    found = np.vstack([-loads, found])
    found = on_grid(found / np.linalg.norm(found, axis=1, keepdims=True))
    low = len(loads) + COUNT // 4
    lowered = found[:low].copy()
    for y in lowered:
        compiled(TWISTS).descend(
            pieces, searching.demand, corners, on, len(on), y, FIRST_STEPS, 0.0
        )
    found = np.vstack([lowered, found[low:]])
    searching.learn(found)
    return np.array(searching.pool.twists[: len(found)])


def refuted_by_one(
    searching: Searching, cases: int, slack: Slack, twists: Array
) -> tuple[Steps, float]:
    """Return the tree that asks a single twist, and the least threshold that it refutes.

    Takes `twists` (n, 6).
    """
    support, slopes = compiled(CUTS).support, compiled(CUTS).slopes
    pieces, at = searching.pieces, np.empty(6)
    reached = np.full(len(twists), -math.inf)
    polygons = [on_grid(polygon, SEARCH_DIGITS) for polygon in searching.grounds.polygons()]
    for k, y in enumerate(twists):
        for p, polygon in enumerate(polygons):
            slopes(pieces, p, y, at)
            highest = max(support(at, a, b, searching.friction) for a, b in polygon)
            reached[k] = max(reached[k], highest)
    demands = searching.measure.demands(twists)
    if searching.measure.is_usual:
        thresholds = reached + slack.raised
    else:
        with np.errstate(divide="ignore"):  # a twist without demand refutes nothing
            resisted = (np.maximum(reached, 0.0) + slack.lowered) / demands
        thresholds = np.where(demands > 0.0, resisted, np.inf)
    best = first_best(-thresholds)
    threshold = float(thresholds[best])
    if threshold > 0.0:
        threshold = few_digits((1.0 + 2.0 * ROUNDED_UP) * threshold, ROUNDED_UP)
    steps = Steps(
        np.zeros(cases, np.int64), np.zeros(cases, np.int64), twists[best : best + 1],
        np.empty((0, 3)),
    )  # fmt: skip
    return steps, threshold
