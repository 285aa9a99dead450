"""Squeezes and slips under motors of limited torque: cases by hand, and by definition."""

import dataclasses
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import grasp_core as gc
from grasp_core.execution.loads import Reactions
from tests.grasp_core.execution.held import (
    bodies_and_grasps,
    box,
    directions,
    opposed,
    opposed_grip,
    planned,
)
from tests.grasp_core.execution.jointed import LEVER_M, hand_of, lifting, pushing
from tests.tampering import squeezes
from tests.tampering.changes import forged

G = 9.80665
ANY = gc.any_direction(1.0)
LIGHT = gc.LoadSet([0, 0, -0.2, 0, 0, 0], np.diag([0.5, 0.5, 0.5, 0.01, 0.01, 0.01]))
SHAKEN = gc.LoadSet([0, 0, -2.0, 0, 0, 0], np.diag([0.5, 0.5, 0.5, 0.01, 0.01, 0.01]))


def squeezed(motors, friction=0.5, loads=ANY, most=10.0, **more):
    return gc.best_squeeze(
        box(), opposed(), friction, loads, max_push_n=most, motors=motors, **more
    )


def mass_of(push, mu):
    """Mass that four opposed fingers carry with pushes up to a limit (see `test_best_squeeze`)."""
    return 4.0 * mu * push / (G * (np.sqrt(1.0 + mu**2) + mu))


@pytest.mark.parametrize("friction", [0.2, 0.8])
@pytest.mark.parametrize("carried", [0.0, 0.15, -0.15])
def test_a_joint_behind_a_push_limits_it_as_its_torque_says(friction, carried):
    """A torque of 0.3 N m, less what the links take of it, over the lever is the largest push.

    What helps the links does not matter, as no finger pulls.
    """
    found = squeezed(pushing(opposed(), 0.3, carried), friction, tip_radius_m=0.03)
    mass = mass_of((0.3 - carried) / LEVER_M, friction)
    assert mass_of(10.0, friction) > mass
    assert found.scale == pytest.approx(mass, rel=1e-4)
    assert found.scale <= mass * (1.0 + 1e-7) <= found.upper * (1.0 + 1e-6)
    assert found.torque_shares == pytest.approx(1.0, abs=1e-3)
    assert found.verify()


ACROSS = gc.LoadSet(np.zeros(6), np.array([[0, 0, 1.0, 0, 0, 0]]).T)


def test_torques_across_the_pushes_limit_the_load():
    """Each finger takes a quarter: 0.05 N m along z are one newton, four in all.

    The squeeze is no harder than it must be, so that contacts slip there, too. The least push for a
    load is that without motors, as long as these are strong enough.
    """
    found = squeezed(lifting(4, 0.05), loads=ACROSS, most=20.0)
    assert found.scale == pytest.approx(4.0, rel=2e-4)
    assert found.torque_shares == pytest.approx(1.0, abs=2e-4)
    assert found.grip.local_squeeze[:, 0] == pytest.approx(2.0, rel=1e-3)
    assert found.verify()
    least = squeezed(lifting(4, 0.05), loads=ACROSS, most=None)
    free = squeezed(None, loads=ACROSS, most=None)
    assert least.max_push_n == pytest.approx(free.max_push_n, rel=1e-4)
    with pytest.raises(gc.NoForcesError, match="within the torques of the joints survives"):
        squeezed(lifting(4, 0.05 * 0.24), loads=ACROSS, most=None)


def harder():
    """A joint is named first where a squeeze of 5 N lets nothing slip before 10 N."""
    found = squeezed(lifting(4, 0.05), loads=ACROSS, most=20.0)
    grip, scale = opposed_grip(push=5.0), 4.0 * (1.0 - 1e-9)
    proofs = Reactions.of(grip, ACROSS).multipliers(scale)
    return dataclasses.replace(found, grip=grip, scale=scale, proofs=proofs, contact=-1, joint=0)


