"""Moves contacts on four convex faces uphill towards larger resisted multiples of a task's loads.

Solved, locally: maximise over positions x_i on the faces the least of the largest multiples m_j of
loads w_j that contact forces with normal parts of sum one resist.

Derivation. The program for m_j has forces F_i and a twist (v, omega) as its answer, which asks for
one of w_j, see `measures`. When contacts move by d_i and take the forces along, the wrench
changes by (0, sum_i d_i x F_i), and the optimum by its product with the twist,

    m_j changes by  sum_i d_i . (F_i x omega).                                              (1)

Steps are those of `ascent`: linear programs with (1) in a trust region.

The weight is a task with forces in all directions. Contacts climb for some of them, again and again
with those directions as well that they held least.
"""

from collections.abc import Iterator

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frames
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.optimizing.ascent import (
    FIRST_REACH,
    GOOD,
    GROWTH,
    LEAST_REACH,
    MOST_STEPS,
    POOR,
    SEARCH_GAP,
    SHRINKAGE,
    ContactFaces,
)
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.quality.measures import (
    CLOSED_GAP,
    THIN,
    Measure,
    ResistedLoads,
    resisted_loads,
    task_limits,
)
from grasp_core.solvers.ties import smallest_first, surpassing

SMALL_GAIN = 1e-4
"""Predicted relative gain below which a climb ends: the smallest gap that may be asked for, as each
step takes a program for every load."""
SPREAD, ROUNDS = 48, 4
"""Directions of the weight for which contacts climb first, and how often they climb. Every
direction is within 23 degrees of one of these, so that it is held at most 8 % less than they are;
the directions that are added make up for that."""
WEAK, APART, MOST_WEAK = 1.05, 0.97, 16
"""Directions that are added are held up to this much better than the weakest: others are not the
least after a small step. Cosines between them are below this: 14 degrees, half of what is between
the first ones. They are so many at most, as each is a program more in every step."""


def climbs_for_weight(faces: ContactFaces, y: Array) -> Iterator[Array]:
    """Yield where contacts in force closure come to by climbing for the weight, (k, 2) each.

    Takes `y` (k, 2).
    """
    forces = _spread()
    for _ in range(ROUNDS):
        loads = np.hstack([forces, np.zeros_like(forces)])
        y = climbed_for_task(faces, Measure("task", loads), y)
        yield y
        found = resisted_loads(_wrenches(faces, y), Measure("weight"), SEARCH_GAP)
        forces = np.vstack([forces, _weakest(found)])


def _spread() -> Array:
    """Return directions along a spiral from pole to pole, all about as far apart, (n, 3)."""
    place = np.arange(SPREAD) + 0.5
    z, turn = 1.0 - 2.0 * place / SPREAD, np.pi * (1.0 + np.sqrt(5.0)) * place
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


def _weakest(found: ResistedLoads) -> Array:
    """Return directions of the weight that contacts hold least, far from each other, (n, 3)."""
    if found.ball is None or found.ball.polytope is None:
        return np.zeros((0, 3))
    twists = found.ball.polytope.normals / np.repeat([1.0, THIN], 3)
    supports, demands = found.wrenches.supports(twists), found.measure.demands(twists)
    held = found.measure.multiples(supports, demands)
    near = np.array(smallest_first(held))
    near = near[held[near] <= WEAK * float(held.min())]
    ways = -twists[near, :3] / demands[near, None]
    kept: list[Array] = []
    while len(ways) and len(kept) < MOST_WEAK:
        kept.append(ways[0])
        ways = ways[ways @ ways[0] < APART]
    return np.array(kept)


def climbed_for_task(faces: ContactFaces, measure: Measure, y: Array) -> Array:
    """Move contacts in force closure uphill to a local optimum, and return where they are.

    Takes `y` (k, 2).
    """
    reach, found = FIRST_REACH, _planes(faces, measure, y)
    for _ in range(MOST_STEPS):
        if found is None or reach < LEAST_REACH:
            break
        lower = float(found[0].min())
        step, predicted = faces.step(y, lower, found, reach)
        if predicted <= SMALL_GAIN * lower:
            break
        trial = _planes(faces, measure, y + step)
        there = 0.0 if trial is None else float(trial[0].min())
        if there > surpassing(lower):
            y, found = y + step, trial
        gained = (there - lower) / predicted
        reach *= GROWTH if gained > GOOD else SHRINKAGE if gained < POOR else 1.0
    return y


def _wrenches(faces: ContactFaces, y: Array) -> WrenchSet:
    friction = np.full(len(y), faces.friction)
    return WrenchSet.at(faces.positions(y), faces.normals, friction).on_grid()


def _planes(faces: ContactFaces, measure: Measure, y: Array) -> tuple[Array, Array] | None:
    """Return the multiple of each load, (m,), and its slopes (1), (m, 2k); None without closure."""
    wrenches = _wrenches(faces, y)
    if wrench_set_quality(wrenches, CLOSED_GAP).lower <= 0.0:
        return None
    limits = task_limits(wrenches, measure)
    local = np.array([limit.forces for limit in limits]).reshape(len(limits), -1, 3)
    forces = np.einsum("kij,nkj->nki", contact_frames(faces.normals), local)
    turned = np.cross(forces, np.array([limit.twist for limit in limits])[:, None, 3:])
    planes = np.array([piece.frame for piece in faces.pieces])
    slopes = np.einsum("nki,kij->nkj", turned, planes).reshape(len(limits), -1)
    return np.array([limit.multiple for limit in limits]), slopes
