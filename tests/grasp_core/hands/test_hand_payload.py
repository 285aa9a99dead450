"""The mass that a hand holds in every orientation, against its motors in each of many."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.execution.carried_mass import MASS_GAP
from tests.grasp_core.execution.held import directions
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled

G = 9.80665
PROGRAM = 1e-6
"""Accuracy of limits and bounds, relative to them: ten times that of conic programs."""
PUSH_N = 100.0
CASE = ("leap", "dodecahedron", 0.035)


def leap(torque=0.35):
    return gc.load_hand("leap").with_torque_limits(torque, "a test")


def stances():
    found = [each for each in reaches(*CASE) if each.reached]
    assert len(found) >= 3
    return scaled(*CASE[1:]), found


def carried(hand, body, reach, **more):
    return gc.hand_payload(hand, body, reach, FRICTION, max_push_n=PUSH_N, **more)


def held(hand, body, reach, way):
    """The largest mass where gravity points along a unit vector and pulls at the links."""
    return gc.wrench_limits(
        reach.contacts, None, FRICTION, [np.append(G * way, np.zeros(3))], max_normal_force=PUSH_N,
        center=body.center_of_mass, motors=gc.hand_motors(hand, reach, down=way),
    )[0].limit  # fmt: skip


def test_the_mass_is_the_least_of_all_orientations_and_found_within_the_gap():
    body, (reach, *_) = stances()
    rng, hand = np.random.default_rng(0), leap()
    mass = carried(hand, body, reach)
    assert mass.verify()
    assert mass.upper <= mass.lower * (1.0 + MASS_GAP) * (1.0 + PROGRAM)
    least = min(held(hand, body, reach, way) for way in directions(12, rng))
    assert least >= mass.lower * (1.0 - PROGRAM)
    weakest = held(hand, body, reach, mass.weakest)
    assert mass.lower * (1.0 - PROGRAM) <= weakest <= mass.upper * (1.0 + PROGRAM)


def test_a_mass_under_lowered_limits_is_no_larger():
    body, (reach, *_) = stances()
    every = gc.hand_motors(leap(), reach, any_orientation=True)
    lowered = gc.payload(body, reach.contacts, FRICTION, max_push_n=PUSH_N, motors=every).free
    assert lowered.lower <= carried(leap(), body, reach).upper * (1.0 + PROGRAM)


def test_hands_that_are_too_weak_are_refused():
    body, (reach, *_) = stances()
    with pytest.raises(InputError, match=r"cannot carry its own links there; give larger limits"):
        carried(leap(1e-3), body, reach)
