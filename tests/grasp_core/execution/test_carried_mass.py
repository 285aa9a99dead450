"""The mass that a hand holds in every orientation, its links included, against the definition."""

import dataclasses

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution import carried_mass as carried_mass_module
from grasp_core.execution.carried_mass import (
    MASS_GAP,
    CarryingHand,
    HandPayload,
    ball_in,
    carried_mass,
    nearest_facet,
)
from tests.grasp_core.execution.held import bodies_and_grasps, box, directions, opposed
from tests.grasp_core.execution.jointed import LEVER_M, hand_of, jaws, pushing
from tests.tampering import hand_payloads
from tests.tampering.changes import forged

G = 9.80665
PROGRAM = 1e-6
"""Accuracy of limits and bounds, relative to them: ten times that of conic programs."""
TORQUE = 0.25


def carrying(body, contacts, motors, weights, mu=0.5, push=10.0):
    """The contacts with these motors and links."""
    positions = np.array([contact.position for contact in contacts])
    normals = np.array([contact.normal for contact in contacts])
    friction = np.full(len(positions), mu)
    return CarryingHand(
        positions - body.center_of_mass, normals, friction, push, motors, np.array(weights)
    )


def hands(share=0.25):
    """Grasps with hands at random, whose links ask for a share of the torques, the worst joint."""
    rng = np.random.default_rng(3)
    for body, grasp in bodies_and_grasps():
        motors = hand_of(rng, 4, 0.15, 0.0)
        pulls = rng.uniform(0.0, share, size=(len(motors.limits), 1))
        weights = pulls * motors.limits[:, None] * directions(len(motors.limits), rng)
        yield carrying(body, grasp.contacts, motors, weights)


def pushing_hand(weight, mu, push=10.0):
    """Opposed fingers with a joint behind each, whose links hang alike."""
    weights = np.tile([0.0, 0.0, weight], (4, 1))
    return carrying(box(), opposed(), pushing(opposed(), TORQUE), weights, mu, push)


def closed_form(weight, mu):
    """The mass that such a hand holds.

    Under gravity along d each finger pushes with (c - w d_z) / l at most, and takes the part of
    the load along the pushes and across as in the test of `payload`:
    m g |d_yz| + 2 mu m g |d_x| <= 4 mu (c - w d_z) / l. Across, the worst is along z, where
    both sides must take equal shares; over d_x and d_z the left side less the right is largest at
    ((m g + 4 mu w / l)^2 + (2 mu m g)^2)^(1/2) = 4 mu c / l.
    """
    links, most = 4.0 * mu * weight / LEVER_M, 4.0 * mu * TORQUE / LEVER_M
    square = 1.0 + 4.0 * mu**2
    # the root less `links`, without the difference of nearly equal numbers
    root = np.sqrt(links**2 + square * (most**2 - links**2))
    return (most**2 - links**2) / (root + links) / G


@pytest.mark.parametrize("mu", [0.1, 0.4, 0.9])
@pytest.mark.parametrize("weight", [0.0, 0.05, 0.15])
def test_opposed_fingers_whose_links_hang_alike_hold_what_the_closed_form_says(mu, weight):
    found, exact = carried_mass(pushing_hand(weight, mu)), closed_form(weight, mu)
    assert found.lower <= exact * (1.0 + PROGRAM)
    assert found.upper >= exact * (1.0 - PROGRAM)
    assert found.upper <= found.lower * (1.0 + MASS_GAP) * (1.0 + PROGRAM)
    assert found.verify()
    lowered = 4.0 * mu * (TORQUE - weight) / LEVER_M / np.sqrt(1.0 + 4.0 * mu**2) / G
    assert found.upper >= lowered * (1.0 - PROGRAM)


def test_masses_are_proved_and_true_by_definition():
    for hand in hands():
        found = carried_mass(hand)
        assert found.verify()
        assert hand_payloads.payload(found)
        assert hand_payloads.held(hand, found.weakest) <= found.upper * (1.0 + PROGRAM)
        assert 0.0 < found.lower <= found.upper <= found.lower * (1.0 + MASS_GAP) * (1.0 + PROGRAM)


@pytest.mark.parametrize("mu", [0.0, 1e-9])
def test_contacts_that_hold_nothing_carry_no_mass(mu):
    found = carried_mass(pushing_hand(0.1, mu))
    assert found.lower == 0.0
    assert found.upper < 1e-6
    assert len(found.gravities) == len(found.triangles) == 0
    assert found.verify()


def test_links_that_nearly_use_up_the_motors_leave_little_and_it_is_proved():
    """The closed form for w = c (1 - e), whose mass is nearly 2 c e / w times that of no links."""
    for left in (1e-2, 1e-4):
        weight = TORQUE * (1.0 - left)
        found, exact = carried_mass(pushing_hand(weight, 0.4)), closed_form(weight, 0.4)
        assert found.lower <= exact * (1.0 + PROGRAM / left)
        assert found.upper >= exact * (1.0 - PROGRAM / left)
        assert found.upper <= found.lower * (1.0 + MASS_GAP) * (1.0 + PROGRAM)
        assert found.verify()


