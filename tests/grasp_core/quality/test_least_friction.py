"""Forces that need the least friction, beside bisection on exact cones."""

import numpy as np
import pytest

from grasp_core.closure.contacts import normal_and_tangential
from grasp_core.quality.contact_forces import contact_forces, least_friction_forces
from grasp_core.quality.wrench_limits import WrenchBody, limit_of
from tests.grasp_core.quality.loads import LIMITS, SLACK, balanced_wrenches
from tests.judges import random_contacts


def least_share(arms, normals, friction, wrench):
    """Bounds on the share of the frictions at which the wrench is just resisted, by bisection."""
    lower, upper = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (lower + upper)
        limit = limit_of(WrenchBody(arms, normals, middle * friction, LIMITS[1]), wrench)
        lower, upper = (lower, middle) if limit.limit >= 1.0 else (middle, upper)
    return np.array([lower, upper])


def test_least_friction_uses_the_least_share_of_frictions_that_differ():
    """The least share, by bisection on exact cones; the forces then need no more of any contact."""
    rng = np.random.default_rng(7)
    for trial in range(6):
        positions, normals = random_contacts(rng, 4 + trial % 3)
        friction = rng.uniform(0.2, 1.0, len(positions))
        friction[0] *= trial % 2
        load = balanced_wrenches(rng, positions, normals, friction, (0.0, 10.0), 1)[0]
        lower, upper = least_share(positions, normals, friction, load)
        forces = contact_forces(
            positions, normals, friction, load, objective="least_friction", normal_force=(0.0, 10.0)
        )
        along, across = normal_and_tangential(forces, normals)
        pressed = across > SLACK
        share = (across[pressed] / (friction * along)[pressed]).max(initial=0.0)
        assert lower * (1 - 1e-3) <= share <= upper * (1 + 5e-3) + 1e-5


def test_the_least_friction_is_said_where_forces_balance():
    rng = np.random.default_rng(9)
    options = {"normal_force": LIMITS, "center": np.zeros(3)}
    for _ in range(4):
        positions, normals = random_contacts(rng)
        load = balanced_wrenches(rng, positions, normals, np.full(4, 0.8), LIMITS, 1)[0]
        forces, needed = least_friction_forces(positions, normals, 0.8, load, **options)
        along, across = normal_and_tangential(forces, normals)
        assert needed == pytest.approx((across / along).max(), rel=1e-9)
        assert needed <= 0.8 + SLACK
