import dataclasses

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution.carried_mass import GAP
from tests.grasp_core.execution.held import (
    bodies_and_grasps,
    box,
    opposed,
)
from tests.grasp_core.execution.jointed import hand_of, pushing
from tests.tampering import hand_payloads
from tests.tampering.changes import forged

G = 9.80665


@pytest.mark.parametrize("torque", [None, 0.15])
def test_payloads_are_proved_and_true_by_definition(torque):
    """By the springs' own equations, and programs for many orientations."""
    rng = np.random.default_rng(0)
    for body, grasp in bodies_and_grasps():
        motors = torque and hand_of(rng, 4, torque, 0.0)
        given = {"max_push_n": 10.0, "tip_radius_m": 0.0}
        found = gc.payload(body, grasp, 0.5, motors=motors, **given)
        assert found.verify()
        assert hand_payloads.payload_of_contacts(found)
        assert found.mass_kg <= found.free.upper  # as tips of no radius do not roll
        assert found.free.upper <= found.free.lower * (1.0 + GAP) * (1.0 + 1e-6)
        if motors:
            free = gc.payload(body, grasp, 0.5, **given)
            assert found.free.upper < 0.9 * free.free.lower
            assert found.mass_kg <= free.mass_kg * (1.0 + 3e-4)


@pytest.mark.parametrize("mu", [0.1, 0.4, 0.9])
def test_four_opposed_fingers_hold_what_the_closed_forms_say(mu):
    """A force F along the pushes leaves one side N - F / 2 in a finger, and both sides must take
    equal shares across: 4 mu (N - F / 2) in all, a line at 4 mu N / sqrt(1 + 4 mu^2) from zero.
    """
    found = gc.payload(box(), opposed(), mu, max_push_n=10.0, tip_radius_m=0.0)
    across = 2 * 2 * mu * 10.0 / G
    free = across / np.sqrt(1.0 + 4.0 * mu**2)
    assert found.free.lower <= free * (1.0 + 1e-6)
    assert found.free.upper >= free * (1.0 - 1e-6)
    assert found.free.upper == pytest.approx(free, rel=2e-3)
    assert found.mass_kg == pytest.approx(across / (np.sqrt(1.0 + mu**2) + mu), rel=1e-4)
    assert found.verify()


def test_payloads_of_other_motors_are_no_certificate():
    motors = pushing(opposed(), 0.25)
    found = gc.payload(box(), opposed(), 0.4, max_push_n=10.0, motors=motors)
    plain = gc.payload(box(), opposed(), 0.4, max_push_n=10.0)
    assert found.verify()
    for share in (0.999, 1.001):
        other = gc.Motors.of(motors.levers, share * motors.limits)
        changed = gc.payload(box(), opposed(), 0.4, max_push_n=10.0, motors=other)
        assert not dataclasses.replace(found, fixed=changed.fixed).verify()
        assert not dataclasses.replace(found, free=changed.free).verify()
    assert not dataclasses.replace(found, free=plain.free).verify()
    carrying = dataclasses.replace(found.fixed, motors=pushing(opposed(), 0.26, 0.01))
    assert not dataclasses.replace(found, fixed=carrying).verify()


def test_contacts_that_hold_nothing_have_no_payload():
    found = gc.payload(box(), opposed(), 0.0, max_push_n=10.0)
    assert found.mass_kg == found.free.lower == 0.0
    assert found.free.upper < 1e-6
    assert found.verify()


def test_false_claims_are_no_certificate():
    found = gc.payload(box(), opposed(), 0.4, max_push_n=10.0)
    free = found.free
    false = [
        {"lower": free.lower * 1.001}, {"upper": free.lower * 0.999},
        {"upper": free.upper * (1.0 - 1e-6)}, {"triangles": free.triangles[1:]},
        {"triangles": free.triangles[:, [0, 0, 2]]}, {"forces": 0.9 * free.forces},
        {"gravities": free.gravities[1:]}, {"facet": np.zeros(6)}, {"facet": -free.facet},
        {"triangles": None}, {"forces": None}, {"lower": np.nan}, {"upper": "a"}, {"hand": None},
    ]  # fmt: skip
    for change in false:
        changed = forged(found, free=forged(free, **change))
        assert changed.verify() is False, change
    assert forged(found, free=None).verify() is False
    assert forged(found, fixed=None).verify() is False
    heavier = gc.best_squeeze(box(), opposed(), 0.4, gc.any_direction(2.0), max_push_n=10.0)
    assert forged(found, fixed=heavier).verify() is False
