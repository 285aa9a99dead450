"""Soft fingertips in simulation: contacts of dimension four yield where the analysis says."""

import pytest

import grasp_core as gc
import sim_validate as sv
from scenes.mujoco_options import PhysicsSettings
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.known_cases import measured
from sim_validate.engine.setup import Agenda, Setup
from tests.sim_validate.rigs import grasps

FRICTION = 0.5
FREE = ("free",)
"""The family whose grasps need most friction."""
SHARE = 0.03
"""Torsional coefficient over the object's radius: fingertips that touch some hundredths of it."""
AGREED = 0.01
"""Largest error of what simulation finds, relative to the prediction."""
ROUNDED = 1e-9
"""Two searches of the same critical friction may differ by this, relative to it."""
RESISTED = 1e-3
"""Least critical friction that is compared: below it, objects are only tried at one friction."""


def test_the_gate_twists_a_box_and_predictions_with_torsion_are_what_simulation_finds():
    body, found = grasps("wedge", FRICTION, 1, FREE, "tilted")
    setup = Setup(physics=PhysicsSettings(torsion_m=SHARE * body.radius))
    twists = [check for check in checked(ClosureCase.of(setup, FRICTION, body.radius)).checks
              if "twist at which" in check.name]  # fmt: skip
    assert len(twists) == 2
    (grasp,) = found
    verdict = sv.validate(body, grasp, FRICTION, agenda=Agenda(limits="bisection"), setup=setup)
    assert verdict.held
    assert verdict.controls
    assert verdict.controls_let_go
    critical = verdict.critical_friction
    expected = gc.critical_friction(grasp, torsion_m=setup.physics.torsion_m)
    assert RESISTED < expected <= grasp.critical_friction * (1.0 + ROUNDED)
    assert critical.predicted == expected
    assert critical.simulated == pytest.approx(expected, rel=AGREED)
    for wrench in verdict.wrenches:
        assert wrench.simulated_limit is not None
        assert wrench.let_go_at.share == pytest.approx(1.0, abs=AGREED)
        assert wrench.required_friction <= FRICTION * (1.0 + 1e-6)


@pytest.mark.slow
def test_the_gate_refuses_settings_that_turn_too_early():
    physics = PhysicsSettings(torsion_m=7e-4, impratio=10.0)
    checks = measured(ClosureCase.of(Setup(physics=physics))).checks
    failed = [check.name for check in checks if not check.passed]
    assert any("twist at which" in name for name in failed)


def test_executions_refuse_torsion():
    body, (grasp, *_) = grasps("wedge", FRICTION, 1)
    settings = sv.ExecutionSettings(mass_kg=0.1)
    physics = PhysicsSettings(torsion_m=0.01, gravity=(0.0, 0.0, -9.80665))
    with pytest.raises(gc.InputError, match="torsion_m must be zero"):
        sv.execute(body, grasp, FRICTION, settings, physics=physics)
