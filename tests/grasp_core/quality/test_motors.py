"""Wrench limits under motors with limited torque, beside hand-worked cases and programs."""

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.execution.jointed import hand_of
from tests.judges import random_contacts
from tests.tampering.table import Limited
from tests.tampering.wrench_bounds import wrench_limit

CASES = 24


def test_a_joint_of_a_decimetre_pushes_as_its_torque_says():
    """Two fingers at +-x with one joint each, 0.1 m from the contact: 0.2 N m push with 2 N.

    Across the line the contacts hold twice mu times that. A link that takes 0.05 N m of the right
    joint leaves 1.5 N there, and as both pushes are equal, on the left too.
    """
    positions = np.array([[-1.0, 0, 0], [1, 0, 0]])
    levers = np.array([[0.1, 0, 0, 0, 0, 0], [0, 0, 0, -0.1, 0, 0]])
    for gravity, push in ((0.0, 2.0), ([0.0, 0.05], 1.5)):
        motors = gc.Motors.of(levers, 0.2, gravity)
        across, along = gc.wrench_limits(
            positions, -positions, 0.3, [[0, 0, 1.0, 0, 0, 0], [1, 0, 0, 0, 0, 0]],
            max_normal_force=5.0, motors=motors,
        )  # fmt: skip
        assert across.limit == pytest.approx(2 * 0.3 * push, rel=1e-6)
        assert along.limit == pytest.approx(push, rel=1e-6)
        assert motors.torques(across.forces).max() == pytest.approx(0.2, rel=1e-6)


def test_limits_are_proved_and_those_of_the_definition():
    rng = np.random.default_rng(0)
    limited = 0
    for _ in range(CASES):
        positions, normals = random_contacts(rng)
        if not gc.force_closure(positions, normals, 0.6).closed:
            continue
        motors, wrench = hand_of(rng, 4, 1.0, joints=4, lever_m=1.0), rng.normal(size=6)
        given = {"max_normal_force": 3.0, "motors": motors}
        (found,) = gc.wrench_limits(positions, normals, 0.6, wrench[None], **given)
        (free,) = gc.wrench_limits(positions, normals, 0.6, wrench[None], max_normal_force=3.0)
        known = Limited(found, positions, normals, 0.6, 3.0, np.zeros(3), motors)
        assert known.verify()
        assert wrench_limit(known)
        assert found.upper <= found.limit * (1.0 + 1e-6)
        limited += found.limit < 0.9 * free.limit
    assert limited >= 8


def test_motors_in_any_orientation_give_up_what_their_links_ask_in_the_worst():
    """One joint carries up to 0.05 of its 0.3 N m, the other sqrt(3) / 4 of its newton metre."""
    weights = np.array([[0.0, -0.03, 0.04], [0.25, 0.25, 0.25]])
    motors = gc.Motors.in_any_orientation(np.eye(2, 6), [0.3, 1.0], weights)
    assert motors.limits == pytest.approx([0.25, 1.0 - np.sqrt(3.0) / 4.0])
    assert not motors.gravity.any()
    assert gc.Motors.in_any_orientation(np.eye(2, 6), 0.3, 0.0 * weights) == gc.Motors.of(
        np.eye(2, 6), 0.3
    )


def test_forces_within_lowered_limits_are_within_all_torques_in_every_orientation():
    rng = np.random.default_rng(6)
    hand, weights = hand_of(rng, 4, 1.0, joints=4, lever_m=1.0), 0.1 * rng.normal(size=(16, 3))
    motors = gc.Motors.in_any_orientation(hand.levers, 1.0, weights)
    ways = rng.normal(size=(2000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    reached = 0.0
    for forces in rng.normal(size=(50, 4, 3)):
        allowed = forces / (np.abs(motors.torques(forces)) / motors.limits).max()
        torques = motors.torques(allowed) + ways @ weights.T
        assert np.abs(torques).max() <= 1.0 + 1e-12
        reached = max(reached, np.abs(torques).max())
    assert reached >= 0.999
