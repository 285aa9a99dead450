"""Executions in baselines: what an entry keeps, what counts as worse, and what is demanded."""

import dataclasses
import json

import numpy as np
import pytest

import grasp_core as gc
from sim_validate.baselines.baseline import (
    baseline_from_json,
    baseline_to_json,
    execution_entry,
    fields_of,
    properties_of,
)
from sim_validate.baselines.check import Checked, Measured, demanded
from sim_validate.baselines.compare import Status, compare
from sim_validate.baselines.settings import How, of_settings, settings_of
from sim_validate.baselines.suite import suite_from_tables
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.settings import AskedExecution
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    ExecutionControl,
    ExecutionTrial,
)
from tests.sim_validate.baselines.test_compare import BEFORE, ENTRY, OTHER_ARITHMETIC, OTHERS

TRIAL = ExecutionTrial(
    "weight", "weight", True, "stuck", 1e-7, 1e-3, 1e-4, 2.5, 2.75, 2.49, 0.00125
)
EXECUTION = Execution(
    mass_kg=0.3, squeeze=np.zeros((4, 3)), load_multiple=2.7,
    trials=(TRIAL, dataclasses.replace(TRIAL, kind="lift", name="lift", slip_m=2e-7)),
    controls=(ExecutionControl("friction 0.9", True, 0.95),), skipped=(),
)  # fmt: skip
KEPT = execution_entry(ExecutedGrasp("c", "concurrent", "1f", EXECUTION))
LOST = {"lost": ("lift",)}


def executed(**changed):
    entry = dataclasses.replace(ENTRY, execution=dataclasses.replace(KEPT, **changed))
    return dataclasses.replace(BEFORE, entries=(entry,))


def found(after, before=None):
    (finding,) = compare(before or executed(), after)
    return finding


def test_an_entry_keeps_the_worst_of_all_trials():
    assert (KEPT.trials, KEPT.lost, KEPT.survived) == (2, (), True)
    assert (KEPT.slip_m, KEPT.predicted_first_slip, KEPT.load_multiple) == (2e-7, 2.5, 2.7)
    endless = dataclasses.replace(TRIAL, predicted_first_slip=float("inf"))
    entry = execution_entry(
        ExecutedGrasp("c", "", "1f", dataclasses.replace(EXECUTION, trials=(endless,)))
    )
    assert entry.predicted_first_slip is None
    unheld = execution_entry(ExecutedGrasp("c", "", "1f", None, "no squeeze"))
    assert (unheld.survived, unheld.reason, unheld.slip_m) == (False, "no squeeze", None)
    with pytest.raises(ValueError, match="counts more than"):
        dataclasses.replace(KEPT, trials=0, lost=("lift",))


def test_a_baseline_with_executions_is_the_same_when_it_is_read_again():
    baseline = executed(**LOST)
    assert baseline_from_json(baseline_to_json(baseline), "b.json") == baseline
    assert "execution" not in baseline_to_json(BEFORE)
    assert properties_of(fields_of(baseline.entries[0]))["execution.lost"] == ("lift",)
    broken = json.loads(baseline_to_json(baseline))
    broken["grasps"][0]["execution"]["trials"] = -1
    with pytest.raises(gc.InputError, match=r"grasps\[0\]\.execution\.trials"):
        baseline_from_json(json.dumps(broken), "b.json")


def test_settings_of_executions_are_kept():
    asked = AskedExecution.of_table({"density_kg_m3": 500.0, "trials": ["stop"]})
    how = How(Setup(), Agenda(), asked)
    assert of_settings(settings_of(how), "b.json") == how
    assert "execution" not in settings_of(How(Setup(), Agenda()))
    with pytest.raises(gc.InputError, match=r"b\.json: settings: execution: expected one of mass"):
        of_settings(settings_of(how) | {"execution": {}}, "b.json")


@pytest.mark.parametrize(
    ("changed", "status", "reason"),
    [
        ({}, Status.SAME, ""),
        (LOST, Status.REGRESSED, "execution: survived -> did not survive"),
        (LOST, Status.REGRESSED, "execution: no longer survived: lift"),
        ({"predicted_first_slip": 2.0}, Status.REGRESSED, "predicted_first_slip: 2.5 -> 2"),
        ({"predicted_first_slip": None}, Status.IMPROVED, "predicted_first_slip: 2.5 -> None"),
        ({"load_multiple": 3.0}, Status.IMPROVED, "execution: load_multiple: 2.7 -> 3"),
        ({"displacement_m": 2e-3}, Status.REGRESSED, "execution: displacement_m"),
        ({"controls_let_go": 0}, Status.REGRESSED, "controls that did not slip: 0 -> 1"),
        ({"trials": 1}, Status.REGRESSED, "execution: trials: 2 -> 1"),
        ({"reason": "no squeeze", "trials": 0}, Status.REGRESSED, "executed -> no squeeze"),
    ],
)
def test_what_is_worse_or_better(changed, status, reason):
    finding = found(executed(**changed))
    assert finding.status is status
    assert any(reason in each for each in finding.reasons) or not reason


def test_what_was_lost_and_is_kept_now_is_better():
    assert found(executed(), executed(**LOST)).status is Status.IMPROVED
    unheld = executed(reason="no squeeze", trials=0)
    assert found(executed(), unheld).status is Status.IMPROVED


@pytest.mark.parametrize("first_slip", [0.8, 0.0])
@pytest.mark.parametrize("other", [OTHERS, OTHER_ARITHMETIC])
def test_how_far_contacts_slide_counts_only_where_numbers_round_alike(other, first_slip):
    sliding = {"predicted_first_slip": first_slip, "slip_m": 3e-3}
    before, after = executed(**sliding), executed(**sliding | {"slip_m": 4e-3})
    assert found(after, before).status is Status.REGRESSED
    assert found(dataclasses.replace(after, **other), before).status is Status.WITHIN
    lost = dataclasses.replace(executed(**sliding, **LOST), **other)
    assert found(lost, before).status is Status.REGRESSED


def test_what_must_survive_fails_although_the_baseline_did_not_survive_either():
    same = compare(executed(**LOST), executed(**LOST))
    done = demanded(Checked(same, Measured(BEFORE, {}, {}), "exactly"))
    assert [each.status for each in done.findings] == [Status.REGRESSED]
    assert "must survive" in done.findings[0].reasons[0]
    kept = Checked(compare(executed(), executed()), Measured(BEFORE, {}, {}), "exactly")
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
