"""What an execution says of its trials."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sim_validate.execution.trials import Skipped
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    ExecutionControl,
    ExecutionTrial,
    best_executed,
    ended,
)
from sim_validate.settings.executions import ExecutionSettings


def trial(kind, survived, fate="stuck"):
    return ExecutionTrial(kind, kind, survived, fate, 0.0, 0.0, 0.0, 2.0, 3.0, 2.0, 1e-3)


def execution(*trials, controls=()):
    skipped = (Skipped("lift", "no room"),)
    return Execution(0.3, np.zeros((4, 3)), 2.0, trials, controls, skipped)


@pytest.mark.parametrize(
    ("survived", "expected"), [((), False), ((True,), True), ((True, True, False), False)]
)
def test_an_object_survives_if_it_survives_every_trial_of_at_least_one(survived, expected):
    assert execution(*(trial("knock", each) for each in survived)).survived is expected


@pytest.mark.parametrize(
    ("survived", "fate", "moved_mm", "turned_deg", "said"),
    [
        (True, "slipped", 4.0, 4.0, "slipped"),
        (False, "dropped", 90.0, 90.0, "dropped"),
        (False, "stuck", 4.0, 15.9, "turned too far without a slip"),
        (False, "slipped", 6.0, 4.0, "moved too far after a slip"),
        (False, "stuck", 6.0, 15.9, "moved and turned too far without a slip"),
    ],
)
def test_an_object_that_was_kept_and_failed_is_said_to_have_left_its_place(
    survived, fate, moved_mm, turned_deg, said
):
    found = ExecutionTrial("knock", "knock -y", survived, fate, 0.0, 1e-3 * moved_mm,
                           math.radians(turned_deg), 2.0, 3.0, 2.0, 1e-3)  # fmt: skip
    assert ended(found, ExecutionSettings(0.3)) == said


def executed(name, losses, *, survived=True, let_go=True):
    trials = [replace(trial("knock", survived), predicted_loss=loss) for loss in losses]
    controls = (ExecutionControl("a", let_go, 0.9),)
    return ExecutedGrasp(name, "pencil", "", execution(*trials, controls=controls))


def test_the_best_grasp_survived_and_has_the_largest_of_the_least_losses():
    """Grasps that were lost, whose control held, or that have no squeeze do not count."""
    grasps = [
        executed("a", [1.5, 9.0]), executed("b", [1.8, 1.7]), executed("c", [1.7, 2.0]),
        executed("d", [5.0], survived=False), executed("e", [6.0], let_go=False),
        ExecutedGrasp("f", "pencil", "", None, "no squeeze"), executed("g", []),
    ]  # fmt: skip
    assert [grasp.least_predicted_loss for grasp in grasps] == [1.5, 1.7, 1.7, 5.0, 6.0, 0.0, 0.0]
    assert best_executed(grasps) == grasps[1]
    assert best_executed(grasps[3:]) is None
    endless = executed("h", [math.inf])
    assert best_executed([*grasps, endless]) == endless
