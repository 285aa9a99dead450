"""Contacts on four bodies, decided as independent judges decide them."""

import math
from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.bodies import BODIES, holds, moved
from tests.judges import pyramids_say

SETS = 50
"""Number of contact sets on each body."""
SIDES = 64
"""Pyramids inside and around the cones then differ by 0.12 % in friction."""
NEAR = 0.02
"""Margins this close to zero count as near the boundary of closure."""
BOUNDARY = 1e-6
"""Frictions within this share of the critical one may be left undecided, and are not compared."""
OUT_OF_REACH = 20.0
"""More friction than any set is given: where the threshold lies beyond does not matter."""
COUNTS, SHARES = (2, 3, 4, 5, 6, 7), (0.05, 0.1, 0.6, 0.1, 0.08, 0.07)
"""How many contacts, and how often."""


def contact_set(rng, body):
    """Contacts as they lie on the body or, every other time, turned, scaled and moved."""
    positions, normals = BODIES[body](rng, int(rng.choice(COUNTS, p=SHARES)))
    if rng.uniform() < 0.5:
        return positions, normals
    return moved(rng, positions, normals, size=10.0 ** rng.uniform(-3, 3))


def threshold(positions, normals):
    """Critical friction; None where it is not found, after a check that it is out of reach."""
    try:
        return gc.critical_friction(positions, normals)
    except (gc.SolverError, gc.UndecidedError):
        assert not gc.force_closure(positions, normals, OUT_OF_REACH).closed
        return None


def some_friction(rng, critical, count):
    """Any common friction, one within a fifth of the threshold, or a different one each."""
    common = math.exp(rng.uniform(math.log(0.01), math.log(3.0)))
    if critical is not None and 0.01 < critical < 5.0 and rng.uniform() < 0.5:
        common = critical * rng.uniform(0.8, 1.25)
    if rng.uniform() < 0.8:
        return common
    each = common * rng.uniform(0.5, 2.0, count)
    return np.where(rng.uniform(size=count) < 0.1, 0.0, each)


def on_the_boundary(positions, normals, friction):
    """Whether a millionth more friction closes the contacts and a millionth less opens them."""
    above, below = ((1.0 + step) * np.asarray(friction) for step in (BOUNDARY, -BOUNDARY))
    more, less = (gc.force_closure(positions, normals, mu) for mu in (above, below))
    return more.closed and not less.closed


def compare(seen, friction, critical, closed):
    """Count a verdict that agrees with the critical friction, if the two can be compared."""
    if critical is None:
        seen["without a threshold"] += 1
        assert np.max(friction) < OUT_OF_REACH
        assert not closed
    elif np.ndim(friction):
        seen["of several frictions"] += 1
        assert closed or friction.min() <= critical
        assert not closed or friction.max() > critical
    elif math.isclose(friction, critical, rel_tol=BOUNDARY):
        seen["on the threshold"] += 1
    else:
        seen["compared with the threshold"] += 1
        assert closed == (friction > critical)


def decide_many(body):
    """Decide random contact sets of a body, check each verdict in four ways, count what is seen."""
    rng, seen = np.random.default_rng(1), Counter()
    for _ in range(SETS):
        positions, normals = contact_set(rng, body)
        critical = threshold(positions, normals)
        friction = some_friction(rng, critical, len(positions))
        try:
            certificate = gc.force_closure(positions, normals, friction)
        except gc.UndecidedError:
            seen["undecided"] += 1
            assert on_the_boundary(positions, normals, friction)
            continue
        closed = certificate.closed
        assert certificate.verify()
        assert holds(certificate)
        assert not (closed and len(positions) == 2), "two contacts are on a line"
        said = pyramids_say(positions, normals, friction, SIDES)
        assert said in {None, closed}
        compare(seen, friction, critical, closed)
        seen["closed" if closed else "open"] += 1
        seen["judged by pyramids"] += said is not None
        if 0.0 < abs(certificate.margin) <= NEAR:
            seen["barely closed" if closed else "barely open"] += 1
    return seen


AT_LEAST = {
    "closed": 0.25,
    "open": 0.25,
    "barely closed": 0.05,
    "barely open": 0.05,
    "judged by pyramids": 0.9,
    "compared with the threshold": 0.7,
    "of several frictions": 0.1,
}
"""Shares of the contact sets of each body."""
AT_MOST = {"undecided": 0.001, "on the threshold": 0.001, "without a threshold": 0.002}


@pytest.mark.parametrize("body", BODIES)
def test_contact_sets_are_decided_as_the_judges_decide_them(body):
    seen = decide_many(body)
    assert seen["closed"] + seen["open"] + seen["undecided"] == SETS
    for what, share in AT_LEAST.items():
        assert seen[what] >= share * SETS, what
    for what, share in AT_MOST.items():
        assert seen[what] <= share * SETS, what
