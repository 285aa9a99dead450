"""Executions come back from their file as they were, and files that are wrong are refused."""

import json
from dataclasses import asdict, fields, is_dataclass, replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.execution.executions_json import executions_from_json, executions_to_json
from tests.sim_validate.execution.executed import BODY, GRASPS, SETTINGS, executions_text


def same(one, other):
    """Whether two values are the same, arrays and all."""
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, each.name), getattr(other, each.name)) for each in fields(one)
        )
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return np.array_equal(one, other)


def test_executions_come_back_as_they_were(tmp_path):
    path = tmp_path / "executions.json"
    path.write_text(executions_text())
    found = sv.load_executions(path)
    assert found.settings == SETTINGS
    assert found.friction == 0.5
    assert found.complete
    assert found.object_sha256 == BODY.content_sha256
    assert len(found) == 3
    assert same(found.grasps, GRASPS)
    assert not same(found.grasps, (*GRASPS[:2], replace(GRASPS[2], reason="another")))
    assert found["p-0-1-2-3"].survived
    assert list(found[:2]) == [found[0], found.grasps[1]]
    assert not found["c-0-1-2-3"].controls_let_go
    assert found["p-0-1-2-3"].trials == found["p-0-1-2-3"].execution.trials != ()
    assert found[2].trials == ()
    with pytest.raises(KeyError, match="nobody"):
        found["nobody"]
    again = executions_to_json(
        BODY, found.friction, found.settings, found.grasps, complete=found.complete
    )
    assert again == executions_text()
    assert not executions_from_json(executions_text(complete=False)).complete


def test_executions_are_a_table(tmp_path):
    path = tmp_path / "executions.json"
    path.write_text(executions_text())
    found = sv.load_executions(path)
    table = found.to_dataframe()
    assert table.index.tolist() == [grasp.id for grasp in found]
    assert table["survived"].dtype == table["controls_let_go"].dtype == bool
    assert table["survived"].tolist() == [False, True, False]
    for grasp in found[:2]:
        row = table.loc[grasp.id]
        assert row.least_predicted_loss == min(each.predicted_loss for each in grasp.trials)
        assert row.payload_kg == grasp.execution.load_multiple * SETTINGS.mass_kg
    assert np.isnan(table.iloc[2].payload_kg)
    assert table.iloc[2].least_predicted_loss == 0.0


def test_the_file_is_strict_json_with_all_settings():
    document = json.loads(executions_text(), parse_constant=pytest.fail)
    assert document["settings"] == json.loads(json.dumps(asdict(SETTINGS)))
    assert document["versions"]["mujoco"]
    first, second, third = document["executions"]
    assert first["tip_radius_m"] == [0.004, 0.004, 0.004, 0.005]
    assert first["enough"] == {
        "load_multiple": 1.5, "push_n": 12.5, "stiffness_n_per_m": 4000.0, "predicted_loss": None,
        "reason": None,
    }  # fmt: skip
    assert second["enough"] is None
    assert third["enough"]["reason"] == "it is proved"
    assert first["physics"]["timestep"] == 0.00125
    assert first["controls"][1]["first_slip"] is None
    assert second["trials"][0]["simulated_first_slip"] is None
    assert [each["survived"] for each in (first, second, third)] == [False, True, False]
    assert third["reason"] == "no squeeze carries the weight"
    assert document["summary"] == {
        "grasps": 3, "grasps_survived": 1, "grasps_without_squeeze": 1, "trials": 3,
        "trials_survived": 2, "controls": 4, "controls_let_go": 2,
    }  # fmt: skip


def test_the_file_holds_the_impulse_that_was_used():
    usual = replace(SETTINGS, knock_n_s=None)
    text = executions_to_json(BODY, 0.5, usual, GRASPS, complete=True)
    assert json.loads(text)["settings"]["knock_n_s"] == 0.05
    assert executions_from_json(text).settings == usual.used


def of_trial(**changes):
    return lambda document: document["executions"][0]["trials"][0].update(changes)


def of_first(**changes):
    return lambda document: document["executions"][0].update(changes)


BAD = {
    "kind": (of_trial(kind="throw"), r"executions\[0\]\.trials\[0\]\.kind: expected 'weight'"),
    "slip": (
        of_trial(slip_m=None),
        r"trial lift: slip_m, displacement_m and turn_rad are infinite",
    ),
    "fell": (of_trial(survived=True), r"trial lift: survived is false where the fate is dropped"),
    "opposite": (of_first(survived=True), r"executions\[0\]\.survived: expected false"),
    "no squeeze": (of_first(squeeze_n=None), r"executions\[0\]\.squeeze_n: null is not allowed"),
    "tolerance": (
        lambda d: d["executions"][0]["physics"].pop("tolerance"),
        r"executions\[0\]\.physics\.tolerance: missing; add it",
    ),
    "hand": (
        lambda d: d["settings"]["hand"].update(down=[0, 0, 0]),
        r"settings\.hand\.down must be",
    ),
    "schema": (lambda d: d.update(schema=2), "schema: expected 1, got 2: a newer graspproof"),
    "physics": (of_first(physics={"timestep": 1}), r"executions\[0\]\.physics\.timestep must be"),
    "reason": (of_first(reason="heavy"), r"executions\[0\]\.load_multiple: expected nothing"),
    "radii": (of_first(tip_radius_m=[0.004] * 3), r"executions\[0\]\.tip_radius_m must have"),
    "half": (
        of_first(
            enough={
                "load_multiple": 2,
                "push_n": 1,
                "stiffness_n_per_m": None,
                "predicted_loss": 1,
                "reason": None,
            }
        ),
        r"executions\[0\]\.enough: expected a push with its stiffness",
    ),
    "needless": (
        lambda d: d["executions"][1].update(enough=d["executions"][0]["enough"]),
        r"executions\[1\]\.enough: expected null, as every trial was survived",
    ),
    "other": (lambda d: d.update(executions=d["versions"]), "executions: expected a list"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_is_wrong_is_refused_with_the_field(name, tmp_path):
    change, said = BAD[name]
    document = json.loads(executions_text())
    change(document)
    path = tmp_path / "x.json"
    path.write_text(json.dumps(document))
    with pytest.raises(gc.InputError, match=rf"x\.json: .*{said}"):
        sv.load_executions(path)
