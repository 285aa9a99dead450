"""Slow: every built-in object, planned and simulated."""

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.closure.controls import FRICTION_SHARE, LEAST_FRICTION

NAMES = [n for n in scenes.example_names() if "FACES" not in n] + [
    f"random-{faces}-{seed}" for faces, seed in ((8, 3), (16, 1), (24, 2), (40, 1))
]


def hold_all(body, friction, limit):
    """Counts of grasps and controls, after checking that the former hold and the latter do not.

    Some two or three fingers never hold, so every grasp has that control; one of low friction
    exists where the grasp needs any.
    """
    plan = gc.plan(body, friction, limit=limit)
    assert all(counts.rejected == 0 for counts in plan.counts.families.values())
    controls = 0
    for grasp in plan.grasps:
        verdict = sv.validate(body, grasp, friction)
        assert verdict.held, (body.name, grasp.id, verdict.outcome)
        names = {trial.control.name for trial in verdict.controls}
        assert "fingers_removed" in names, (body.name, grasp.id)
        needs_friction = FRICTION_SHARE * verdict.critical_friction.predicted >= LEAST_FRICTION
        assert ("low_friction" in names) == needs_friction, (body.name, grasp.id)
        assert verdict.controls_let_go, (body.name, grasp.id)
        controls += len(verdict.controls)
    return len(plan.grasps), controls


@pytest.mark.slow
@pytest.mark.more
@pytest.mark.timeout(900)
@pytest.mark.parametrize("friction", [0.3, 0.5, 0.8])
def test_all_planned_grasps_of_built_in_objects_hold_and_controls_do_not(friction):
    grasps = controls = 0
    for name in NAMES:
        held, refuted = hold_all(scenes.example_object(name), friction, 6)
        grasps, controls = grasps + held, controls + refuted
    assert controls >= grasps >= 90
