"""What docs/baselines.md says, done as it says it."""

import dataclasses
import re
import shlex
from pathlib import Path

import pytest

from grasp_core.settings import for_users
from sim_validate.baselines.suite import Suite, suite_from_toml
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.settings import Noise
from tests import docs_pictures
from tests.sim_validate.plugin.project import run_pytest, run_pytest_alone

ROOT = Path(__file__).parent.parent
BEFORE, FIRST_STEPS, AFTER = re.fullmatch(
    r"(.*\n)## First steps\n(.*?\n)(## .*)", (ROOT / "docs" / "baselines.md").read_text(), re.DOTALL
).groups()
PAGE = BEFORE + AFTER


def block(text, language):
    (found,) = re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)
    return found


@pytest.fixture
def first_steps(tmp_path, monkeypatch):
    """Runs the commands of the first steps in a folder, with so many grasps, and tells which."""
    monkeypatch.chdir(tmp_path)

    def followed(grasps):
        said = block(FIRST_STEPS, "sh")
        assert said.count("\n") == 3
        assert said.count(" --limit 3 ") == 1
        for line in said.replace("--limit 3", f"--limit {grasps}").splitlines():
            assert main([*shlex.split(line)[1:], "-q"]) == Exit.GOOD
        return tmp_path

    return followed


@pytest.mark.slow
def test_the_first_steps_in_a_project_of_somebody_else(first_steps):
    project = first_steps(3)
    (project / "wedge.grasps.toml").write_text(block(FIRST_STEPS, "toml"))
    code, said = run_pytest_alone(project, "--grasp-bless", "wedge.grasps.toml")
    assert code == 0, said
    assert (project / "wedge.baseline.json").is_file()
    code, said = run_pytest_alone(project, "--strict-markers", "-W", "error")
    assert code == 0, said
    assert "3 passed" in said


@pytest.mark.slow
def test_the_tests_of_the_page_pass(first_steps):
    project = first_steps(1)
    (project / "test_page.py").write_text(block(PAGE, "python"))
    code, said = run_pytest(project, "test_page.py", "--strict-markers", "-W", "error")
    assert code == 0, said
    assert "3 passed" in said


@pytest.mark.slow
def test_a_notch_fails_a_test_as_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    docs_pictures.block().export("block.stl")
    assert main(["plan", "block.stl", "--unit", "mm", "--friction", "0.4", "--limit", "3",
                 "--out", ".", "-q"]) == Exit.GOOD  # fmt: skip
    Path("block.grasps.toml").write_text('grasps = "grasps.json"')
    code, said = run_pytest(tmp_path, "--grasp-bless")
    assert code == 0, said
    docs_pictures.block(notched=True).export("block.stl")
    _, said = run_pytest(tmp_path)
    said = said.replace(f"{tmp_path}/", "")
    shown = [line for line in block(PAGE, "text").splitlines() if line.strip() != "..."]
    assert [line for line in shown if line not in said] == []


def test_all_settings_are_shown(tmp_path):
    path = tmp_path / "wedge.grasps.toml"
    path.write_text(block(PAGE, "toml"))
    suite = suite_from_toml(path)
    assert set(re.findall(r"^\[?(\w+)", block(PAGE, "toml"), re.MULTILINE)) >= set(for_users(Suite))
    assert suite.baseline == tmp_path / "wedge.baseline.json"
    assert suite.noise == dataclasses.replace(Noise(), friction=0.1)
    assert suite.survives
    assert suite.execution.trials == ("weight", "lift")
