"""Files beside the code say the same: version, Pythons, paths and what a wheel holds."""

import json
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

import grasp_core as gc

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PACKAGES = ("grasp_core", "scenes", "sim_validate")
PYTHONS = ["3.11", "3.12", "3.13"]


def test_the_version_stands_in_one_place_and_in_the_citation():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["version"] == gc.__version__
    assert cited["license"] == PROJECT["license"]
    assert PROJECT["dynamic"] == ["version"]
    assert "version" not in PROJECT


def test_the_citation_has_what_its_format_demands():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors"} <= set(cited)
    assert cited["cff-version"] == "1.2.0"
    (paper,) = cited["references"]
    assert {"type", "title", "authors"} <= set(paper)


def test_the_pythons_of_the_workflows_are_those_of_the_project():
    named = re.findall(r"Python :: (3\.\d+)$", "\n".join(PROJECT["classifiers"]), re.MULTILINE)
    assert named == PYTHONS
    lowest, above = re.findall(r"3\.\d+", PROJECT["requires-python"])
    assert (lowest, above) == (PYTHONS[0], "3.14")
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "tests.yml").read_text())["jobs"]
    assert jobs["everyday"]["strategy"]["matrix"]["python"] == PYTHONS
    assert jobs["wheel"]["strategy"]["matrix"]["python"] == PYTHONS


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_every_step_of_a_workflow_runs_or_uses_something_that_exists(path):
    workflow = yaml.safe_load(path.read_text())
    extras = set(PROJECT["optional-dependencies"])
    steps = [step for job in workflow["jobs"].values() for step in job["steps"]]
    assert len(steps) >= 7
    for step in steps:
        assert ("run" in step) != ("uses" in step)
        for script in re.findall(r"\.ci/[a-z.]+", step.get("run", "")):
            assert (ROOT / script).is_file()
        for named in re.findall(r"'\.\[([\w,-]+)\]'", step.get("run", "")):
            assert set(named.split(",")) <= extras


def test_containers_have_a_python_of_the_project_and_a_user_of_their_own():
    docker = (ROOT / "Dockerfile").read_text()
    (python,) = re.findall(r"^FROM python:(3\.\d+)", docker, re.MULTILINE)
    assert python in PYTHONS
    assert re.search(r"^USER graspproof$", docker, re.MULTILINE)
    editors = json.loads((ROOT / ".devcontainer.json").read_text())
    assert re.match(r"python:(3\.\d+)", editors["image"])[1] in PYTHONS


def test_forms_for_reports_can_be_read():
    forms = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
    assert len(forms) == 2
    for form in forms:
        said = yaml.safe_load(form.read_text())
        assert {"name", "description", "body"} <= set(said)
        assert all(part["attributes"]["label"] for part in said["body"])


@pytest.mark.slow
@pytest.mark.skipif(find_spec("hatchling") is None, reason="the wheel is built with hatchling")
def test_a_wheel_holds_the_packages_with_their_types_and_no_tests(tmp_path):
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.startswith(f"graspproof-{gc.__version__}-py3-none-any")
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.partition("/")[0] for name in names}
    assert tops == {*PACKAGES, f"graspproof-{gc.__version__}.dist-info"}
    for package in PACKAGES:
        assert f"{package}/py.typed" in names
        assert f"{package}/__init__.pyi" in names
        ours = (p for p in (ROOT / package).rglob("*.py*") if p.suffix in {".py", ".pyi"})
        assert {str(p.relative_to(ROOT)) for p in ours} <= set(names)
    assert not any("test_" in Path(name).name for name in names)