def test_a_hand_is_checked_without_what_it_has_kept():
    hand = next(iter(hands()))
    found = carried_mass(hand)
    slippery = dataclasses.replace(hand, friction=0.01 * hand.friction)
    vars(slippery)["body"] = hand.body
    assert dataclasses.replace(found, hand=slippery).verify() is False


def test_false_claims_are_no_certificate():
    hand = next(iter(hands()))
    found = carried_mass(hand)
    assert found.verify()
    weaker = gc.Motors.of(hand.motors.levers, 0.99 * hand.motors.limits)
    stronger = gc.Motors.of(hand.motors.levers, 1.01 * hand.motors.limits)
    own = [
        {"lower": found.lower * 1.001}, {"upper": found.upper * (1.0 - 1e-6)},
        {"upper": found.lower * 0.999}, {"triangles": found.triangles[1:]},
        {"triangles": found.triangles[:, [0, 0, 2]]}, {"triangles": None}, {"triangles": ()},
        {"triangles": found.triangles + 1}, {"gravities": 0.99 * found.gravities},
        {"gravities": 1.01 * found.gravities}, {"gravities": found.gravities[1:]},
        {"gravities": None}, {"forces": 1.001 * found.forces}, {"forces": found.forces[::-1]},
        {"forces": None}, {"facet": 0.0 * found.facet}, {"facet": -found.facet}, {"facet": None},
        {"motor_multipliers": 0.0 * found.motor_multipliers}, {"motor_multipliers": None},
        {"lower": np.nan}, {"lower": -1.0}, {"upper": "a"}, {"upper": np.nan}, {"hand": None},
    ]  # fmt: skip
    about = [
        {"motors": weaker}, {"motors": stronger}, {"motors": None}, {"weights": 0.9 * hand.weights},
        {"weights": 1.1 * hand.weights}, {"weights": -hand.weights}, {"weights": None},
        {"weights": 100.0 * hand.weights}, {"friction": 0.99 * hand.friction},
        {"friction": 1.01 * hand.friction}, {"friction": None}, {"arms": 1.01 * hand.arms},
        {"arms": None}, {"normals": -hand.normals}, {"normals": 2.0 * hand.normals},
        {"normals": None}, {"max_push_n": np.nan}, {"max_push_n": None},
        {"motors": gc.Motors.of(hand.motors.levers, hand.motors.limits, 1e-3)},
    ]  # fmt: skip
    for change in own:
        assert forged(found, **change).verify() is False, change
    for change in about:
        other = forged(hand, **change)
        assert forged(found, hand=other).verify() is False, change


def test_a_mass_that_is_none_needs_no_forces_and_a_smaller_claim_is_one_too():
    found = carried_mass(next(iter(hands())))
    nothing = {"gravities": np.zeros((0, 3)), "forces": np.zeros((0, 4, 3)),
               "triangles": np.zeros((0, 3), dtype=int)}  # fmt: skip
    assert dataclasses.replace(found, lower=0.0, **nothing).verify()
    assert not dataclasses.replace(found, **nothing).verify()
    assert dataclasses.replace(found, upper=2.0 * found.upper).verify()
    for forces in (found.forces, 100.0 * found.forces):
        assert not dataclasses.replace(found, lower=0.0, forces=forces).verify()


@pytest.mark.parametrize("push", [1e2, 1e9])
def test_a_hand_that_is_held_back_by_motors_holds_as_much_whatever_its_largest_push(push):
    """The mass meets the closed form above at any push, as slacks follow the real forces."""
    found, exact = carried_mass(pushing_hand(0.05, 0.4, push)), closed_form(0.05, 0.4)
    assert exact * (1.0 - MASS_GAP - PROGRAM) <= found.lower <= exact * (1.0 + PROGRAM)
    assert (
        exact * (1.0 - PROGRAM) <= found.upper <= found.lower * (1.0 + MASS_GAP) * (1.0 + PROGRAM)
    )
    assert found.verify()
    for change in (
        {"upper": found.upper * (1.0 - 1e-6)}, {"forces": (1.0 + 1e-5) * found.forces},
        {"gravities": (1.0 + 1e-5) * found.gravities}, {"lower": (1.0 + 1e-5) * found.lower},
    ):  # fmt: skip
        assert dataclasses.replace(found, **change).verify() is False, change


