"""What an execution says of its trials."""

import math

import numpy as np
import pytest

from sim_validate.execution.trials import Skipped
from sim_validate.execution.verdict import (
    Execution,
    ExecutionControl,
    ExecutionTrial,
    losses_in_words,
    trial_in_words,
)


def trial(kind, survived, fate="stuck"):
    return ExecutionTrial(kind, kind, survived, fate, 0.0, 0.0, 0.0, 2.0, 3.0, 2.0)


def execution(*trials, controls=()):
    skipped = (Skipped("lift", "no room"),)
    return Execution(0.3, np.zeros((4, 3)), 2.0, trials, controls, skipped)


@pytest.mark.parametrize(
    ("survived", "expected"), [((), False), ((True,), True), ((True, True, False), False)]
)
def test_an_object_survives_if_it_survives_every_trial_of_at_least_one(survived, expected):
    assert execution(*(trial("knock", each) for each in survived)).survived is expected


def test_survival_is_counted_by_kind():
    found = execution(
        trial("knock", True), trial("stop", False), trial("knock", False), trial("knock", True)
    )
    assert found.survival("knock") == (2, 3)
    assert found.survival("stop") == (0, 1)
    assert found.survival("lift") == (0, 0)
    assert [one.kind for one in found.of_kind("knock")] == ["knock"] * 3


def test_controls_let_go_only_if_all_do():
    held, lost = ExecutionControl("a", False, 1.2), ExecutionControl("b", True, 0.9)
    assert execution(controls=(lost, lost)).controls_let_go
    assert not execution(controls=(lost, held)).controls_let_go


def test_only_a_dropped_object_is_dropped():
    fates = {fate: trial("knock", False, fate).dropped for fate in ("stuck", "slipped", "dropped")}
    assert fates == {"stuck": False, "slipped": False, "dropped": True}


def test_losses_are_told_in_millimetres_and_degrees_as_limits_are_given():
    lost = ExecutionTrial(
        "knock", "knock -y", False, "slipped", 2e-3, 0.123, math.radians(107.5), 0.8, 0.9, 0.75
    )
    assert losses_in_words(execution(trial("weight", True), lost)) == [trial_in_words(lost)]
    assert trial_in_words(lost) == (
        "knock -y: slipped, moved 123 mm and turned 108 degrees; first slip predicted at 0.8 of "
        "the load, simulated at 0.75; loss predicted at 0.9"
    )
