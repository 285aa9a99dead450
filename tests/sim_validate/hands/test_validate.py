"""Hands in simulation hold what their motors are predicted to, and controls let go."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.errors import InputError, UnfaithfulError
from scenes.mujoco_options import PhysicsSettings
from sim_validate.closure.verdict import AGREEMENT
from sim_validate.hands.known_hand import KnownHand
from sim_validate.hands.validate import hand_setup
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled
from tests.marks import more
from tests.sim_validate.hands.executing import OBJECT, RADIUS, TORQUE, stood

DOWN = (0.0, 0.6, -0.8)
CASES = [("allegro", "dodecahedron", 0.035, None), ("leap", "dodecahedron", 0.035, DOWN),
         ("allegro", "l-bracket", 0.04, None)]  # fmt: skip


def verdict(hand, name, radius, down, **agenda):
    body = scaled(name, radius)
    reach = next(each for each in reaches(hand, name, radius) if each.reached)
    held = gc.load_hand(hand).with_torque_limits(TORQUE, "a test")
    asked = sv.Agenda(critical_friction=False, **agenda)
    return sv.validate_hand(held, body, reach, FRICTION, down=down, agenda=asked), reach


@pytest.mark.parametrize(
    "case", [CASES[1], pytest.param(CASES[2], marks=pytest.mark.slow), *more(CASES[0])]
)
def test_a_hand_holds_up_to_its_predicted_limits(case):
    found, _ = verdict(*case, random_wrenches=3, limits="ramp", controls=False)
    assert found.good, found.mismatches
    assert len(found.wrenches) == 16
    for trial in found.wrenches:
        assert trial.simulated_limit is not None
        assert abs(trial.let_go_at.share - 1.0) < AGREEMENT


@pytest.mark.parametrize("case", [*CASES[:2], *more(CASES[2])])
def test_controls_let_go_and_carry_their_proofs(case):
    found, reach = verdict(*case)
    names = [each.control.name for each in found.controls]
    assert {"overloaded", "weak_motors", "low_friction"} <= set(names)
    assert ("dead_motor" in names) == (case[3] is None)
    assert found.controls_let_go
    positions = np.array([contact.position for contact in reach.contacts])
    normals = np.array([contact.normal for contact in reach.contacts])
    for each in found.controls:
        control = each.control
        motors = replace(found.scene.hand.motors, limits=control.limits)
        assert control.proof.upper < 1.0
        assert control.proof.verify(
            positions, normals, control.friction, motors=motors,
            max_normal_force=found.setup.fingers.max_normal_force_n,
            center=scaled(case[1], case[2]).center_of_mass,
        )  # fmt: skip


def test_the_known_hand_is_exact_and_wrong_settings_are_refused():
    checks = KnownHand(hand_setup(), FRICTION).checks()
    assert len(checks) == 4
    assert all(check.passed for check in checks), [str(check) for check in checks]


@pytest.mark.parametrize(
    "change",
    [{"cone": "pyramidal"}, *more({"solimp": (0.5, 0.5, 0.001, 0.5, 2.0)}, {"impratio": 1.0})],
)
def test_unfaithful_settings_are_refused(change):
    body, (reach, held) = scaled(OBJECT, RADIUS), stood("allegro")
    setup = replace(hand_setup(), physics=replace(PhysicsSettings(), **change))
    with pytest.raises(UnfaithfulError, match="the simulator is not faithful"):
        sv.validate_hand(held, body, reach, FRICTION, setup=setup)


def test_what_cannot_be_tested_is_refused():
    body, (reach, held) = scaled(OBJECT, RADIUS), stood("allegro")
    with pytest.raises(InputError, match=r"not in force closure at friction 0\.001"):
        sv.validate_hand(held, body, reach, 0.001)
    soft = replace(hand_setup(), physics=PhysicsSettings(torsion_m=0.005))
    with pytest.raises(InputError, match="torsion_m must be zero for a hand"):
        sv.validate_hand(held, body, reach, FRICTION, setup=soft)
    with pytest.raises(InputError, match="must have a torque limit"):
        sv.validate_hand(gc.load_hand("allegro"), body, reach, FRICTION)