@pytest.mark.parametrize("push", [10.0, 1e5, 1e9])
def test_no_weight_is_held_by_what_large_forces_may_miss(push):
    """Fingers without friction squeeze, and carry the weight with a millionth of that, across."""
    none = gc.Motors.of(np.zeros((0, 12)), 1.0)
    hand = carrying(box(), opposed(), none, np.zeros((0, 3)), 0.0, push)
    corners = np.sqrt(3.0) * np.vstack([np.eye(3), -np.eye(3)])
    triangles = np.array([[x, y, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)])
    mass = 1e-8 * push / G
    squeeze = 0.5 * push * hand.normals
    carried = np.broadcast_to(-0.25 * G * mass * corners[:, None], (6, 4, 3))
    facet = carried_mass(hand).facet
    claim = HandPayload(mass, push, corners, squeeze + carried, triangles, facet, np.zeros(0), hand)
    assert ball_in(corners, triangles) >= 1.0 - 1e-12
    assert claim.verify() is False


def test_no_finger_pushes_harder_than_counts():
    """Forces at random, as large as the torques in some orientation allow."""
    rng, tested = np.random.default_rng(11), 0
    for hand in hands():
        free = dataclasses.replace(hand, max_push_n=1e6)
        forces = rng.normal(size=(4000, 4, 3))
        forces[:1000] += 3.0 * hand.normals
        normal = np.einsum("nki,ki->nk", forces, hand.normals)
        across = forces - normal[..., None] * hand.normals
        sizes = np.linalg.norm(across, axis=2)
        held = np.minimum(sizes, 0.5 * np.abs(normal)) / sizes
        forces = np.abs(normal)[..., None] * hand.normals + held[..., None] * across
        torques = np.abs(forces.reshape(-1, 12) @ hand.motors.levers.T)
        room = hand.motors.limits + np.linalg.norm(hand.weights, axis=1)
        forces /= (torques / room).max(axis=1)[:, None, None]
        pushes = np.einsum("nki,ki->nk", forces, hand.normals)
        assert pushes.max() <= free.push_n < 1e4
        assert hand.push_n <= hand.max_push_n
        tested += pushes.max() >= 0.05 * free.push_n
    assert tested >= 2


def test_pushes_that_motors_feel_are_bounded_by_them_to_a_factor_of_two():
    """Behind each finger a joint, or one behind each side: pushes of (c + w) / l in all."""
    weights = np.tile([0.0, 0.0, 0.05], (4, 1))
    most = (TORQUE + 0.05) / LEVER_M
    alone = carrying(box(), opposed(), pushing(opposed(), TORQUE), weights, push=1e6)
    sides = carrying(box(), opposed(), jaws(opposed(), TORQUE), weights[:2], push=1e6)
    assert most <= alone.push_n <= 2.0 * most
    assert most <= sides.push_n <= 4.0 * most
    assert dataclasses.replace(alone, max_push_n=0.5).push_n == 0.5


def test_a_search_out_of_rays_ends_after_a_few_steps_with_a_smaller_mass(monkeypatch):
    hand = next(iter(hands()))
    fine = carried_mass(hand)
    monkeypatch.setattr(carried_mass_module, "MOST_RAYS", 6)
    found = carried_mass(hand, 1e-4)
    assert found.verify()
    assert 0.1 * fine.lower < found.lower < 0.99 * fine.lower


def test_a_mass_that_no_forces_hold_in_the_end_is_not_claimed(monkeypatch):
    hand = next(iter(hands()))
    monkeypatch.setattr(CarryingHand, "holds", lambda *_: False)
    found = carried_mass(hand)
    monkeypatch.undo()
    assert (found.lower, len(found.forces)) == (0.0, 0)
    assert found.upper == pytest.approx(carried_mass(hand).upper, rel=PROGRAM)
    assert found.verify()


OCTAHEDRON = np.vstack([np.eye(3), -np.eye(3)])


def test_triangles_that_are_not_closed_around_the_origin_show_no_ball():
    _, distance, good = nearest_facet(OCTAHEDRON)
    assert distance == pytest.approx(3.0**-0.5, rel=1e-12)
    assert ball_in(OCTAHEDRON, good) == pytest.approx(distance, rel=1e-12)
    far = OCTAHEDRON + np.array([2.0, 0.0, 0.0])
    twice = np.vstack([good, good])
    flat = OCTAHEDRON * np.array([1.0, 1.0, 0.0])
    for points, triangles in (
        (OCTAHEDRON, good[1:]), (OCTAHEDRON, twice), (OCTAHEDRON, good + 1),
        (OCTAHEDRON, good - 1), (OCTAHEDRON, good[:0]), (far, good), (flat, good),
        (OCTAHEDRON, np.vstack([good[:1], good[1:, ::-1], good[:1, ::-1]])),
    ):  # fmt: skip
        assert not ball_in(points, triangles) > 0.0


def test_corners_nearly_in_line_show_no_ball():
    """Their normals are rounding, whatever side the origin seems to be on."""
    rng = np.random.default_rng(0)
    four = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    for _ in range(200):
        way = rng.normal(size=3)
        points = rng.uniform(1.0, 3.0, (4, 1)) * way + 1e-16 * rng.normal(size=(4, 3))
        assert not ball_in(points, four) > 0.0
        assert not ball_in(points, four[:, ::-1]) > 0.0
