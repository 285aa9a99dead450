"""Recorded hands are judged as their records say, on a root that hangs on a soft weld."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from scenes.mujoco.mjcf_text import quaternion
from scenes.mujoco.published_tests import TestedObject
from sim_validate.hands.dexgraspbench import (
    ROOT_POSE,
    dex_record,
    hand_file,
    pose_of,
    reach_of_record,
    recorded_postures,
)
from sim_validate.protocols.judging import PUBLISHED_STEPS, judge_hand_by, their_verdict, timeline
from sim_validate.protocols.published import protocol
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled
from tests.scenes.mujoco.compiled import compiled

TEST = protocol("dexgraspbench")
HAND = gc.load_hand("allegro").with_torque_limits(0.7, "a test")
OPEN = 1
"""A finger that is kept open."""


def body():
    return scaled("dodecahedron", 0.035)


@cache
def record():
    reach = next(
        each for each in reaches("allegro", "dodecahedron", 0.035) if each.pregrasp is not None
    )
    return dex_record(HAND, reach, "object")


def found(changed):
    """The changed record, read as one of a file would be."""
    return reach_of_record(changed, HAND, body(), FRICTION)


def judged(changed):
    return judge_hand_by(TEST, HAND, body(), found(changed), FRICTION)


def scene(changed, servo=5.0):
    postures = recorded_postures(found(changed), HAND, servo)
    servos = replace(hand_file(HAND), stiffness_n_m_per_rad=servo, weld=TEST.weld)
    tested = TestedObject(body(), TEST.friction, TEST.mass_kg, TEST.physics)
    return tested.by_hand(HAND, postures, servos)


def with_open_finger():
    own = slice(ROOT_POSE + 4 * OPEN, ROOT_POSE + 4 * OPEN + 4)
    grasp, squeeze = np.array(record().grasp), np.array(record().squeeze)
    grasp[own] = squeeze[own] = record().pregrasp[own]
    return replace(record(), grasp=grasp, squeeze=squeeze)


def test_a_record_is_judged_by_its_own_squeeze():
    """A record whose squeeze opens the hand lets go, and one that squeezes twice pushes twice."""
    usual = judged(record())
    assert usual.theirs, [run.reason for run in usual.runs]
    assert usual.ours.held, usual.ours.reason
    opening = judged(replace(record(), squeeze=record().pregrasp))
    assert not opening.theirs
    assert opening.ours == usual.ours
    idle = recorded_postures(found(replace(record(), squeeze=record().grasp)), HAND, 5.0)
    assert idle.pushes_n == pytest.approx(np.zeros(4), abs=1e-6)
    grasp, squeeze = np.array(record().grasp), np.array(record().squeeze)
    twice = replace(record(), squeeze=2.0 * squeeze - grasp)
    assert recorded_postures(found(twice), HAND, 5.0).pushes_n.max() == pytest.approx(
        2.0 * usual.push_n
    )


def test_a_record_with_an_open_finger_is_judged_and_ours_says_by_proof_that_it_is_open():
    changed = with_open_finger()
    three = found(changed)
    assert len(three.contacts or ()) < 4
    verdict = judged(changed)
    assert len(verdict.runs) == 6
    assert all(run.fingers <= 3 for run in verdict.runs)
    far = replace(changed, grasp=np.array(record().pregrasp), squeeze=np.array(record().pregrasp))
    away = judged(far)
    assert not away.theirs
    assert (away.ours.closed, away.ours.held, away.ours.margin) == (False, False, 0.0)
    assert "fingertips are within" in away.ours.reason
    slippery = reach_of_record(record(), HAND, body(), 1e-3)
    refuted = judge_hand_by(TEST, HAND, body(), slippery, 1e-3)
    assert refuted.theirs
    assert "proved not to be in force closure" in refuted.ours.reason


def test_a_record_of_another_hand_is_refused():
    with pytest.raises(InputError, match="hand must be the recorded one, allegro"):
        judge_hand_by(TEST, replace(HAND, name="another"), body(), found(record()), FRICTION)


def test_forces_are_along_the_axes_of_the_records_world():
    """The object and the hand turned together by a quarter about z: a pull along x there is one
    along y of the object here."""
    turn = np.eye(4)
    turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]

    def moved(seven):
        pose = turn @ pose_of(seven[:ROOT_POSE])
        return np.concatenate([pose[:3, 3], quaternion(pose[:3, :3]), seven[ROOT_POSE:]])

    parts = ("object_pose", "pregrasp", "grasp", "squeeze")
    turned = replace(record(), **{name: moved(getattr(record(), name)) for name in parts})
    laid = [timeline(TEST, scene(each), TEST.runs[1]) for each in (record(), turned)]
    assert laid[0].wrenches[-1] == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert laid[1].wrenches[-1] == pytest.approx([0.0, -1.0, 0.0, 0.0, 0.0, 0.0])
    assert laid[1].commands == pytest.approx(laid[0].commands, abs=1e-7)


def test_a_run_is_what_a_plain_loop_of_steps_gives():
    """An independent driver: the hand on its weld, told by setting the mocap body's pose."""
    made = scene(record())
    run = timeline(TEST, made, TEST.runs[2])
    (model, data), farthest = compiled(made, 0), 0.0
    for sample, (told, wrench) in enumerate(zip(run.commands, run.wrenches, strict=True)):
        data.mocap_pos[0], data.mocap_quat[0], data.ctrl[:] = (
            told[:3],
            told[3:ROOT_POSE],
            told[ROOT_POSE:],
        )
        data.xfrc_applied[model.body("object").id] = wrench
        mujoco.mj_step(model, data, nstep=PUBLISHED_STEPS)
        if sample in run.looks:
            farthest = max(farthest, float(np.linalg.norm(data.qpos[:3])))
    assert their_verdict(TEST, made)[2].displacement_m == pytest.approx(farthest, abs=1e-9)
