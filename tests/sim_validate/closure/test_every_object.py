"""Slow: every built-in object, planned and simulated."""

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.closure.controls import FRICTION_SHARE, LEAST_FRICTION

NAMES = [n for n in scenes.example_names() if "FACES" not in n] + [
    f"random-{faces}-{seed}" for faces, seed in ((8, 3), (16, 1), (24, 2), (40, 1))
]


@pytest.mark.slow
@pytest.mark.more
@pytest.mark.timeout(900)
@pytest.mark.parametrize("friction", [0.3, 0.5, 0.8])
def test_all_planned_grasps_of_built_in_objects_hold_and_controls_do_not(friction):
    """Some two or three fingers never hold, so every grasp has that control; one of low friction
    exists where the grasp needs any."""
    grasps = controls = 0
    for name in NAMES:
        body = scenes.example_object(name)
        for grasp in gc.plan(body, friction, limit=6).grasps:
            verdict = sv.validate(body, grasp, friction)
            assert verdict.held, (name, grasp.id, verdict.outcome)
            kinds = {trial.control.name for trial in verdict.controls}
            assert "fingers_removed" in kinds, (name, grasp.id)
            needs_friction = FRICTION_SHARE * verdict.critical_friction.predicted >= LEAST_FRICTION
            assert ("low_friction" in kinds) == needs_friction, (name, grasp.id)
            assert verdict.controls_let_go, (name, grasp.id)
            grasps, controls = grasps + 1, controls + len(verdict.controls)
    assert controls >= grasps >= 90
