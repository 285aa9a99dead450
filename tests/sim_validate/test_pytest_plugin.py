"""The plugin in a project of somebody else's."""

import json
import os
import shlex
import subprocess
import sys
from xml.etree import ElementTree

import pytest

import grasp_core as gc
from grasp_core.records import grasps_from_json, plan_to_json
from scenes.objects import example_object
from sim_validate.baselines.comparing import Status
from sim_validate.baselines.suite import suite_from_toml
from sim_validate.cli import Exit, main
from sim_validate.files import write_text

CODE = """
import grasp_core as gc
import pytest
import scenes

def test_it_holds(assert_stable):
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
    assert assert_stable(body, grasp, 0.5).held

def test_it_does_not(assert_stable):
    import dataclasses
    from sim_validate.setup import NamedWrench
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
    push = NamedWrench("push", [0.0, 0.0, 900.0, 0.0, 0.0, 0.0])
    assert_stable(body, grasp, 0.5, wrenches=[push])
"""


MARKED = """
import pytest
import scenes

@pytest.mark.grasp("grasps.json")
def test_of_a_file(grasp_case, assert_stable):
    assert assert_stable(grasp_case).held

@pytest.mark.grasp(object="wedge", friction=0.4, limit=1, families=("pencil",))
def test_planned(grasp_case, assert_stable):
    assert grasp_case.friction == 0.4
    assert grasp_case.grasp.family == "pencil"

@pytest.mark.grasp(object="box.obj", unit="mm")
def test_a_mesh(grasp_case):
    assert grasp_case.body.radius < 0.1

def test_unmarked(grasp_case):
    pass
"""
BOX = "\n".join(
    [f"v {x} {y} {z}" for x in (0, 30) for y in (0, 20) for z in (0, 10)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
)
DEMANDS = """
import pytest

pytestmark = pytest.mark.grasp(object="wedge")

def test_good_enough(grasp_case, assert_stable):
    assert_stable(grasp_case, min_margin=0.3, trials=5, min_pass_rate=0.5)

def test_close_to_slipping(grasp_case, assert_stable):
    assert_stable(grasp_case, min_margin=0.49)

def test_often_dropped(grasp_case, assert_stable):
    from sim_validate.noise.draws import Noise
    assert_stable(grasp_case, trials=20, noise=Noise(mass=0.5), min_pass_rate=0.99)
"""


def pytest_in(folder, *arguments):
    """Run pytest as a user would; what it printed and its exit code."""
    line = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    plain = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
    ran = subprocess.run(
        line, cwd=folder, env=plain, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    return ran.returncode, ran.stdout.decode()


def copied(project, folder):
    for path in project.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())


@pytest.fixture(scope="module")
def blessed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project")
    body = example_object("wedge")
    plan = gc.plan(body, 0.5, families=("concurrent",), limit=2)
    write_text(folder / "grasps.json", plan_to_json(body, plan))
    write_text(folder / "wedge.grasps.toml", 'grasps = "grasps.json"\n')
    code, said = pytest_in(folder, "--grasp-bless")
    assert code == 0, said
    assert (folder / "wedge.baseline.json").is_file()
    return folder


def test_grasps_that_stay_as_they_were_pass(blessed, tmp_path):
    code, said = pytest_in(blessed, "--junitxml", str(tmp_path / "j.xml"))
    assert code == 0, said
    assert "2 passed" in said
    cases = ElementTree.parse(tmp_path / "j.xml").getroot().iter("testcase")  # noqa: S314 - ours
    for case in cases:
        kept = {each.get("name"): each.get("value") for each in case.iter("property")}
        assert kept["status"] == "same"
        assert kept["outcome"] == "held"


@pytest.mark.slow
def test_they_pass_on_several_workers_too(blessed):
    code, said = pytest_in(blessed, "-n", "2")
    assert code == 0, said
    assert "2 passed" in said


def test_a_regression_says_what_was_and_what_is(blessed, tmp_path):
    copied(blessed, tmp_path)
    baseline = tmp_path / "wedge.baseline.json"
    record = json.loads(baseline.read_text())
    record["grasps"][0].update(limit_n=1e3)
    record["grasps"].append(record["grasps"][1] | {"id": "gone"})
    baseline.write_text(json.dumps(record))
    code, said = pytest_in(tmp_path)
    assert code == 1
    assert "2 failed, 1 passed" in said
    name = record["grasps"][0]["id"]
    assert f"{name}: regressed" in said
    assert "limit_n: 1000 -> " in said
    assert "predicted" in said
    grasps = tmp_path / "grasps.json"
    assert f"graspproof baseline check {baseline} --grasps {grasps}" in said
    assert f"replay {baseline} --grasp {name} --grasps {grasps} --out replay" in said
    assert "gone: missing" in said
    assert "Traceback" not in said


def test_a_grasp_that_slips_says_at_which_wrench_and_how_to_replay_it(blessed, tmp_path):
    """A wrench in the baseline's settings that no finger can hold."""
    copied(blessed, tmp_path)
    baseline = tmp_path / "wedge.baseline.json"
    record = json.loads(baseline.read_text())
    record["settings"]["wrenches"] = {"far too much": [0.0, 0.0, 90.0, 0.0, 0.0, 0.0]}
    baseline.write_text(json.dumps(record))
    code, said = pytest_in(tmp_path)
    assert code == 1
    assert "held -> slipped at far too much" in said
    assert "first wrench that was not held: far too much [0.0, 0.0, 90.0" in said
    assert "predicted limit 0." in said
    line = next(line for line in said.splitlines() if "graspproof replay" in line)
    words = shlex.split(line.split("graspproof ", 1)[1])
    assert "--wrench=far too much" in words
    assert main([*words[:-1], str(tmp_path / "replay"), "-q"]) == Exit.NEGATIVE
    assert (tmp_path / "replay" / "trace.csv").is_file()


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["alone", "xdist"])
def test_a_report_has_a_line_for_each_grasp(blessed, tmp_path, workers):
    copied(blessed, tmp_path)
    baseline = tmp_path / "wedge.baseline.json"
    record = json.loads(baseline.read_text())
    record["grasps"][0].update(limit_n=1e3)
    baseline.write_text(json.dumps(record))
    write_text(tmp_path / "test_mine.py", CODE)
    code, said = pytest_in(tmp_path, "--grasp-report", "out/report", *workers)
    assert code == 1, said
    found = json.loads((tmp_path / "out" / "report" / "report.json").read_text())["grasps"]
    assert sorted(line["status"] for line in found) == ["regressed", "same", "stable", "unstable"]
    regressed = next(line for line in found if line["status"] == "regressed")
    assert regressed["before"]["limit_n"] == 1e3
    assert regressed["after"]["limit_n"] < 10.0
    assert "graspproof replay" in regressed["why"]
    page = (tmp_path / "out" / "report" / "index.html").read_text()
    assert page.count("<tr") == 5
    assert "was 1000" in page
    assert "1 regressed, 1 same, 1 stable, 1 unstable" in page


