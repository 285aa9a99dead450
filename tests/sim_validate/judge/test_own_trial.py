"""Our trial of a hand holds what the analysis says it should, and its controls let go."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from grasp_core.closure.force_closure import force_closure
from grasp_core.objects.convex_pieces import PiecedObject
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.setup import AXIS_NAMES
from sim_validate.hands.known_hand import cube
from sim_validate.judge.hands import judged_hand
from sim_validate.judge.judging import Stage
from sim_validate.judge.own_trial import ClosedHand
from sim_validate.judge.records import HandRecord, Posture
from sim_validate.protocols.settings import JudgeSettings
from tests.sim_validate.judge.allegro import (
    OPEN,
    bent,
    lifted,
    record,
    stage,
    with_open_finger,
)

TRIED = JudgeSettings(tests=())


def tried(one, settings=TRIED):
    own = stage(settings)
    return own.trials.tried(own.looked(one).at)


def closed_hand(one=None, settings=TRIED):
    own = stage(settings)
    at = own.looked(one or record()).at
    return ClosedHand(own.trials, at, own.trials.closed(at))


def test_a_good_grasp_holds_every_load_and_its_controls_let_go():
    found = tried(record())
    assert found.held, found.reason
    assert found.trusted
    assert [each.name for each in found.loads] == [*AXIS_NAMES, "weight"]
    assert [each.name for each in found.controls] == ["less friction", "one finger open"]
    assert all(each.outcome is Outcome.SLIPPED for each in found.controls)
    # limits are over what is applied: a fifth more along the axes
    assert [each.limit for each in found.loads[:-1]] == pytest.approx([1.25] * 12)
    assert found.contacts >= 4
    assert found.moved_m < 0.005


def test_a_finger_opens_in_the_control_though_the_record_has_none_that_is_open():
    """A record whose open hand is that of its grasp says nothing about opening."""
    usual = record()
    found = tried(replace(usual, pregrasp=usual.grasp))
    assert [each.outcome for each in found.controls] == [Outcome.SLIPPED] * 2


def test_loads_beyond_their_limits_are_lost_and_below_are_held():
    """The simulator's own answer to a slow rise is the analysis's limit, within some per cent."""
    held = closed_hand()
    held.proof = force_closure(held.contacts, friction=TRIED.friction)
    limits = held.limits(np.eye(6)[[0, 2, 5]] * [1, 1, 1, 0.035, 0.035, 0.035])
    shares = [held.lets_go_at(each, 0.1) for each in limits]
    assert shares == pytest.approx([1.0] * 3, abs=0.05)


def test_a_weight_that_is_too_large_is_lost():
    heavy = tried(record(), replace(TRIED, mass_kg=5.0))
    assert not heavy.held
    assert heavy.trusted
    (weight,) = [each for each in heavy.loads if each.name == "weight"]
    assert weight.limit < 1.0
    assert weight.outcome is Outcome.SLIPPED
    assert heavy.reason.startswith("weight: the object moved by")
    assert all(each.outcome is Outcome.HELD for each in heavy.loads[:-1])


PINCHER = """
<mujoco>
  <worldbody>
    <body name="palm" pos="0 0 0.1">
      <geom type="box" size="0.02 0.02 0.01" mass="0.2"/>
      <body name="left" pos="-0.07 0 -0.1">
        <joint name="left" type="slide" axis="1 0 0" range="-.01 .05" limited="true" damping="1"/>
        <geom type="sphere" size="0.01" mass="0.05"/>
      </body>
      <body name="right" pos="0.07 0 -0.1">
        <joint name="right" type="slide" axis="-1 0 0" range="-.01 .05" limited="true" damping="1"/>
        <geom type="sphere" size="0.01" mass="0.05"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="left" joint="left" kp="500" kv="10" forcerange="-5 5" forcelimited="true"/>
    <position name="right" joint="right" kp="500" kv="10" forcerange="-5 5" forcelimited="true"/>
  </actuator>
</mujoco>
"""


def test_two_fingers_are_proved_open_and_let_the_object_turn(tmp_path):
    """Two contacts without torsion resist no torque about the line between them."""
    path = tmp_path / "pincher.xml"
    path.write_text(PINCHER)
    own = Stage(judged_hand(path), PiecedObject(cube()), TRIED)
    root = np.eye(4)
    postures = [Posture(root, np.full(2, slide)) for slide in (0.025, 0.03, 0.034)]
    opened, grasp, squeeze = postures
    one = HandRecord("0", "cube", 1.0, (), grasp, opened, squeeze, np.eye(3))
    looked = own.looked(one)
    assert looked.proof.closed is False
    found = own.trials.tried(looked.at)
    assert (found.closed, found.held, found.contacts, found.loads) == (False, False, 2, ())
    (control,) = found.controls
    assert control.outcome is Outcome.SLIPPED
    assert found.trusted
    assert "proved not to be in force closure" in found.reason


def test_a_hand_that_holds_nothing_says_why():
    away = tried(lifted(0.5))
    assert (away.held, away.closed, away.contacts) == (False, None, 0)
    assert away.reason == "0 contacts are left when the hand has closed"
    thrown = replace(record(), squeeze=bent(record().squeeze, record().pregrasp.joints))
    assert not tried(thrown).held


def test_a_finger_that_stays_open_does_not_touch():
    links = set(closed_hand(with_open_finger()).links)
    fingers = stage(TRIED).trials.hand.fingers
    assert links.isdisjoint(fingers[OPEN])
    assert not links.isdisjoint(fingers[0])


def test_the_torques_told_are_those_that_contact_forces_need():
    """By virtual work: turning the joints by dq moves contact points by J dq."""
    held = closed_hand()
    held.proof = force_closure(held.contacts, friction=TRIED.friction)
    forces, finder = held.idle, held.trials.finder
    torques = (held._told(forces) - held.angles) * held.trials.hand.servos.stiffness
    power, step = np.zeros(len(torques)), 1e-6
    data, model = finder.data, finder.model

    def places(angles):
        data.qpos[finder.angles] = angles
        mujoco.mj_kinematics(model, data)
        found = []
        for link in held.links:
            body = model.body(link).id
            found.append((data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()))
        return found

    rest = places(held.angles)
    points = [np.array(c.position) - held.trials.body.center_of_mass for c in held.contacts]
    local = [R.T @ (p - x) for p, (x, R) in zip(points, rest, strict=True)]
    for joint in range(len(torques)):
        turned = held.angles.copy()
        turned[joint] += step
        moved = places(turned)
        power[joint] = sum(
            force @ ((x + R @ at) - p) / step
            for force, (x, R), at, p in zip(forces, moved, local, points, strict=True)
        )
    assert torques == pytest.approx(power, abs=1e-4)
