import dataclasses
import json
import math

import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.files.text_files import write_text
from sim_validate.baselines.baseline import Baseline, KeptGrasp, read_baseline, write_baseline
from sim_validate.engine.held_or_let_go import Outcome
from tests.sim_validate.baselines.test_compare import BEFORE, ENTRY, entry
from tests.sim_validate.changing import at, changed
from tests.sim_validate.rigs import grasps


def test_a_baseline_comes_back_and_has_a_line_for_each_grasp():
    other = entry("p", simulated_limit_n=None, displacement_m=math.nan)
    baseline = dataclasses.replace(BEFORE, entries=(ENTRY, other))
    text = baseline.text()
    assert Baseline.of_text(text) == baseline
    assert Baseline.of_text(text).text() == text
    lines = [line for line in text.splitlines() if '"contacts_sha256"' in line]
    assert len(lines) == 2
    assert [json.loads(line.strip().rstrip(","))["id"] for line in lines] == [ENTRY.id, "p"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (at(grasps=[]), "grasps: expected at least one grasp"),
        (at(grasps_file="/etc/passwd"), "grasps_file: expected a path"),
        (at("settings", "setup", surface="foo"), "settings.setup.surface"),
        (at("settings", "noise", mass=-0.1), "settings.noise.mass"),
        (
            at("grasps", 0, outcome="slipped"),
            r"grasps\[0\]: .*`outcome` slipped contradicts `not_held`",
        ),
        (lambda record: record["grasps"].append(record["grasps"][0]), "the same id"),
    ],
)
def test_what_is_no_baseline_is_refused_with_the_field(tmp_path, change, message):
    path = write_text(tmp_path / "b.json", BEFORE.text())
    changed(path, change)
    with pytest.raises(gc.InputError, match=message) as raised:
        read_baseline(path)
    assert str(raised.value).startswith(f"{path}: ")


def test_only_baselines_are_overwritten(tmp_path):
    path = tmp_path / "grasps.json"
    path.write_text('{"grasps": []}')
    with pytest.raises(gc.InputError, match="is not a baseline and will not be overwritten"):
        write_baseline(path, BEFORE)
    assert path.read_text() == '{"grasps": []}'
    write_baseline(tmp_path / "b.json", BEFORE)
    write_baseline(tmp_path / "b.json", BEFORE)
    assert read_baseline(tmp_path / "b.json") == BEFORE


def test_a_motion_that_diverged_has_no_size():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    verdict = sv.validate(body, grasp, 0.5)
    first, second, *rest = verdict.wrenches
    for order in ((math.nan, 1.0), (1.0, math.nan)):
        spoilt = [
            dataclasses.replace(trial, hold=dataclasses.replace(trial.hold, displacement_m=value))
            for trial, value in zip((first, second), order, strict=True)
        ]
        found = dataclasses.replace(verdict, wrenches=(*spoilt, *rest))
        assert math.isnan(KeptGrasp.of(found).verdict.displacement_m)
    assert KeptGrasp.of(verdict).verdict.displacement_m > 0.0


def test_controls_that_were_not_let_go_are_counted():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    verdict = sv.validate(body, grasp, 0.5)
    control = verdict.controls[0]
    hold = dataclasses.replace(control.tried[0].hold, outcome=Outcome.ERROR)
    tried = (dataclasses.replace(control.tried[0], hold=hold), *control.tried[1:])
    found = dataclasses.replace(
        verdict, controls=(dataclasses.replace(control, tried=tried), *verdict.controls[1:])
    )
    kept = KeptGrasp.of(found).verdict
    assert (kept.controls, kept.controls_held) == (len(verdict.controls), 1)
