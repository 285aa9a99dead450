"""Hands whose joints follow others hold in simulation what their motors are predicted to."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

import sim_validate as sv
from grasp_core.closure.contacts import grasp_map
from grasp_core.errors import InputError
from grasp_core.hands.hand import Coupling
from grasp_core.hands.hand_motors import hand_motors
from scenes.mujoco.hand_scenes import build_hand_scene, unchosen_squeezes
from sim_validate.closure.verdict import AGREEMENT
from sim_validate.engine.rig import closed_on
from sim_validate.engine.schedules import TrialLoad
from sim_validate.execution.paths import closing
from sim_validate.execution.simulate import HeldBench
from sim_validate.hands.execute import hand_execution_settings
from sim_validate.hands.known_hand import KnownHand
from sim_validate.hands.validate import hand_setup
from tests.grasp_core.hands.coupled_hand import off
from tests.grasp_core.hands.gripping import FRICTION
from tests.sim_validate.hands.executing import COUPLED, MASS, held_object, standing, stood

OBEYED = 1e-3
"""Largest angle by which a joint may be off those that it follows [rad]."""
NEAR = 0.05
"""Relative error of multiples of first slip: 2 % as for hard fingertips, and 3 % for the delay with
which joints follow their pads, which predictions leave out."""


@pytest.mark.parametrize("name", COUPLED)
def test_it_holds_up_to_its_predicted_limits_and_controls_let_go(name):
    (reach, hand), body = stood(name), held_object(name)
    agenda = sv.Agenda(limits="ramp", random_wrenches=3, critical_friction=False)
    found = sv.validate_hand(hand, body, reach, FRICTION, agenda=agenda)
    assert found.good, found.mismatches
    assert len(found.wrenches) == 16
    assert all(abs(trial.let_go_at.share - 1.0) < AGREEMENT for trial in found.wrenches)
    assert [each.control.name for each in found.controls] == [
        "overloaded", "weak_motors", "dead_motor", "low_friction"
    ]  # fmt: skip
    dead = found.controls[2].control
    assert dead.limits.shape == (len(hand.free_joints),)
    assert any(joint.name in dead.explanation for joint in hand.free_joints)


@pytest.mark.parametrize("name", COUPLED)
def test_joints_follow_at_rest_and_under_load(name):
    (reach, hand), body, setup = stood(name), held_object(name), hand_setup()
    scene = build_hand_scene(hand, body, reach, FRICTION, physics=setup.physics)
    rig, layout = closed_on(scene, setup, FRICTION), scene.layout
    load = 0.5 * float(layout.squeeze[:, 0].max()) * np.eye(6)
    trial = TrialLoad(load[2], layout.squeeze_forces)
    (poses,) = rig.joints(rig.holds([trial]))
    assert max(off(hand, scene.hand.angles + each[7:]) for each in poses) < OBEYED
    # without the rules, followers have nothing that turns them
    rules = re.compile(r"<joint joint1=[^>]*>")
    assert len(rules.findall(scene.xml)) == len(hand.couplings)
    limp = closed_on(replace(scene, xml=rules.sub("", scene.xml)), setup, FRICTION)
    (poses,) = limp.joints(limp.holds([trial]))
    assert off(hand, scene.hand.angles + poses[-1, 7:]) > 10.0 * OBEYED

    _, _, held, _ = standing(name)
    bench = HeldBench(held)
    motion, _ = bench.settled(closing())
    places = [int(bench.model.joint(joint.name).qposadr[0]) for joint in hand.joints]
    turned = held.layout.holder.angles + motion.joints[:, places]
    assert max(off(hand, each) for each in turned) < OBEYED


@pytest.mark.parametrize("name", COUPLED)
def test_it_executes_a_grasp_and_would_slip_where_it_is_predicted_to(name):
    (reach, hand), body = stood(name), held_object(name)
    settings = replace(
        hand_execution_settings(0.5 * MASS), trials=("weight", "shake", "stop", "misplaced"),
        misplacements=2,
    )  # fmt: skip
    found = sv.execute_hand(hand, body, reach, FRICTION, settings)
    assert found.survived, [trial for trial in found.trials if not trial.survived]
    assert len(found.trials) == 15
    assert found.controls_let_go
    placed = [trial for trial in found.trials if trial.kind != "misplaced"]
    multiples = np.array([(t.predicted_first_slip, t.simulated_first_slip) for t in placed])
    assert multiples.min() > 1.0
    errors = multiples[:, 1] / multiples[:, 0] - 1.0
    assert np.abs(errors).max() < NEAR, errors


def test_what_its_motors_cannot_carry_is_lost():
    (reach, hand), body = stood("coupled"), held_object("coupled")
    able = sv.execute_hand(hand, body, reach, FRICTION, hand_execution_settings(0.5 * MASS))
    heavy = replace(hand_execution_settings(2.0 * able.payload_kg), trials=("weight",))
    found = sv.execute_hand(hand, body, reach, FRICTION, heavy)
    assert not found.survived
    assert found.least_predicted_loss < 1.0


def test_the_known_hand_with_hinges_that_follow_is_exact():
    checks = KnownHand(hand_setup(), FRICTION, coupled=True).checks()
    assert len(checks) == 4
    assert all(check.passed for check in checks), [str(check) for check in checks]


@pytest.mark.parametrize("name", ["dexonomy", "mj-grasp-sim"])
def test_a_published_test_closes_it_and_its_servos_follow_motors_alone(name):
    (reach, hand), body = stood("coupled"), held_object("coupled")
    found = sv.judge_hand_by(name, hand, body, reach, FRICTION)
    assert found.theirs
    assert found.ours.held


def test_a_record_moves_all_joints_as_they_follow():
    (reach, hand) = stood("coupled")
    record = sv.dex_record(hand, reach, "object")
    for posture in (record.grasp, record.squeeze):
        assert off(hand, posture[7:]) < 1e-8  # written with nine digits
    assert np.abs(record.squeeze - record.grasp).max() > 1e-2


def test_motors_that_leave_squeezes_to_chance_execute_nothing():
    """One motor for two fingers that bend alike: four motors, of three squeezes at three contacts.

    With the thumb tied to them, too, one motor bends all, and the squeezes across are nobody's.
    """
    (reach, hand), body = stood("coupled"), held_object("coupled")
    points = np.array([contact.position for contact in reach.contacts])
    motors = hand_motors(hand, reach)
    assert unchosen_squeezes(motors, points) == 0
    basis = scipy.linalg.null_space(grasp_map(points))
    few = replace(motors, levers=motors.levers[:2], limits=motors.limits[:2],
                  gravity=motors.gravity[:2])  # fmt: skip
    assert unchosen_squeezes(few, points) == 3 - np.linalg.matrix_rank(basis.T @ few.levers.T)
    tied = replace(hand, couplings=tuple(
        Coupling(joint.name, hand.joints[0].name, 1.0) for joint in hand.joints[1:]
    ))  # fmt: skip
    posed = replace(reach, joints=tied.drives.obeyed(reach.joints[None])[0])
    with pytest.raises(InputError, match=r"leave \d of the squeezes at these contacts to chance"):
        sv.execute_hand(tied, body, posed, FRICTION, hand_execution_settings(0.5 * MASS))