def test_marked_tests_run_with_each_grasp(blessed, tmp_path):
    copied(blessed, tmp_path)
    write_text(tmp_path / "test_marked.py", MARKED)
    write_text(tmp_path / "box.obj", BOX)
    code, said = pytest_in(tmp_path, "-v", "--strict-markers", "test_marked.py")
    assert code == 1, said
    names = [grasp.id for grasp in grasps_from_json((tmp_path / "grasps.json").read_text()).grasps]
    for name in names:
        assert f"test_of_a_file[{name}] PASSED" in said
    assert said.count("test_planned[p-") == 1
    assert said.count("test_a_mesh[") == 1
    assert "test_unmarked: grasp_case needs @pytest.mark.grasp" in said
    assert f"{2 + len(names)} passed, 1 error" in said


@pytest.mark.parametrize(
    ("marker", "message"),
    [
        ("", "needs a grasps.json, or object="),
        ("object='wedge', taste=1", "got 'taste'"),
        ("'grasps.json', limit=1", "beside a file takes friction; got 'limit'"),
        ("'a.json', 'b.json'", "takes one file of grasps"),
        ("3", "takes one file of grasps"),
        ("'nowhere.json'", "nowhere.json"),
        ("object='wedg'", "did you mean wedge"),
        ("object='wedge', friction='0.5'", "friction must be a number, got '0.5'"),
        ("object='wedge', limit='2'", "a setting is of the wrong kind"),
        ("object='box', cones='normal', families=('pencil',)", "there is no grasp of box"),
    ],
)
def test_a_wrong_marker_is_named(tmp_path, marker, message):
    write_text(
        tmp_path / "test_it.py",
        f"import pytest\n@pytest.mark.grasp({marker})\ndef test_it(grasp_case): pass\n",
    )
    code, said = pytest_in(tmp_path)
    assert code == 2
    assert message in said
    assert "Traceback" not in said
    assert "During handling" not in said


