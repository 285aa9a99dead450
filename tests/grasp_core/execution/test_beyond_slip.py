"""Loads past the first slip, against closed forms and a path of many small explicit steps."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import cross_matrix
from grasp_core.execution.beyond_slip import loss_multiples
from grasp_core.execution.first_slip import slip_steps
from tests.grasp_core.execution.held import box, directions, loads_of, opposed_grip, planned_grips

SINK = np.array([[0.0, 0.0, -1.0, 0.0, 0.0, 0.0]])
FAR = 1.0
"""A displacement or turn that nothing reaches."""


def crossed_grip(weak, strong, friction=0.5, stiffness=1000.0):
    """Two fingers along x that push little, and two along y that push more."""
    center = box().center_of_mass
    sides = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    sizes = 0.5 * np.ptp(box().vertices, axis=0)
    contacts = [gc.Contact(center + side * sizes, -side) for side in sides]
    pushes = np.array([weak, weak, strong, strong])[:, None] * -sides
    return gc.grip(box(), contacts, friction, pushes, stiffness=stiffness, tip_radius_m=0.05)


def test_fingers_that_slip_keep_rubbing_while_the_others_give_way():
    """Four springs sink by w / 4k up to the slip at 4 mu N, and then two by (w - 2 mu N) / 2k."""
    grip = crossed_grip(weak=2.0, strong=20.0)
    (elastic,) = loss_multiples(grip, SINK, 0.8e-3, FAR)
    assert elastic == pytest.approx(4 * 1000.0 * 0.8e-3, rel=1e-9)
    (found,) = loss_multiples(grip, SINK, 5e-3, FAR)
    assert found == pytest.approx(2 * 1000.0 * 5e-3 + 2 * 0.5 * 2.0, rel=1e-6)


def test_nothing_holds_once_all_fingers_slip():
    """The load is 2 mu (N + N') at most, however far the object may move."""
    grip = crossed_grip(weak=2.0, strong=20.0)
    (found,) = loss_multiples(grip, SINK, FAR, FAR)
    assert found == pytest.approx(2 * 0.5 * (2.0 + 20.0), rel=0.06)


def test_a_load_without_slip_moves_the_object_up_to_the_limit():
    grip = opposed_grip(push=50.0, stiffness=5000.0, tip_radius_m=0.05)
    loads = 1e-3 * directions(30, np.random.default_rng(1), 6) * np.repeat([1.0, 0.01], 3)
    motion = loads @ grip.compliance.T
    by_turn = 1e-4 / np.linalg.norm(motion[:, 3:], axis=1)
    by_way = 1e-4 / np.linalg.norm(motion[:, :3], axis=1)
    assert loss_multiples(grip, loads, FAR, 1e-4) == pytest.approx(by_turn, rel=1e-9)
    assert loss_multiples(grip, loads, 1e-4, FAR) == pytest.approx(by_way, rel=1e-9)


def response(grip, contact, force):
    """Return the change of a contact's force per motion, in its frame, (3, 6), and its wrench's."""
    turned = np.hstack([np.zeros((3, 3)), cross_matrix(grip.squeeze[contact])])
    jacobian = np.hstack([np.eye(3), -cross_matrix(grip.arms[contact])])
    own = grip.frames[contact].T @ (turned - grip.stiffness[contact] @ jacobian)
    mu, size = grip.friction[contact], np.linalg.norm(force[1:])
    if force[0] <= 1e-9:
        own = 0.0 * own
    elif size >= mu * force[0] * (1 - 1e-9):
        along = force[1:] / size
        own[1:] = own[1:] - np.outer(along, along @ own[1:]) + mu * np.outer(along, own[0])
    return own, jacobian.T @ (grip.frames[contact] @ own - turned)


def explicit(grip, load, most_m, most_rad, farthest, steps=700):
    """Follow a load in many small steps, each with the stiffness of what slips at its start."""
    forces, motion, step = grip.local_squeeze.copy(), np.zeros(6), farthest / steps
    for count in range(steps):
        parts = [response(grip, i, force) for i, force in enumerate(forces)]
        total = sum(wrench for _, wrench in parts) - grip.geometric_stiffness
        change = np.linalg.solve(total, -step * load)
        motion = motion + change
        for i, (own, _) in enumerate(parts):
            forces[i] += own @ change
            n = forces[i, 0] = max(forces[i, 0], 0.0)
            size = np.linalg.norm(forces[i, 1:])
            forces[i, 1:] *= min(1.0, grip.friction[i] * n / size)
        if np.linalg.norm(motion[:3]) > most_m or np.linalg.norm(motion[3:]) > most_rad:
            return count * step
    return farthest


def test_planned_grips_lose_their_object_where_many_small_steps_do():
    rng, most_m, most_rad = np.random.default_rng(5), 2e-3, 0.04
    ratios = []
    for grip in planned_grips(push=4.0, tip_radius_m=0.01):
        loads = loads_of(grip, 3, rng)
        found = loss_multiples(grip, loads, most_m, most_rad)
        for load, loss in zip(loads, found, strict=True):
            slip = slip_steps(grip.local_squeeze, grip.response @ load, grip.friction).min()
            if slip < loss:
                other = explicit(grip, load, most_m, most_rad, 1.5 * loss)
                ratios.append(loss / other)
    assert len(ratios) >= 5
    assert np.median(np.abs(np.log(ratios))) < 0.02
    assert np.quantile(np.abs(np.log(ratios)), 0.9) < 0.15


def test_last_digits_of_a_load_do_not_decide_its_loss():
    rng, changes, count = np.random.default_rng(7), np.random.default_rng(1), 0
    for grip in planned_grips(push=5.0, tip_radius_m=0.01):
        loads = loads_of(grip, 40, rng)
        found = loss_multiples(grip, loads, 1e-3, FAR)
        for size in (1e-12, 1e-9):
            changed = loads * (1.0 + size * changes.normal(size=loads.shape))
            assert loss_multiples(grip, changed, 1e-3, FAR) == pytest.approx(found, rel=0.02)
        count += len(loads)
    assert count == 120


def test_losses_are_after_the_slip_and_before_the_limit_without_slip():
    rng, count = np.random.default_rng(7), 0
    for grip in planned_grips(push=5.0, tip_radius_m=0.01):
        loads = loads_of(grip, 40, rng)
        slips = [slip_steps(grip.local_squeeze, grip.response @ w, grip.friction).min()
                 for w in loads]  # fmt: skip
        motion = loads @ grip.compliance.T
        sticking = 1e-3 / np.linalg.norm(motion[:, :3], axis=1)
        found = loss_multiples(grip, loads, 1e-3, FAR)
        assert (found <= sticking * (1 + 1e-9)).all()
        assert (found >= 0.97 * np.minimum(slips, sticking)).all()
        # where two contacts slip nearly at once, rounding may choose the way on: one load in 7,000
        off = np.abs(3.0 * loss_multiples(grip, 3.0 * loads, 1e-3, FAR) / found - 1.0)
        assert np.median(off) < 1e-9
        assert (off > 1e-6).sum() <= 1
        assert off.max() < 0.01
        wider = loss_multiples(grip, loads, 2e-3, FAR)
        assert (wider >= 0.98 * found).all()  # paths in large steps differ a little
        assert (wider > 1.05 * found).any()
        count += int((np.array(slips) < found).sum())
    assert count >= 10


def test_unstable_grips_hold_nothing_and_no_load_is_never_lost():
    unstable = opposed_grip(push=500.0, stiffness=1000.0, tip_radius_m=0.0)
    assert loss_multiples(unstable, SINK, FAR, FAR).tolist() == [0.0]
    assert loss_multiples(opposed_grip(), 0.0 * SINK, FAR, FAR).tolist() == [np.inf]
    assert len(loss_multiples(opposed_grip(), np.zeros((0, 6)), FAR, FAR)) == 0


def test_a_grip_on_its_cone_at_rest_is_followed_too():
    grip = crossed_grip(weak=2.0, strong=20.0)
    rubbing = replace(grip, friction=np.array([0.0, 0.0, 0.5, 0.5]))
    (found,) = loss_multiples(rubbing, SINK, 5e-3, FAR)
    assert found == pytest.approx(2 * 1000.0 * 5e-3, rel=1e-6)
