import dataclasses

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution.carried_mass import MASS_GAP
from tests.grasp_core.execution.held import (
    bodies_and_grasps,
    box,
    opposed,
)
from tests.grasp_core.execution.jointed import hand_of, pushing
from tests.tampering import hand_payloads
from tests.tampering.changes import forged


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
        assert found.free.upper <= found.free.lower * (1.0 + MASS_GAP) * (1.0 + 1e-6)
        if motors:
            free = gc.payload(body, grasp, 0.5, **given)
            assert found.free.upper < 0.9 * free.free.lower
            assert found.mass_kg <= free.mass_kg * (1.0 + 3e-4)


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


def test_false_claims_are_no_certificate():
    """Claims about the free mass are tried with that of a hand."""
    found = gc.payload(box(), opposed(), 0.4, max_push_n=10.0)
    free = found.free
    for change in (
        {"lower": free.lower * 1.001}, {"upper": free.lower * 0.999}, {"facet": np.zeros(6)},
        {"hand": None},
    ):  # fmt: skip
        assert forged(found, free=forged(free, **change)).verify() is False, change
    assert forged(found, free=None).verify() is False
    assert forged(found, fixed=None).verify() is False
    heavier = gc.best_squeeze(box(), opposed(), 0.4, gc.any_direction(2.0), max_push_n=10.0)
    assert forged(found, fixed=heavier).verify() is False