def test_more_can_be_asked_for(tmp_path):
    write_text(tmp_path / "test_demands.py", DEMANDS)
    code, said = pytest_in(tmp_path)
    assert code == 1, said
    assert "2 failed, 1 passed" in said
    assert "less than 0.49 above the predicted critical one" in said
    assert "asked for are 0.99" in said
    assert "of 20 held (" in said


def test_without_a_baseline_it_is_said_how_to_make_one(blessed, tmp_path):
    for name in ("grasps.json", "wedge.grasps.toml"):
        (tmp_path / name).write_bytes((blessed / name).read_bytes())
    code, said = pytest_in(tmp_path)
    assert code == 1
    assert "there is no baseline yet: pytest --grasp-bless" in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "grasps: expected the path"),
        ("grasp = 1", "no such setting"),
        ('grasps = "g.json"\nstrict = 1', "strict: expected bool"),
        ('grasps = "nowhere.json"', "nowhere.json"),
        ("grasps = ", "not TOML"),
    ],
)
def test_a_bad_file_is_named(tmp_path, text, message):
    write_text(tmp_path / "x.grasps.toml", text)
    code, said = pytest_in(tmp_path)
    assert code != 0
    assert message in said


def test_assert_stable_in_code(tmp_path):
    write_text(tmp_path / "test_mine.py", CODE)
    code, said = pytest_in(tmp_path, "-v", "--junitxml", "j.xml")
    assert code == 1
    assert "1 failed, 1 passed" in said
    assert "push [0.0, 0.0, 900.0" in said
    assert "predicted limit" in said
    assert ".critical_friction" in (tmp_path / "j.xml").read_text()


def test_it_is_silent_where_it_is_not_used(tmp_path):
    write_text(
        tmp_path / "test_light.py",
        """
import sys

def test_nothing_heavy_is_imported():
    assert not {"numpy", "mujoco", "tyro"} & set(sys.modules)
""",
    )
    code, said = pytest_in(tmp_path)
    assert code == 0, said
    assert "1 passed" in said


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("assert_stable(grasp_case, min_pass_rate=0.9)", "give trials, too"),
        ("assert_stable(grasp_case, trials=2, min_pass_rate=80)", "from 0 to 1, got 80"),
        ("assert_stable(grasp_case, min_margin=float('nan'))", "min_margin must be from 0"),
        ("assert_stable(grasp_case, min_margin='0.2')", "min_margin must be from 0"),
        ("assert_stable(grasp_case, trial=2)", "assert_stable takes wrenches, trials"),
        ("assert_stable(grasp_case, wrenches=[[1, 2]])", "must be NamedWrench values"),
        ("assert_stable(grasp_case.grasp)", "expected a grasp_case"),
        ("assert_stable(grasp_case, friction=0.01)", "needs friction above"),
    ],
)
def test_demands_that_are_none_are_refused(tmp_path, call, message):
    write_text(
        tmp_path / "test_it.py",
        "import pytest\n@pytest.mark.grasp(object='wedge')\n"
        f"def test_it(grasp_case, assert_stable):\n    {call}\n",
    )
    code, said = pytest_in(tmp_path)
    assert code == 1
    assert message in said


