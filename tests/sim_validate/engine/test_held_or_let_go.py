from dataclasses import replace

import numpy as np
import pytest

from scenes.mujoco.mjcf_text import quaternion
from sim_validate.engine.held_or_let_go import rotation_angles, traces
from sim_validate.engine.stepping import Health, Motion
from tests.judges import random_rotation


def motion(rows, **changes):
    still = {
        "times_s": 0.01 * np.arange(1, len(rows) + 1), "joints": np.array(rows),
        "state": np.zeros(1), "health": Health(),
    }  # fmt: skip
    return Motion(**still | changes)


def pose(shift=(0.0, 0.0, 0.0), rotation=None, slides=None, scale=1.0):
    """Joint positions of the object about its centre of mass, and of four fingers."""
    turn = quaternion(np.eye(3) if rotation is None else rotation)
    slid = np.zeros((4, 3)) if slides is None else slides
    return np.concatenate([shift, scale * turn, np.ravel(slid)])


def test_small_angles_are_exact():
    for angle in (1e-12, 1e-6, 0.1, 3.0):
        turned = np.array([[np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]])
        for sign in (1.0, -1.0):
            found = rotation_angles(sign * turned, np.array([[1.0, 0.0, 0.0, 0.0]]))
            assert found[0] == pytest.approx(angle, rel=1e-10)


def test_motion_is_measured_from_the_moment_watching_begins(layout):
    rows = [pose((0.0, 0, 0)), pose((1e-3, 0, 0)), pose((1e-3, 2e-4, 0)), pose((1e-3, 2e-4, 3e-4))]
    (found,) = traces([motion(rows)], layout, [2])
    assert len(found.times_s) == 2
    np.testing.assert_allclose(found.shifts_m, [2e-4, np.hypot(2e-4, 3e-4)])
    assert found.start_m == pytest.approx(1e-3)


def test_a_turn_about_the_middle_of_the_contacts_counts_as_turn_alone(layout):
    """The object's frame is elsewhere, so it moves; the point between the contacts does not."""
    angle = 1e-3
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    (found,) = traces([motion([pose(), pose(layout.center - R @ layout.center, R)])], layout, [1])
    assert found.shifts_m[0] < 1e-15
    assert found.rotations_rad[0] == pytest.approx(angle)
    assert found.displacements_m[0] == pytest.approx(layout.grasp_size_m * angle)


def test_slips_and_gaps_are_those_of_the_contact_frames(layout):
    slides = np.zeros((4, 3))
    slides[0, 0], slides[1, 1], slides[2, 2] = -2e-5, 3e-5, 4e-5
    (found,) = traces([motion([pose(), pose(slides=slides)])], layout, [1])
    touching = -layout.drive.indentation_m
    np.testing.assert_allclose(found.gaps_m[0] - touching, [2e-5, 0.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(found.slips_m[0], [0.0, 3e-5, 4e-5, 0.0], atol=1e-15)
    touched = layout.contacts[3] - touching * layout.frames[3, :, 0]
    np.testing.assert_allclose(found.touched_m[0, 3], touched, atol=1e-15)


def test_fingers_that_move_with_the_object_do_not_slip(layout):
    rng = np.random.default_rng(1)
    R, shift = random_rotation(rng), rng.normal(size=3)
    there = layout.holder.tip_centers @ R.T + shift
    slides = np.einsum("kij,ki->kj", layout.frames, there - layout.holder.tip_centers)
    (found,) = traces([motion([pose(), pose(shift, R, slides, scale=1.1)])], layout, [1])
    assert found.slips_m.max() < 1e-14
    assert np.abs(found.gaps_m + layout.drive.indentation_m).max() < 1e-14


def test_rigid_fingers_have_no_slides(layout):
    """The scene has no joints for them: seven numbers a row."""
    rigid = replace(layout, holder=replace(layout.holder, stiffness=np.zeros((4, 0))))
    away = 1e-4 * layout.frames[0, :, 0]
    (found,) = traces([motion([pose()[:7], pose(away)[:7]])], rigid, [1])
    assert found.gaps_m[0, 0] == pytest.approx(1e-4 - layout.drive.indentation_m)