def test_a_joint_may_be_reached_before_anything_slips():
    found = harder()
    assert found.verify()
    for change in (
        {"joint": -1}, {"joint": 4}, {"contact": 0}, {"joint": -1, "contact": 0},
        {"joint": True}, {"joint": 0.0}, {"scale": found.scale * 0.9999}, {"scale": 4.001},
    ):  # fmt: skip
        assert forged(found, **change).verify() is False, change
    assert forged(found, direction=-found.direction).verify()  # as bad, by symmetry
    slip = gc.first_slip(found.grip, found.load, model="linear", motors=found.motors)
    assert (slip.event, slip.contact, slip.joint) == ("torque limit", -1, 0)
    assert slip.multiple == pytest.approx(1.0, rel=1e-6)


def test_at_rest_joints_are_as_strong_as_under_loads():
    """The offset relieves the fingers at +x by a newton each, whose joints push with 3 N: at rest
    they do, and under the offset they keep 2 N, which hold 4 mu times that across.
    """
    contacts = opposed()
    limits = [1.0 if contact.normal[0] > 0.0 else 3.0 * LEVER_M for contact in contacts]
    loads = gc.LoadSet([-4.0, 0, 0, 0, 0, 0], np.array([[0, 0, 1.0, 0, 0, 0]]).T)
    found = squeezed(pushing(contacts, limits), 0.5, loads, most=10.0)
    assert found.scale == pytest.approx(4 * 0.5 * 2.0, rel=1e-4)
    assert found.verify()
    assert found.torque_shares.max() == pytest.approx(1.0, abs=1e-4)


def hands(loads=(ANY, LIGHT), torques=(0.1, 0.4)):
    """Planned grasps with loads and hands at random."""
    rng = np.random.default_rng(0)
    for body, grasp in bodies_and_grasps():
        for each, torque in product(loads, torques):
            yield body, grasp, each, hand_of(rng, 4, torque, 0.3)


def test_squeezes_are_proved_and_true_by_definition():
    """By the springs' own equations and linear programs. The gap is below 3e-4; motors count."""
    lowered = 0
    for body, grasp, loads, motors in hands():
        found = gc.best_squeeze(body, grasp, 0.5, loads, max_push_n=10.0, motors=motors)
        assert found.verify()
        assert found.scale <= found.upper <= found.scale * (1.0 + 3e-4)
        assert squeezes.squeeze(found)
        free = gc.best_squeeze(body, grasp, 0.5, loads, max_push_n=10.0)
        lowered += found.scale < 0.9 * free.scale
    assert lowered >= 6


def test_motors_without_joints_change_no_bit_and_strong_ones_nothing():
    body, (grasp, *_) = planned("wedge")
    nothing = gc.Motors.of(np.zeros((0, 12)), 1.0)
    for loads in (ANY, SHAKEN):
        for most in (10.0, None):
            plain = gc.best_squeeze(body, grasp, 0.5, loads, max_push_n=most)
            without = gc.best_squeeze(body, grasp, 0.5, loads, max_push_n=most, motors=nothing)
            assert plain.motors is None
            assert dataclasses.replace(without, motors=None) == plain
            for strength in (10.0, 1e8):
                strong = hand_of(np.random.default_rng(0), 4, strength)
                held = gc.best_squeeze(body, grasp, 0.5, loads, max_push_n=most, motors=strong)
                assert held.scale == pytest.approx(plain.scale, rel=2e-4)
                assert held.max_push_n == pytest.approx(plain.max_push_n, rel=2e-4)
                assert held.grip.squeeze == pytest.approx(plain.grip.squeeze, abs=1e-3)
                assert held.verify()


def test_squeezes_without_room_at_rest_are_refused():
    """The offset takes half a newton of each finger along z, the motors have less."""
    with pytest.raises(gc.NoForcesError, match=r"within the torques .* use stronger motors"):
        squeezed(lifting(4, 0.4 * LEVER_M), loads=SHAKEN)


