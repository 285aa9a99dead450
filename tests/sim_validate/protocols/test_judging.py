"""Grasps pass the published tests, open contacts do not hold, and each verdict is about its own."""

import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.values import Contact
from scenes.mujoco.published_tests import TestedObject
from scenes.settings import FingerSettings
from sim_validate.protocols.judging import (
    Glance,
    judge_by,
    judge_hand_by,
    judged_run,
    their_verdict,
)
from sim_validate.protocols.published import Passing, protocol, protocol_names
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled

BODY = scaled("dodecahedron", 0.05)
GRASP = gc.plan(BODY, FRICTION, limit=1).grasps[0]


@pytest.mark.parametrize("name", protocol_names())
def test_a_closed_grasp_passes_every_test_and_holds_its_loads(name):
    """Pushes of 10 N are many times what the tests load this grasp with."""
    found = judge_by(name, BODY, GRASP, FRICTION)
    assert found.theirs, [run.reason for run in found.runs]
    assert found.ours.held
    assert found.ours.margin > 2.0
    assert found.predicted
    assert found.good
    assert len(found.runs) == len(protocol(found.protocol).runs)
    assert found.push_n == pytest.approx(10.0)
    mass = protocol(name).mass_kg
    assert found.mass_kg == pytest.approx(1000.0 * BODY.volume if mass is None else mass)
    assert math.isinf(found.ours.margin) == (not len(protocol(name).forces(0.1)))


def test_three_fingers_on_one_side_hold_nothing_and_ours_says_so_by_proof():
    top = np.argmax([face.normal @ [0.0, 0.0, -1.0] for face in BODY.faces])
    face = BODY.faces[top]
    middle = np.mean(np.concatenate(face.pieces), axis=0)
    corners = face.pieces[0][:3]
    contacts = [Contact(middle + 0.5 * (corner - middle), face.normal) for corner in corners]
    found = judge_by("dexgraspbench", BODY, contacts, FRICTION)
    assert not found.theirs
    assert not found.ours.closed
    assert found.ours.margin == 0.0
    assert not found.predicted
    assert "proved" in found.ours.reason
    assert any("moved by" in run.reason for run in found.runs)


def test_more_load_than_the_fingers_can_push_fails_theirs_ours_and_the_prediction():
    """Twice the predicted margin cannot be held by anybody who obeys statics: no four fingertips
    that push with at most 10 N carry it, at the friction of the test either."""
    usual = protocol("dexgraspbench")
    same = replace(usual, friction=FRICTION, physics=replace(usual.physics, torsion_m=0.0))
    margin = judge_by(same, BODY, GRASP, FRICTION).ours.margin
    heavy = replace(same, mass_kg=usual.mass_kg * 2.0 * margin)
    found = judge_by(heavy, BODY, GRASP, FRICTION)
    assert found.ours.margin == pytest.approx(0.5, rel=1e-6)
    assert not found.predicted
    assert not found.ours.held
    assert not found.theirs


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dexgraspbench", "dexonomy"])
def test_a_hand_passes_tests_as_well(name):
    body = scaled("dodecahedron", 0.035)
    reach = next(each for each in reaches("allegro", "dodecahedron", 0.035) if each.reached)
    hand = gc.load_hand("allegro").with_torque_limits(0.7, "a test")
    found = judge_hand_by(name, hand, body, reach, FRICTION)
    assert found.theirs, [run.reason for run in found.runs]
    assert found.ours.held, found.ours.reason
    assert found.hand == "allegro"
    assert found.predicted


def moving(heights, turn_deg=0.0):
    """An object that is at these heights after samples 0, 1, .., and looked at from 2 on."""
    half = math.radians(0.5 * turn_deg)
    poses = np.tile([0.0, 0.0, 0.0, math.cos(half), 0.0, math.sin(half), 0.0], (len(heights), 1))
    poses[:, 2] = heights
    return [Glance(pose, 2) for pose in poses[2:]]


@pytest.mark.parametrize(
    ("passing", "heights", "passed", "said"),
    [({"most_m": 0.035}, (0.01, 0.02, 0.03, 0.04), False, "moved by 40 mm"),
     ({"most_m": 0.02}, (0.0, 0.0, 0.02), False, "moved by 20 mm"),
     ({"most_m": 0.02}, (0.0, 0.0, 0.0199), True, ""),
     ({"most_m": 0.02}, (0.0, 0.0, 0.03, 9.0), False, "moved by 30 mm"),
     ({"most_m": 1.0}, (0.0, 0.0, math.nan), False, ""),
     ({"fingers": 2}, (0.0, 0.0, 0.0), True, ""),
     ({"fingers": 3}, (0.0, 0.0, 0.0), False, "2 fingers touched")],
)  # fmt: skip
def test_a_run_is_judged_at_its_looks_up_to_the_first_that_fails(passing, heights, passed, said):
    """Displacement counts from before closing, and a threshold itself does not pass."""
    found = judged_run(0, moving(heights), "", Passing(**passing))
    assert found.passed is passed
    assert said in found.reason


def test_a_turn_counts_as_an_angle_and_a_fault_of_the_simulator_is_no_pass():
    looks = moving((0.0, 0.0, 0.0), turn_deg=20.0)
    assert not judged_run(0, looks, "", Passing(most_deg=15.0)).passed
    found = judged_run(0, looks, "", Passing(most_deg=25.0))
    assert (found.passed, found.turn_deg) == (True, pytest.approx(20.0))
    found = judged_run(0, looks, "it diverged", Passing())
    assert (found.passed, found.reason) == (False, "it diverged")


def test_a_run_that_diverges_is_no_pass_and_is_not_looked_at():
    """Fingers that push a feather with a ton."""
    usual = protocol("dexgraspbench")
    coarse = replace(usual, physics=replace(usual.physics, timestep=0.005))
    tested = TestedObject(BODY, usual.friction, 1e-4, coarse.physics)
    scene = tested.by_fingertips(GRASP, FingerSettings(max_normal_force_n=1e4))
    for run in their_verdict(coarse, scene):
        assert not run.passed
        assert "the simulator raised" in run.reason
        assert (run.displacement_m, run.turn_deg, run.fingers) == (0.0, 0.0, 0)
