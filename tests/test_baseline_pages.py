"""What docs/baselines.md says, done as it says it."""

import dataclasses
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from sim_validate.baselines.baseline import Entry, ExecutionEntry
from sim_validate.baselines.compare import EXACT, OTHER_PROCESSOR, OTHER_VERSIONS, Status
from sim_validate.baselines.suite import KINDS, suite_from_toml
from sim_validate.cli.exit_codes import Exit
from sim_validate.main import main
from sim_validate.simulation.noise import Noise
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
    assert (project / "results.xml").is_file()
    (project / "wedge.grasps.toml").write_text(block(FIRST_STEPS, "toml"))
    (project / "test_mine.py").write_text(block(FIRST_STEPS, "py"))
    code, said = run_pytest_alone(project, "--grasp-bless", "wedge.grasps.toml")
    assert code == 0, said
    assert (project / "wedge.baseline.json").is_file()
    code, said = run_pytest_alone(
        project, "--strict-markers", "-W", "error", "--grasp-report", "report"
    )
    assert code == 0, said
    assert "5 passed" in said
    page = (project / "report" / "index.html").read_text()
    assert ">3 same</li>" in page
    assert ">2 stable</li>" in page


def test_the_tests_of_the_page_pass(first_steps):
    project = first_steps(1)
    (project / "test_page.py").write_text(block(PAGE, "python"))
    code, said = run_pytest(project, "test_page.py", "--strict-markers", "-W", "error")
    assert code == 0, said
    assert "4 passed" in said


def test_all_settings_are_shown(tmp_path):
    path = tmp_path / "wedge.grasps.toml"
    path.write_text(block(PAGE, "toml"))
    suite = suite_from_toml(path)
    assert set(re.findall(r"^\[?(\w+)", block(PAGE, "toml"), re.MULTILINE)) >= set(KINDS)
    assert suite.baseline == tmp_path / "wedge.baseline.json"
    assert suite.noise == dataclasses.replace(Noise(), friction=0.1)
    assert suite.survives
    assert suite.execution.settings.trials == ("weight", "lift")


def test_all_fields_and_all_answers_are_described():
    for field in dataclasses.fields(Entry):
        assert f"`{field.name}`" in PAGE
    for field in dataclasses.fields(ExecutionEntry):
        assert f"`{field.name}`" in PAGE
    for status in Status:
        assert f"`{status.value}`" in PAGE


def test_the_bands_are_those_of_the_page():
    rows = dict(re.findall(r"^\| ([^|]+) \| (.+) \|$", PAGE, re.MULTILINE))
    by_analysis = rows["critical friction and limits, by analysis"]
    assert by_analysis.split(" | ") == ["1e-9 of them", "1e-6 of them + 1e-7", "5 %"]
    assert [EXACT.predicted, OTHER_PROCESSOR.predicted, OTHER_VERSIONS.predicted] == [
        1e-9,
        1e-6,
        0.05,
    ]
    assert [EXACT.least, OTHER_PROCESSOR.least] == [0.0, 1e-7]
    assert rows["the same in simulation"].split(" | ")[1] == ".5 % + 1e-7"
    assert [EXACT.simulated, OTHER_PROCESSOR.simulated, OTHER_VERSIONS.simulated] == [
        1e-9,
        5e-3,
        0.05,
    ]
    assert rows["displacement, rotation"] == ".1 um, 1e-6 rad | 1 um, 1e-5 rad | .2 mm, .2 deg"
    assert [OTHER_PROCESSOR.displacement_m, OTHER_PROCESSOR.rotation_rad] == [1e-6, 1e-5]
    assert [EXACT.displacement_m, EXACT.rotation_rad] == [1e-7, 1e-6]
    assert [OTHER_VERSIONS.displacement_m, OTHER_VERSIONS.rotation_rad] == [2e-4, math.radians(0.2)]
    assert [OTHER_PROCESSOR.grey, OTHER_VERSIONS.grey] == [1e-4, 0.02]


def test_noise_is_as_the_page_says():
    said = re.findall(r"\| `--noise-[^|]*\| [^|]* \| ([^|]*) \|", PAGE)
    assert [text.split()[0] for text in said] == [".01", "1", "5", "5"]
    assert Noise() == Noise(0.01, 1.0, 1.0, 0.05, 0.05)


@pytest.mark.slow
@pytest.mark.more
def test_repeated_checks_are_the_same_each_time():
    command = [sys.executable, "-m", "tests.benchmarks.repeats", "--times", "2"]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
    assert ran.stdout.count("2 times: 24 same (") == 3
