"""Executions come back from their file as they were, and files that are wrong are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from tests.sim_validate.execution.executed import BODY, ENOUGH, GRASPS, SETTINGS, executions


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


def of_trial(**changes):
    return lambda document: document["executions"][0]["trials"][0].update(changes)


def of_first(**changes):
    return lambda document: document["executions"][0].update(changes)


BAD = {
    "slip": (
        of_trial(slip_m=None),
        r"trials\[0\]: trial lift: slip_m, displacement_m and turn_rad are infinite",
    ),
    "fell": (of_trial(survived=True), r"trial lift: survived is false where the fate is dropped"),
    "opposite": (of_first(survived=True), r"executions\[0\]\.survived: true contradicts"),
    "no squeeze": (
        lambda d: d["executions"][0].pop("squeeze_n"),
        r"executions\[0\]\.squeeze_n: missing; add it",
    ),
    "one finger": (
        of_first(squeeze_n=[[1, 0, 0]], tip_radius_m=[0.004]),
        r"executions\[0\]\.squeeze_n must have a force for each contact, at least two, got 1",
    ),
    "reason": (of_first(reason="heavy"), r"executions\[0\]: .* an execution, or a reason .* both"),
    "neither": (
        lambda d: d["executions"][2].update(reason=None),
        r"executions\[2\]: .* an execution, or a reason .* neither",
    ),
    "radii": (
        of_first(tip_radius_m=[0.004] * 3),
        r"executions\[0\]\.tip_radius_m must have one entry for each of the 4 of squeeze",
    ),
    "needless": (
        lambda d: d["executions"][1].update(enough=d["executions"][0]["enough"]),
        r"executions\[1\]\.enough must be None \(null\), as every trial was survived",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_contradicts_itself_is_refused_with_the_field(name, tmp_path):
    change, said = BAD[name]
    document = json.loads(executions().text())
    change(document)
    path = tmp_path / "x.json"
    path.write_text(json.dumps(document))
    with pytest.raises(gc.InputError, match=rf"x\.json: .*{said}"):
        sv.load_executions(path)