def test_squeezes_of_other_motors_are_no_certificate():
    motors = pushing(opposed(), 0.3)
    found = squeezed(motors)
    weak = gc.Motors(motors.levers, 0.999 * motors.limits, motors.gravity)
    strong = gc.Motors(motors.levers, 1.001 * motors.limits, motors.gravity)
    carrying = gc.Motors.of(motors.levers, 0.3, 0.01)
    for change in (
        {"motors": weak}, {"motors": strong}, {"motors": None}, {"motors": carrying},
        {"motors": gc.Motors.of(np.eye(2, 9), 1.0)}, {"motors": "a"}, {"motors": 0.0},
        {"multipliers": 0.0 * found.multipliers}, {"multipliers": found.multipliers[:-1]},
        {"scale": found.scale * 1.001}, {"upper": found.scale * 0.999},
        {"joint": 0}, {"joint": True}, {"joint": 0.0}, {"joint": -2}, {"contact": -1},
    ):  # fmt: skip
        assert forged(found, **change).verify() is False, change


@pytest.mark.parametrize("model", ["finite", "linear"])
def test_a_joint_reaches_its_torque_at_the_multiple_of_the_closed_form(model):
    """Fingers of 5 N share a load F along x: 5 + F / 4 at one side; 0.3 N m are 6 N, at F = 4. The
    joints at this side are named, and the weight of links moves the multiple.
    """
    grip = opposed_grip(push=5.0)
    along = np.array([-1.0, 0, 0, 0, 0, 0])
    for carried, multiple in ((0.0, 4.0), (0.02, 2.4), (-0.02, 5.6)):
        motors = pushing(opposed(), 0.3, carried)
        found = gc.first_slip(grip, along, model=model, motors=motors)
        assert (found.event, found.contact) == ("torque limit", -1)
        assert opposed()[found.joint].normal[0] == 1.0
        assert found.multiple == pytest.approx(multiple, rel=1e-6)
        assert motors.torques(found.forces).max() == pytest.approx(0.3, rel=1e-6)
    free = gc.first_slip(grip, along, model=model)
    strong = gc.first_slip(grip, along, model=model, motors=pushing(opposed(), 10.0))
    assert strong == free
    assert free.joint == -1


def test_torques_at_the_end_of_a_load_are_within_all_limits():
    """In the finite model the hand's levers turn with the object."""
    rng, ends = np.random.default_rng(2), []
    for body, grasp, _, hand in hands(loads=(ANY,), torques=(0.3,)):
        held = gc.best_squeeze(body, grasp, 0.5, ANY, max_push_n=10.0)
        rest = np.abs(hand.levers @ held.grip.squeeze.ravel())
        motors = gc.Motors.of(hand.levers, 1.3 * rest + 0.002)
        for way in directions(4, rng):
            load = np.append(way, 0.01 * directions(1, rng)[0])
            linear = gc.first_slip(held.grip, load, model="linear", motors=motors)
            shares = np.abs(motors.torques(linear.forces)) / motors.limits
            assert shares.max() <= 1.0 + 1e-6
            if linear.event == "torque limit":
                assert shares[linear.joint] == pytest.approx(1.0, abs=1e-6)
            finite = gc.first_slip(held.grip, load, motors=motors)
            free = gc.first_slip(held.grip, load)
            assert finite.multiple <= free.multiple * (1.0 + 1e-6)
            # forces in the object's axes: its turn is that of the contacts' normals
            turn = Rotation.align_vectors(finite.normals, held.grip.normals)[0].as_matrix()
            shares = np.abs(motors.torques(finite.forces @ turn)) / motors.limits
            assert shares.max() <= 1.0 + 1e-6
            ends.append(finite.event)
    assert len(ends) == 12
    assert ends.count("torque limit") >= 4
