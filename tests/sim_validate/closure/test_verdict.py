"""Verdicts as a file holds them: the same values, and no contradictions."""

import json
import re
from dataclasses import replace

import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.changing import at, changed


@pytest.fixture(scope="module")
def folder(wedge_plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("verdicts")
    (folder / "grasps.json").write_text(wedge_plan.read_text())
    more = ["--repeats", "2", "--limits", "ramp", "--random-wrenches", "1"]
    assert main(["validate", str(folder / "grasps.json"), "--out", str(folder), *more]) == 0
    return folder


def test_a_file_gives_the_verdicts_that_were_made(folder):
    plan, found = gc.load_grasps(folder / "grasps.json"), sv.load_verdicts(folder / "verdicts.json")
    agenda = sv.Agenda(repeats=2, limits="ramp", random_wrenches=1)
    made = sv.validate_all(plan.body, plan, agenda=agenda)
    assert found.verdicts == made
    assert found.text() == (folder / "verdicts.json").read_text()
    assert found == sv.Verdicts.of(plan.body, 0.5, made[0].gate, made)
    assert all(verdict.good and verdict.scene is None for verdict in found)
    assert all(control.control.certificate.verify() for one in found for control in one.controls)
    assert found[1:] == replace(found, verdicts=found.verdicts[1:])
    assert found[found[1].id] is found[1]


def test_verdicts_are_a_table(folder):
    table = sv.load_verdicts(folder / "verdicts.json").to_dataframe()
    assert table["good"].tolist() == [True, True]
    assert table["outcome"].tolist() == ["held", "held"]
    assert table["mismatches"].tolist() == [0, 0]
    assert (table["simulated_critical_friction"] > 0.0).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (at("verdicts", 0, held=False), r"verdicts\[0\].held: false contradicts"),
        (at("verdicts", 0, outcome="slipped"), "outcome: 'slipped' contradicts"),
        (at("verdicts", 0, "wrenches", 2, outcome="slipped"), "outcome: 'held' contradicts"),
        (at("verdicts", 0, "controls", 0, held=True), r"controls\[0\].held: true contradicts"),
        (at("verdicts", 0, "robustness", held=1), "robustness.held: 1 contradicts"),
        (at("summary", controls_let_go=0), "summary.controls_let_go: 0 contradicts"),
        (lambda each: each["verdicts"].pop(), "summary.grasps: 2 contradicts"),
    ],
    ids=["held", "outcome", "trial", "control", "repeats", "summary", "one fewer"],
)
def test_verdicts_that_contradict_themselves_are_refused_by_all_who_read_them(
    change, said, folder, tmp_path, capsys
):
    for name in ("grasps.json", "verdicts.json"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    path = tmp_path / "verdicts.json"
    document = changed(path, change)
    with pytest.raises(gc.InputError, match=rf"verdicts.json: .*{said}"):
        sv.load_verdicts(path)
    with pytest.raises(gc.InputError, match=said):
        sv.write_report(tmp_path, jobs=1)
    assert main(["replay", str(path), "--grasp", document["verdicts"][0]["id"]]) == Exit.INPUT
    assert re.search(said, " ".join(capsys.readouterr().err.split()))


@pytest.mark.parametrize("outcome", ["held", "timeout"])
def test_a_control_that_does_not_let_go_is_told(folder, outcome):
    document = json.loads((folder / "verdicts.json").read_text())
    verdict = document["verdicts"][0]
    verdict["controls"][0]["trials"][0]["outcome"] = outcome
    verdict["controls"][0].update(held=outcome == "held", let_go=False)
    verdict.update(controls_let_go=False, good=False)
    document["summary"]["controls_held"] += 1
    document["summary"]["controls_let_go"] -= 1
    found = sv.Verdicts.of_text(json.dumps(document))
    assert [verdict.controls_let_go for verdict in found] == [False, True]
    assert found[0].controls_held == (verdict["controls"][0]["name"],)
    assert (
        found.summary["controls_held"] + found.summary["controls_let_go"]
        == (found.summary["controls"])
    )
