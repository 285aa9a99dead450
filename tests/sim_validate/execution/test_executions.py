"""Executions come back from their file as they were, and files that are wrong are refused."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.execution.trials import Skipped
from sim_validate.execution.verdict import ExecutedGrasp, ExecutionControl, best_executed, ended
from sim_validate.settings import ExecutionSettings
from tests.sim_validate.changing import at
from tests.sim_validate.execution.executed import (
    BODY,
    ENOUGH,
    GRASPS,
    SETTINGS,
    execution,
    executions,
    trial,
)


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "executions.json"
    path.write_text(executions().text())
    return sv.load_executions(path)


def test_executions_come_back_as_they_were(saved):
    assert saved == executions()
    assert saved.text() == executions().text()
    assert saved.settings == SETTINGS
    assert saved.object_sha256 == BODY.content_sha256
    assert saved.grasps == GRASPS != (*GRASPS[:2], replace(GRASPS[2], reason="another"))
    assert saved[0].execution.enough == saved[0].enough == ENOUGH
    assert not sv.Executions.of_text(executions(complete=False).text()).complete


def test_executions_are_a_table(saved):
    table = saved.to_dataframe()
    assert table.index.tolist() == [grasp.id for grasp in saved]
    assert table["survived"].dtype == table["controls_let_go"].dtype == bool
    assert table["survived"].tolist() == [False, True, False]
    for grasp in saved[:2]:
        row = table.loc[grasp.id]
        assert (row.trials, row.lost) == (len(grasp.trials), len(grasp.execution.lost))
        assert row.least_predicted_loss == min(each.predicted_loss for each in grasp.trials)
        assert row.payload_kg == grasp.execution.load_multiple * SETTINGS.mass_kg
    assert np.isnan(table.iloc[2].payload_kg)
    assert table.iloc[2].least_predicted_loss == 0.0


def test_the_file_holds_the_impulse_that_was_used():
    usual = replace(executions(), settings=replace(SETTINGS, knock_n_s=None))
    assert json.loads(usual.text())["settings"]["knock_n_s"] == 0.05
    assert usual.settings.knock_n_s == 0.05


BAD = {
    "slip": (at("executions", 0, "trials", 0, slip_m=None),
             r"trials\[0\]: trial lift: slip_m, displacement_m and turn_rad are infinite"),
    "fell": (at("executions", 0, "trials", 0, survived=True),
             r"trial lift: survived is false where the fate is dropped"),
    "opposite": (at("executions", 0, survived=True),
                 r"executions\[0\]\.survived: true contradicts"),
    "one finger": (
        at("executions", 0, squeeze_n=[[1, 0, 0]], tip_radius_m=[0.004]),
        r"executions\[0\]\.squeeze_n must have a force for each contact, at least two, got 1",
    ),
    "reason": (at("executions", 0, reason="heavy"),
               r"executions\[0\]: .* an execution, or a reason .* both"),
    "neither": (at("executions", 2, reason=None),
                r"executions\[2\]: .* an execution, or a reason .* neither"),
    "radii": (at("executions", 0, tip_radius_m=[0.004] * 3),
              r"executions\[0\]\.tip_radius_m must have one entry for each of the 4 of squeeze"),
    "needless": (
        lambda d: d["executions"][1].update(enough=d["executions"][0]["enough"]),
        r"executions\[1\]\.enough must be None \(null\), as every trial was survived",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_contradicts_itself_is_refused_with_the_field(name, tmp_path):
    change, said = BAD[name]
    document = json.loads(executions().text())
    change(document)
    path = tmp_path / "x.json"
    path.write_text(json.dumps(document))
    with pytest.raises(gc.InputError, match=rf"x\.json: .*{said}"):
        sv.load_executions(path)


@pytest.mark.parametrize(
    ("survived", "expected"), [((), False), ((True,), True), ((True, True, False), False)]
)
def test_an_object_survives_if_it_survives_every_trial_of_at_least_one(survived, expected):
    trials = (trial("knock", survived=each) for each in survived)
    assert execution(*trials, skipped=(Skipped("lift", "no room"),)).survived is expected


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
    moved = {"displacement_m": 1e-3 * moved_mm, "turn_rad": math.radians(turned_deg)}
    found = trial("knock", survived=survived, fate=fate, **moved)
    assert ended(found, ExecutionSettings(0.3)) == said


def executed(name, losses, *, survived=True, let_go=True):
    trials = [trial("knock", survived=survived, predicted_loss=loss) for loss in losses]
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
