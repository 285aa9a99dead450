import json
import re
from dataclasses import replace

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.kit.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.changing import changed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verdicts")
    plan = gc.plan(scenes.example_object("wedge"), 0.5, limit=2)
    gc.save_grasps(folder / "grasps.json", plan)
    assert main(["validate", str(folder / "grasps.json"), "--out", str(folder)]) == 0
    return folder


def test_verdicts_are_loaded_with_their_figures(folder):
    plan, found = gc.load_grasps(folder / "grasps.json"), sv.load_verdicts(folder / "verdicts.json")
    assert found.object_sha256 == plan.body.content_sha256
    assert (found.friction, found.complete, len(found)) == (0.5, True, 2)
    for grasp, verdict in zip(plan, found, strict=True):
        assert verdict is found[grasp.id]
        assert verdict.held
        assert verdict.outcome is sv.Outcome.HELD
        assert verdict.controls_let_go
        assert verdict.predicted_critical_friction == pytest.approx(grasp.critical_friction)
        assert 0.0 <= verdict.displacement_m < 1e-3
    assert found[0] is found.verdicts[0]
    assert found[-1].id in found
    assert found[1:] == replace(found, verdicts=found.verdicts[1:])
    with pytest.raises(KeyError, match="c-9"):
        found["c-9"]
    assert sv.load_verdicts(folder / "verdicts.json") == found


def test_saved_and_live_verdicts_have_the_same_names(folder):
    plan, found = gc.load_grasps(folder / "grasps.json"), sv.load_verdicts(folder / "verdicts.json")
    live, saved = sv.validate(plan.body, plan[0], 0.5), found[0]
    for name in ("id", "held", "outcome", "good", "controls_let_go", "mismatches",
                 "predicted_critical_friction", "simulated_critical_friction"):  # fmt: skip
        assert getattr(saved, name) == getattr(live, name), name
    assert saved.good
    assert not replace(saved, mismatches=("it slipped",)).good
    assert not replace(saved, controls_let_go=False).good


def test_verdicts_are_a_table(folder):
    found = sv.load_verdicts(folder / "verdicts.json")
    none = replace(found[1], simulated_critical_friction=None, held=False)
    table = replace(found, verdicts=(found[0], none)).to_dataframe()
    assert table.index.tolist() == [verdict.id for verdict in found]
    assert table["good"].tolist() == [True, False]
    assert table["good"].dtype == table["held"].dtype == bool
    assert table["outcome"].tolist() == ["held", "held"]
    assert table["predicted_critical_friction"].iloc[0] == found[0].predicted_critical_friction
    assert table["simulated_critical_friction"].isna().tolist() == [False, True]


def test_a_control_that_holds_is_told(folder, tmp_path):
    document = json.loads((folder / "verdicts.json").read_text())
    control = next(iter(document["verdicts"][0]["controls"].values()))
    control["held"], control["wrenches"][0]["outcome"] = True, "held"
    document["summary"].update(
        controls_held=1, controls_let_go=document["summary"]["controls_let_go"] - 1
    )
    path = tmp_path / "verdicts.json"
    path.write_text(json.dumps(document))
    assert [verdict.controls_let_go for verdict in sv.load_verdicts(path)] == [False, True]


def _slipped(document):
    document["verdicts"][0]["wrenches"][2]["outcome"] = "slipped"


def _repeated(document):
    document["verdicts"][0]["robustness"] = {
        "trials": 3, "held": 3, "pass_rate_interval": [0, 1], "noise": {},
        "not_held": [{"trial": 1, "outcome": "slipped", "wrench": "+force_x"}],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda each: each["verdicts"][0].update(held=False), "held: False contradicts the outc"),
        (lambda each: each["verdicts"][0].update(outcome="slipped"), "outcome: slipped contradict"),
        (_slipped, "outcome: held contradicts the trials, which say slipped"),
        (lambda each: next(iter(each["verdicts"][0]["controls"].values())).update(held=True),
         r"controls.\w+.held: True contradicts the trials of this control"),
        (_repeated, "robustness.held: 3 contradicts the number of repeats"),
        (lambda each: each["summary"].update(controls_let_go=0), "summary.controls_let_go: expec"),
        (lambda each: each["verdicts"].pop(), "summary.grasps: expected 1, as the verdicts say"),
    ],
    ids=["held", "outcome", "trial", "control", "repeats", "summary", "one fewer"],
)  # fmt: skip
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
