"""The plugin in a project of somebody else's."""

import json
import os
import subprocess
import sys
from xml.etree import ElementTree

import pytest

import grasp_core as gc
from grasp_core.records import plan_to_json
from scenes.objects import example_object
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
    from sim_validate.setup import Agenda, NamedWrench
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
    push = NamedWrench("push", [0.0, 0.0, 900.0, 0.0, 0.0, 0.0])
    assert_stable(body, grasp, 0.5, agenda=Agenda(wrenches=(push,)))
"""


def pytest_in(folder, *arguments):
    """Run pytest as a user would; what it printed and its exit code."""
    line = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    plain = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
    ran = subprocess.run(
        line, cwd=folder, env=plain, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    return ran.returncode, ran.stdout.decode()


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
    for path in blessed.iterdir():
        if path.is_file():
            (tmp_path / path.name).write_bytes(path.read_bytes())
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
    assert f"graspproof baseline check {baseline}" in said
    assert "gone: missing" in said
    assert "Traceback" not in said


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
