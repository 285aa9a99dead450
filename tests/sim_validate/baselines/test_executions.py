"""Executions in baselines: what an entry keeps, what counts as worse, and what is demanded."""

import dataclasses
import json
import math

import pytest

import grasp_core as gc
from sim_validate.baselines.baseline import Baseline, ExecutedFigures, How
from sim_validate.baselines.check import CheckedBaseline, demanded
from sim_validate.baselines.compare import Status, compare
from sim_validate.baselines.suite import suite_from_tables
from sim_validate.execution.verdict import ExecutedGrasp, ExecutionControl
from sim_validate.settings import ExecutionSettings
from tests.sim_validate.baselines.test_compare import BEFORE, ENTRY, OTHER_ARITHMETIC, OTHERS
from tests.sim_validate.execution.executed import execution, trial

MOVED = {"displacement_m": 1e-3, "turn_rad": 1e-4, "predicted_first_slip": 2.5}
EXECUTION = execution(
    trial("weight", slip_m=1e-7, **MOVED), trial("lift", slip_m=2e-7, **MOVED),
    load_multiple=2.7, controls=(ExecutionControl("friction 0.9", True, 0.95),),
)  # fmt: skip
KEPT = ExecutedFigures.of(ExecutedGrasp("c", "concurrent", "1f", EXECUTION))
UNHELD = ExecutedFigures.of(ExecutedGrasp("c", "", "1f", None, "no squeeze"))
LOST = {"lost": ("lift",)}


def with_execution(kept):
    entry = dataclasses.replace(ENTRY, execution=kept)
    return dataclasses.replace(BEFORE, entries=(entry,))


def executed(**changed):
    execution = dataclasses.replace(KEPT.execution, **changed)
    survived = execution.trials > 0 and not execution.lost
    return with_execution(dataclasses.replace(KEPT, execution=execution, survived=survived))


def found(after, before=None):
    (finding,) = compare(before or executed(), after)
    return finding


def test_an_entry_keeps_the_worst_of_all_trials():
    kept = KEPT.execution
    assert (kept.trials, kept.lost, KEPT.survived) == (2, (), True)
    assert (kept.slip_m, kept.predicted_first_slip, kept.load_multiple) == (2e-7, 2.5, 2.7)
    assert (UNHELD.survived, UNHELD.reason, UNHELD.execution) == (False, "no squeeze", None)


def test_a_baseline_with_executions_is_the_same_when_it_is_read_again():
    endless = executed(predicted_first_slip=math.inf, slip_m=math.inf)
    for baseline in (executed(**LOST), endless, with_execution(UNHELD)):
        assert Baseline.of_text(baseline.text()) == baseline
    baseline = executed(**LOST)
    assert baseline.entries[0].properties()["execution.lost"] == ["lift"]


def test_settings_of_executions_are_kept():
    asked = ExecutionSettings(density_kg_m3=500.0, trials=("stop",))
    baseline = dataclasses.replace(BEFORE, settings=How(execution=asked))
    assert Baseline.of_text(baseline.text()) == baseline
    record = json.loads(baseline.text())["settings"]["execution"]
    assert (record["density_kg_m3"], record["trials"]) == (500.0, ["stop"])


@pytest.mark.parametrize(
    ("changed", "status", "reason"),
    [
        ({}, Status.SAME, ""),
        (LOST, Status.REGRESSED, "execution: survived: yes -> no"),
        (LOST, Status.REGRESSED, "execution: no longer survived: lift"),
        ({"predicted_first_slip": 2.0}, Status.REGRESSED, "predicted_first_slip: 2.5 -> 2"),
        ({"predicted_first_slip": math.inf}, Status.IMPROVED, "predicted_first_slip: 2.5 -> inf"),
        ({"slip_m": math.inf}, Status.REGRESSED, "execution: slip_m: 2e-07 -> inf"),
        ({"load_multiple": 3.0}, Status.IMPROVED, "execution: load_multiple: 2.7 -> 3"),
        ({"displacement_m": 2e-3}, Status.REGRESSED, "execution: displacement_m"),
        ({"controls_held": 1}, Status.REGRESSED, "controls that did not slip: 0 -> 1"),
        ({"trials": 1}, Status.REGRESSED, "execution: trials: 2 -> 1"),
    ],
)
def test_what_is_worse_or_better(changed, status, reason):
    finding = found(executed(**changed))
    assert finding.status is status
    assert any(reason in each for each in finding.reasons) or not reason


def test_what_was_lost_and_is_kept_now_is_better():
    assert found(executed(), executed(**LOST)).status is Status.IMPROVED
    endless = {"slip_m": math.inf, "displacement_m": math.inf, "turn_rad": math.inf}
    assert found(executed(), executed(**LOST, **endless)).status is Status.IMPROVED
    assert found(executed(), executed(trials=0, slip_m=0.0)).status is Status.IMPROVED


def test_a_grasp_that_no_squeeze_holds_is_worse_and_the_other_way_round_better():
    finding = found(with_execution(UNHELD))
    assert finding.status is Status.REGRESSED
    assert "execution: reason: none -> no squeeze" in finding.reasons
    assert found(executed(), with_execution(UNHELD)).status is Status.IMPROVED
    assert found(with_execution(UNHELD), with_execution(UNHELD)).status is Status.SAME


@pytest.mark.parametrize("first_slip", [0.8, 0.0])
@pytest.mark.parametrize("other", [OTHERS, OTHER_ARITHMETIC])
def test_how_far_contacts_slide_counts_only_where_numbers_round_alike(other, first_slip):
    sliding = {"predicted_first_slip": first_slip, "slips": True, "slip_m": 3e-3}
    before, after = executed(**sliding), executed(**sliding | {"slip_m": 4e-3})
    assert found(after, before).status is Status.REGRESSED
    assert found(dataclasses.replace(after, **other), before).status is Status.WITHIN
    lost = dataclasses.replace(executed(**sliding, **LOST), **other)
    assert found(lost, before).status is Status.REGRESSED


def test_what_must_survive_fails_although_the_baseline_did_not_survive_either():
    same = compare(executed(**LOST), executed(**LOST))
    done = demanded(CheckedBaseline(same, None, "exactly"))
    assert [each.status for each in done.findings] == [Status.REGRESSED]
    assert "must survive" in done.findings[0].reasons[0]
    kept = CheckedBaseline(compare(executed(), executed()), None, "exactly")
    assert demanded(kept).findings == kept.findings


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"survives": "yes"}, "survives must be true or false"),
        ({"strict": 1}, "strict must be true or false"),
        ({"taste": 1}, "no setting is named"),
        ({"changed_part": {"refuse": 1}}, "changed_part.refuse must be true or false"),
        ({"execution": {"mass_kg": -1.0}}, "execution.mass_kg must be"),
    ],
)
def test_settings_of_a_suite_are_checked(tmp_path, settings, message):
    with pytest.raises(gc.InputError, match=message):
        suite_from_tables({"grasps": "grasps.json", **settings}, tmp_path / "a.grasps.toml")
