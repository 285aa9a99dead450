"""Grasps pass the published tests, open contacts do not hold, and each verdict is about its own."""

import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.values import Contact
from sim_validate.protocols.judging import judge_by, judge_hand_by
from sim_validate.protocols.published import protocol, protocol_names
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled
from tests.marks import more

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


@pytest.mark.parametrize("name", ["dexgraspbench", *more("dexonomy", "mj-grasp-sim")])
def test_a_hand_passes_tests_as_well(name):
    body = scaled("dodecahedron", 0.035)
    reach = next(each for each in reaches("allegro", "dodecahedron", 0.035) if each.reached)
    hand = gc.load_hand("allegro").with_torque_limits(0.7, "a test")
    found = judge_hand_by(name, hand, body, reach, FRICTION)
    assert found.theirs, [run.reason for run in found.runs]
    assert found.ours.held, found.ours.reason
    assert found.hand == "allegro"
    assert found.predicted
