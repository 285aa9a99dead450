"""Files of grasps as tests of somebody else's: baselines, blessing, reports."""

import json

import pytest

from grasp_core.files.text_files import write_text
from sim_validate.baselines.compare import Status
from sim_validate.baselines.suite import suite_from_toml
from sim_validate.pytest_plugin import MOST_TOLD, sections
from tests.sim_validate.changing import at, changed
from tests.sim_validate.plugin.project import copied, properties_in, run_pytest, run_pytest_alone

CODE = """
import pytest
from sim_validate import NamedWrench

@pytest.mark.parametrize("push", [0.1, 900.0])
@pytest.mark.grasp(object="wedge", limit=1, families=("concurrent",))
def test_it_is_pushed(grasp_case, assert_stable, push):
    assert_stable(grasp_case, wrenches=[NamedWrench("push", [0.0, 0.0, push, 0.0, 0.0, 0.0])])
"""


def test_grasps_that_stay_as_they_were_pass(blessed, tmp_path):
    code, said = run_pytest(blessed, "--junitxml", str(tmp_path / "j.xml"))
    assert code == 0, said
    assert "2 passed" in said
    for kept in properties_in(tmp_path / "j.xml"):
        assert kept["status"] == "same"
        assert kept["outcome"] == "held"


def test_a_regression_says_what_was_and_what_is(blessed, tmp_path):
    copied(blessed, tmp_path)
    baseline = tmp_path / "wedge.baseline.json"
    record = json.loads(baseline.read_text())
    record["grasps"][0].update(limit_n=1e3)
    record["grasps"].append(record["grasps"][1] | {"id": "gone"})
    baseline.write_text(json.dumps(record))
    code, said = run_pytest(tmp_path)
    assert code == 1
    assert "2 failed, 1 passed" in said
    name = record["grasps"][0]["id"]
    assert f"{name}: regressed" in said
    assert "limit_n: 1000 -> " in said
    assert "predicted" in said
    grasps = tmp_path / "grasps.json"
    assert f"graspproof baseline check {baseline} --grasps {grasps}" in said
    assert f"graspproof validate {grasps} --out seen; graspproof replay seen" in said
    assert f" --grasp {name} --grasps {grasps} --out replay" in said
    assert "gone: missing" in said
    assert "Traceback" not in said


def test_a_grasp_that_slips_says_at_which_wrench(blessed, tmp_path):
    """A wrench in the baseline's settings that no finger can hold."""
    copied(blessed, tmp_path)
    baseline = tmp_path / "wedge.baseline.json"
    push = {"name": "far too much", "wrench": [0.0, 0.0, 90.0, 0.0, 0.0, 0.0]}
    changed(baseline, at("settings", wrenches=[push]))
    code, said = run_pytest(tmp_path)
    assert code == 1
    assert "outcome: held -> slipped" in said
    assert "no longer held: far too much" in said
    assert "first wrench that was not held: far too much [0.0, 0.0, 90.0" in said
    assert "predicted limit 0." in said
    assert "graspproof replay" not in said  # of what `validate` does not simulate
    assert f"graspproof baseline check {baseline}" in said


@pytest.mark.parametrize(
    "workers",
    [pytest.param((), id="alone"), pytest.param(("-n", "2"), id="xdist", marks=pytest.mark.slow)],
)
def test_the_file_of_results_has_the_status_and_figures_of_each_grasp(blessed, tmp_path, workers):
    copied(blessed, tmp_path)

    def one_worse_and_one_better(record):
        for grasp, limit_n in zip(record["grasps"], (1e3, 1e-3), strict=True):
            grasp.update(limit_n=limit_n)

    changed(tmp_path / "wedge.baseline.json", one_worse_and_one_better)
    write_text(tmp_path / "test_mine.py", CODE)
    code, said = (run_pytest_alone if workers else run_pytest)(
        tmp_path, "--junitxml", "j.xml", *workers
    )
    assert code == 1, said
    kept = properties_in(tmp_path / "j.xml")
    ended = [value for each in kept for name, value in each.items() if name.endswith("status")]
    assert sorted(ended) == ["improved", "regressed", "stable", "unstable"]
    regressed = next(each for each in kept if each.get("status") == "regressed")
    assert float(regressed["limit_n"]) < 10.0
    assert "push [0.0, 0.0, 900.0" in said
    assert "better than in the baseline: limit_n: 0.001 -> " in said
    assert "graspproof replay" in said


def test_a_bad_file_is_named(tmp_path):
    write_text(tmp_path / "x.grasps.toml", "")
    code, said = run_pytest(tmp_path)
    assert code != 0
    assert "grasps: missing; add it" in said


def test_settings_that_the_baseline_was_not_made_with_are_not_compared(blessed, tmp_path):
    copied(blessed, tmp_path)
    task = {"wrenches": [{"name": "lift", "force_n": [0, 0, -0.1]}]}
    write_text(tmp_path / "task.json", json.dumps(task))
    write_text(tmp_path / "setup.toml", "[fingers]\nfingertip_radius_m = 0.003\n")
    path = write_text(
        tmp_path / "wedge.grasps.toml",
        'grasps = "grasps.json"\nrepeats = 2\nseed = 5\nwrenches = "task.json"\n'
        'setup = "setup.toml"\n',
    )
    suite = suite_from_toml(path)
    (finding,) = suite.tested(suite.ids[0]).findings
    assert finding.status is Status.NOT_COMPARABLE
    said = " ".join(finding.reasons)
    for reason in ("repeats: 0 -> 2", "seed: 0 -> 5", "wrenches.lift: None -> ",
                   "setup.fingers.fingertip_radius_m: None -> 0.003"):  # fmt: skip
        assert reason in said


SEEN = """
def pytest_runtest_logreport(report):
    assert not any("grasp" in name for name in vars(report)), vars(report)
"""
PLAIN = """
import sys

def test_nothing_heavy_is_imported():
    assert not {"numpy", "mujoco", "tyro"} & set(sys.modules)
"""


@pytest.mark.slow
def test_other_projects_see_nothing_of_it_and_import_nothing_heavy(tmp_path):
    files = {"conftest.py": SEEN, "test_plain.py": PLAIN}
    for name, text in files.items():
        write_text(tmp_path / name, text)
    code, said = run_pytest_alone(tmp_path, "-W", "error")
    assert code == 0, said
    assert "grasp" not in said.split("collected 1 item")[1]
    assert {path.name for path in tmp_path.iterdir()} <= {*files, "__pycache__"}


NOTE = "part.obj has changed: face 3 moved"


def line(told="", note=""):
    said = {"mesh_note": note, "grasp_change": told}
    return [("g-1.status", "same"), *(each for each in said.items() if each[1])]


def test_grasps_stand_below_the_part_that_they_were_tested_on():
    lines = [line("b same", note=NOTE), line("a same", note=NOTE), line(note="z.obj: not found")]
    assert sections(lines) == [
        ("meshes of grasps", [NOTE, "  a same", "  b same", "z.obj: not found"])
    ]


def test_a_long_list_is_cut():
    lines = [line(f"{number:03d} same", note=NOTE) for number in range(MOST_TOLD + 3)]
    ((_, texts),) = sections(lines)
    assert len(texts) == 1 + MOST_TOLD + 1
    assert texts[-1] == "  and 3 more; --junitxml FILE lists all"