def test_other_frictions_and_grasps_from_anywhere(tmp_path):
    write_text(
        tmp_path / "test_it.py",
        """
import pytest
@pytest.mark.grasp(object='wedge')
def test_it(grasp_case, assert_stable):
    body, grasp = grasp_case.body, grasp_case.grasp
    assert assert_stable(grasp_case, friction=0.3).friction == 0.3
    assert assert_stable(body, grasp).friction == 0.5
    assert assert_stable(body, grasp, 0.4).friction == 0.4
    assert assert_stable(body, grasp, friction=0.4).friction == 0.4
""",
    )
    code, said = pytest_in(tmp_path)
    assert code == 0, said


def test_blessing_keeps_what_the_baseline_was_made_with(blessed, tmp_path):
    copied(blessed, tmp_path)
    task = {"wrenches": [{"name": "lift", "force_n": [0, 0, -0.1]}]}
    write_text(tmp_path / "task.json", json.dumps(task))
    grasps, baseline = (str(tmp_path / name) for name in ("grasps.json", "wedge.baseline.json"))
    asked = ("--wrenches", str(tmp_path / "task.json"), "--trials", "2", "--seed", "7")
    assert main(["baseline", "record", grasps, "-o", baseline, *asked, "-q"]) == Exit.GOOD
    before = (tmp_path / "wedge.baseline.json").read_text()
    code, said = pytest_in(tmp_path, "--grasp-bless")
    assert code == 0, said
    assert (tmp_path / "wedge.baseline.json").read_text() == before
    assert '"lift"' in before


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("trials = 3", "trials: 0 -> 3"),
        ("seed = 5", "seed: 0 -> 5"),
        ('wrenches = "task.json"', "wrenches.lift: None -> "),
        ('setup = "setup.toml"', "setup.hold.hold_s: 0.4 -> 0.3"),
    ],
)
def test_settings_that_the_baseline_was_not_made_with_are_not_compared(
    blessed, tmp_path, line, reason
):
    copied(blessed, tmp_path)
    task = {"wrenches": [{"name": "lift", "force_n": [0, 0, -0.1]}]}
    write_text(tmp_path / "task.json", json.dumps(task))
    write_text(tmp_path / "setup.toml", "[hold]\nhold_s = 0.3\n")
    path = write_text(tmp_path / "wedge.grasps.toml", f'grasps = "grasps.json"\n{line}\n')
    suite = suite_from_toml(path)
    for name in suite.ids:
        (finding,) = suite.tested(name).findings
        assert finding.status is Status.NOT_COMPARABLE
        assert finding.reasons[0].startswith(reason)
    suite.bless()
    suite = suite_from_toml(path)
    for name in suite.ids:
        (finding,) = suite.tested(name).findings
        assert finding.status is Status.SAME


def test_what_fails_before_a_test_begins_is_in_the_report_once(tmp_path):
    write_text(
        tmp_path / "test_it.py",
        """
import pytest
import grasp_core as gc
import scenes
from sim_validate import NamedWrench

@pytest.fixture
def held(assert_stable):
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
    assert_stable(body, grasp, wrenches=[NamedWrench("push", [0, 0, 900, 0, 0, 0])])

def test_it(held):
    pass
""",
    )
    code, said = pytest_in(tmp_path, "--grasp-report", "report")
    assert code == 1, said
    found = json.loads((tmp_path / "report" / "report.json").read_text())["grasps"]
    assert [line["status"] for line in found] == ["unstable"]


def test_other_projects_see_nothing_of_it(tmp_path):
    write_text(
        tmp_path / "conftest.py",
        """
def pytest_runtest_logreport(report):
    assert not any("grasp" in name for name in vars(report)), vars(report)
""",
    )
    write_text(tmp_path / "test_plain.py", "def test_it(): pass\n")
    code, said = pytest_in(tmp_path, "-W", "error")
    assert code == 0, said
    after = said.split("collected 1 item")[1]
    assert "grasp" not in after
    assert {path.name for path in tmp_path.iterdir()} <= {
        "conftest.py",
        "test_plain.py",
        "__pycache__",
    }
