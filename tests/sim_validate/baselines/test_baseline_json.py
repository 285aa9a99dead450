import dataclasses
import json
import math

import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.baselines.baseline import (
    baseline_from_json,
    baseline_to_json,
    entry_of,
    read_baseline,
    write_baseline,
)
from sim_validate.baselines.settings import How, of_settings, settings_of
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import Outcome
from tests.sim_validate.baselines.test_compare import BEFORE, ENTRY
from tests.sim_validate.rigs import grasps


def test_a_baseline_comes_back_and_has_a_line_for_each_grasp():
    other = dataclasses.replace(
        ENTRY, id="p", simulated_limit_n=None, simulated_critical_friction=None
    )
    baseline = dataclasses.replace(BEFORE, entries=(ENTRY, other))
    text = baseline_to_json(baseline)
    assert baseline_from_json(text, "b.json") == baseline
    assert baseline_to_json(baseline_from_json(text, "b.json")) == text
    lines = [line for line in text.splitlines() if '"contacts_sha256"' in line]
    assert len(lines) == 2
    assert [json.loads(line.strip().rstrip(","))["id"] for line in lines] == [ENTRY.id, "p"]


def spoiled(change):
    record = json.loads(baseline_to_json(BEFORE))
    change(record)
    return json.dumps(record)


def with_entry(**changed):
    return spoiled(lambda record: record["grasps"][0].update(changed))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "expected a baseline, as"),
        (spoiled(lambda r: r.update(friction="x")), "friction: expected a number, got"),
        (spoiled(lambda r: r.update(taste=1)), "taste: unknown key; known keys are "),
        (with_entry(limit_n=float("nan")), "grasps\\[0\\].limit_n"),
        (
            with_entry(outcome="slipped"),
            "grasps\\[0\\]: .*`outcome` slipped contradicts `not_held`",
        ),
        (
            with_entry(controls_let_go=9),
            "grasps\\[0\\]: .*`not_held` or `controls_let_go` counts more than",
        ),
        (with_entry(noisy_not_held=[100]), "grasps\\[0\\]: .*numbers below `noisy_trials`"),
        (spoiled(lambda r: r["grasps"].append(r["grasps"][0])), "the same id"),
    ],
)
def test_what_is_no_baseline_is_refused_with_the_field(text, message):
    with pytest.raises(gc.InputError, match=message) as raised:
        baseline_from_json(text, "b.json")
    assert str(raised.value).startswith("b.json: ")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"surface": "foo"}, "settings.surface"),
        ({"noise": {"mass": -0.1}}, "mass"),
        ({"taste": 1}, "settings.taste"),
    ],
)
def test_settings_that_are_none_are_refused(change, message):
    settings = settings_of(How(Setup(), Agenda()))
    assert of_settings(settings, "b.json") == How(Setup(), Agenda())
    with pytest.raises(gc.InputError, match=message) as raised:
        of_settings(settings | change, "b.json")
    assert str(raised.value).startswith("b.json: ")


def test_only_baselines_are_overwritten(tmp_path):
    path = tmp_path / "grasps.json"
    path.write_text('{"grasps": []}')
    with pytest.raises(gc.InputError, match="is not a baseline and will not be overwritten"):
        write_baseline(path, BEFORE)
    assert path.read_text() == '{"grasps": []}'
    write_baseline(tmp_path / "b.json", BEFORE)
    write_baseline(tmp_path / "b.json", BEFORE)
    assert read_baseline(tmp_path / "b.json") == BEFORE


def test_what_no_number_is_kept_as_none():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    verdict = sv.validate(body, grasp, 0.5)
    first, second, *rest = verdict.wrenches
    for order in ((math.nan, 1.0), (1.0, math.nan), (math.inf, 1.0)):
        spoilt = [
            dataclasses.replace(trial, hold=dataclasses.replace(trial.hold, displacement_m=value))
            for trial, value in zip((first, second), order, strict=True)
        ]
        found = dataclasses.replace(verdict, wrenches=(*spoilt, *rest))
        assert entry_of(grasp, found, body.radius).displacement_m is None
    assert entry_of(grasp, verdict, body.radius).displacement_m > 0.0


def test_controls_that_were_not_let_go_are_counted():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    verdict = sv.validate(body, grasp, 0.5)
    control = verdict.controls[0]
    hold = dataclasses.replace(control.tried[0].hold, outcome=Outcome.ERROR)
    tried = (dataclasses.replace(control.tried[0], hold=hold), *control.tried[1:])
    found = dataclasses.replace(
        verdict, controls=(dataclasses.replace(control, tried=tried), *verdict.controls[1:])
    )
    entry = entry_of(grasp, found, body.radius)
    assert (entry.controls, entry.controls_let_go) == (len(verdict.controls), entry.controls - 1)
