import dataclasses

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution.carried_mass import GAP
from tests.grasp_core.execution.held import (
    bodies_and_grasps,
    box,
    directions,
    opposed,
    orientations,
)
from tests.grasp_core.execution.jointed import hand_of, pushing
from tests.tampering.changes import forged

G = 9.80665


def payloads():
    for body, grasp in bodies_and_grasps():
        for stiffness in (500.0, 3000.0):
            yield body, grasp, gc.payload(body, grasp, 0.5, max_push_n=10.0, stiffness=stiffness)


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


def test_the_free_mass_is_that_of_many_orientations():
    """No orientation holds less than the lower bound, and a hundred more do not either."""
    rng = np.random.default_rng(0)
    for body, grasp, found in payloads():
        weights = np.zeros((162, 6))
        weights[:, :3] = G * np.vstack([orientations(), directions(100, rng)])
        limits = gc.wrench_limits(
            grasp, None, 0.5, weights, max_normal_force=10.0, center=body.center_of_mass
        )
        least = min(limit.limit for limit in limits)
        assert found.free.lower <= least * (1.0 + 1e-6)
        assert least <= 1.2 * found.free.upper
        assert found.free.upper <= found.free.lower * (1.0 + GAP) * (1.0 + 1e-6)


def test_the_fixed_mass_is_held_in_every_orientation_and_is_no_larger_than_the_free_one():
    for _, _, found in payloads():
        assert found.verify()
        assert found.fixed.scale <= found.free.upper
        slips = [
            gc.first_slip(
                found.fixed.grip, np.append(G * d, np.zeros(3)), model="linear", max_push_n=10.001
            ).multiple
            for d in orientations()
        ]
        assert found.mass_kg <= min(slips)
        assert min(slips) <= 1.3 * found.mass_kg


def test_masses_with_motors_are_proved_and_those_of_many_orientations():
    """The fixed mass is no larger than the free one, as tips of no radius do not roll."""
    rng, hands, lowered = np.random.default_rng(0), np.random.default_rng(0), 0
    for body, grasp in bodies_and_grasps():
        motors = hand_of(hands, 4, 0.15, 0.0)
        held = {"max_push_n": 10.0, "tip_radius_m": 0.0}
        found = gc.payload(body, grasp, 0.5, motors=motors, **held)
        assert found.verify()
        assert found.mass_kg <= found.free.upper
        weights = np.zeros((82, 6))
        weights[:, :3] = G * np.vstack([orientations(), directions(20, rng)])
        given = {"max_normal_force": 10.0, "center": body.center_of_mass, "motors": motors}
        limits = gc.wrench_limits(grasp, None, 0.5, weights, **given)
        least = min(limit.limit for limit in limits)
        assert found.free.lower <= least * (1.0 + 1e-6)
        assert found.free.upper <= found.free.lower * (1.0 + GAP) * (1.0 + 1e-6)
        slips = [
            gc.first_slip(
                found.fixed.grip, weight, model="linear", max_push_n=10.001, motors=motors
            ).multiple
            for weight in weights
        ]
        assert found.mass_kg <= min(slips)
        free = gc.payload(body, grasp, 0.5, **held)
        assert found.free.upper <= free.free.upper * (1.0 + GAP)
        assert found.mass_kg <= free.mass_kg * (1.0 + 3e-4)
        lowered += found.free.upper < 0.9 * free.free.lower
    assert lowered == 6


def test_motors_in_any_orientation_carry_object_and_links_in_every_one():
    """Both masses are held with the links' own torque in each orientation. What is held there is at
    most (c + w) / (c - w) times as much (see `Motors.in_any_orientation`).
    """
    rng = np.random.default_rng(3)
    for body, grasp in bodies_and_grasps(limit=1):
        hand = hand_of(rng, 4, 0.15, 0.0)
        weights = 0.1 * hand.limits[:, None] * rng.normal(size=(len(hand.limits), 3))
        motors = gc.Motors.in_any_orientation(hand.levers, hand.limits, weights)
        taken = np.linalg.norm(weights, axis=1)
        found = gc.payload(body, grasp, 0.5, max_push_n=10.0, motors=motors)
        given = {"max_normal_force": 10.0, "center": body.center_of_mass}
        most = float(((hand.limits + taken) / motors.limits).max())
        for way in orientations():
            turned = gc.Motors(hand.levers, hand.limits, weights @ way)
            load = np.append(G * way, np.zeros(3))
            held, sure = (
                gc.wrench_limits(grasp, None, 0.5, [load], motors=each, **given)[0].limit
                for each in (turned, motors)
            )
            assert found.free.lower <= held * (1.0 + 1e-6)
            assert sure <= held * (1.0 + 1e-6)
            assert held <= most * sure * (1.0 + 1e-6)
            slip = gc.first_slip(found.fixed.grip, load, model="linear", motors=turned)
            assert slip.multiple >= found.mass_kg


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


def test_a_payload_with_motors_without_joints_changes_no_bit():
    plain = gc.payload(box(), opposed(), 0.4, max_push_n=10.0)
    nothing = gc.Motors.of(np.zeros((0, 12)), 1.0)
    without = gc.payload(box(), opposed(), 0.4, max_push_n=10.0, motors=nothing)
    assert without.free == plain.free
    assert dataclasses.replace(without.fixed, motors=None) == plain.fixed


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
