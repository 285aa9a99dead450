"""Runs are laid out as tests say: commands, forces, and what a moving palm does to the object."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from scenes.mujoco.published_tests import TestedObject
from scenes.settings import FingerSettings
from sim_validate.protocols.judging import PUBLISHED_STEPS, timeline
from sim_validate.protocols.published import Step, protocol
from tests.grasp_core.hands.gripping import scaled

BODY = scaled("dodecahedron", 0.05)
GRASP = gc.plan(BODY, 0.5, limit=1).grasps[0]
TEST = protocol("dexgraspbench")
SCENE = TestedObject(BODY, 0.6, 0.1, TEST.physics).by_fingertips(GRASP, FingerSettings())
SAMPLE = PUBLISHED_STEPS * 0.004


def laid(*steps):
    return timeline(TEST, SCENE, steps)


def test_fingers_close_then_squeeze_at_equal_steps():
    """Ten commands of ten steps from open to touching, ten more to squeezing, as DexGraspBench."""
    found = laid(Step(0.4))
    assert found.commands[9] == pytest.approx(np.zeros(12))
    assert found.commands[4] == pytest.approx(0.5 * SCENE.opened)
    assert found.commands[14] == pytest.approx(0.5 * SCENE.squeezing)
    assert (found.commands[19:] == SCENE.squeezing).all()
    assert not found.wrenches[:20].any()


def test_a_force_is_there_at_once():
    found = laid(Step(0.4, pull_m_s2=(0.0, 0.0, -10.0)))
    assert (found.wrenches[20:] == [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]).all()


def test_looks_are_at_their_times_and_at_the_end():
    found = laid(Step(2.0, look_s=0.2), Step(0.4))
    assert list(found.looks) == [20 + 5 * number - 1 for number in range(1, 11)] + [20 + 60 - 1]


def test_a_palm_that_starts_and_stops_pulls_the_object_back_and_forth():
    """A velocity of 0.5 m/s after one sample, and none again after another: what acts in between
    gives the object, seen from the palm, minus that velocity; sums of forces are momenta."""
    wrenches = laid(Step(0.4, line_m=(0.0, 0.0, 0.2)), Step(0.4)).wrenches[20:]
    speed = 0.2 / 0.4
    momenta = np.cumsum(wrenches[:, :3], axis=0) * SAMPLE
    assert momenta[0] == pytest.approx([0.0, 0.0, -0.1 * speed])
    assert momenta[9] == pytest.approx([0.0, 0.0, -0.1 * speed])
    assert momenta[-1] == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_turn_acts_by_the_inertia_about_its_axis():
    found = laid(Step(0.4, turn_deg=90.0)).wrenches[20:]
    rate = 0.5 * np.pi / 0.4
    assert found[0, 3:] * SAMPLE == pytest.approx(-rate * SCENE.inertia_kg_m2[:, 2])
    assert not found[1:].round(12).any()


def test_a_test_without_closing_starts_with_the_load():
    at_once = replace(TEST, close_s=0.0, squeeze_s=0.0)
    found = timeline(at_once, SCENE, (Step(0.4, pull_m_s2=(0.0, 10.0, 0.0)),))
    assert (found.commands == SCENE.squeezing).all()
    assert (found.wrenches[:, 1] == 1.0).all()
