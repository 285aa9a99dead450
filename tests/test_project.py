"""Files beside the code say the same: version, Pythons, paths and what a wheel holds."""

import json
import re
import subprocess
import sys
import tomllib
import zipfile
from email import message_from_bytes
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

import grasp_core as gc

ROOT = Path(__file__).parent.parent
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = SETTINGS["project"]
HOME = "https://example.org/graspproof"
"""Stands in `pyproject.toml` for the address of the repository, which a release puts in."""
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PACKAGES = ("grasp_core", "scenes", "sim_validate")
PYTHONS = ["3.11", "3.12", "3.13"]


def test_the_version_stands_in_one_place_and_in_the_citation():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["version"] == gc.__version__
    assert cited["license"] == PROJECT["license"]
    assert "version" in PROJECT["dynamic"]
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


def links_of(text):
    """Targets of links and pictures of a page in Markdown."""
    return re.findall(r"\]\(([^)\s]+)\)", text)


def package_page():
    """The README as a package index shows it, by the rules of `pyproject.toml`."""
    plugin = SETTINGS["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    assert plugin["fragments"] == [{"path": "README.md"}]
    text = (ROOT / "README.md").read_text()
    for rule in plugin["substitutions"]:
        text = re.sub(rule["pattern"], rule["replacement"], text)
    return text.replace("$HFPR_VERSION", gc.__version__)


def test_links_of_the_package_page_lead_to_files_of_the_repository_at_this_version():
    readme, page = (ROOT / "README.md").read_text(), package_page()
    assert len(links_of(page)) == len(links_of(readme)) > 30
    pages, pictures = f"{HOME}/blob/v{gc.__version__}/", f"{HOME}/raw/v{gc.__version__}/"
    for before, after in zip(links_of(readme), links_of(page), strict=True):
        is_picture = before.startswith("docs/pictures/") and before.endswith(".webp")
        assert after == (pictures if is_picture else pages) + before
        assert (ROOT / before.partition("#")[0]).is_file()
    assert sum(after.startswith(pictures) for after in links_of(page)) >= 1


def test_only_links_of_the_package_page_differ_from_the_readme():
    links = r"\]\([^)\s]+\)"
    assert re.sub(links, "", package_page()) == re.sub(links, "", (ROOT / "README.md").read_text())


def test_the_release_puts_its_repository_where_pyproject_has_a_placeholder():
    text = (ROOT / "pyproject.toml").read_text()
    assert text.count("https://") == text.count(HOME) >= 4
    assert all(url.startswith(HOME) for url in PROJECT["urls"].values())
    release = (ROOT / ".github" / "workflows" / "release.yml").read_text()
    assert f"s|{HOME}|$GITHUB_SERVER_URL/$GITHUB_REPOSITORY|" in release


@pytest.mark.slow
@pytest.mark.skipif(find_spec("hatch_fancy_pypi_readme") is None, reason="the extra `lint` has it")
def test_a_wheel_holds_the_packages_with_their_types_and_no_tests(tmp_path):
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.startswith(f"graspproof-{gc.__version__}-py3-none-any")
    archive = zipfile.ZipFile(wheel)
    names = archive.namelist()
    (about,) = (name for name in names if name.endswith(".dist-info/METADATA"))
    metadata = message_from_bytes(archive.read(about))
    assert metadata.get_payload() == package_page()
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert [url.partition(", ")[2] for url in metadata.get_all("Project-URL")] == [
        *PROJECT["urls"].values()
    ]
    tops = {name.partition("/")[0] for name in names}
    assert tops == {*PACKAGES, f"graspproof-{gc.__version__}.dist-info"}
    for package in PACKAGES:
        assert f"{package}/py.typed" in names
        assert f"{package}/__init__.pyi" in names
        ours = (p for p in (ROOT / package).rglob("*.py*") if p.suffix in {".py", ".pyi"})
        assert {str(p.relative_to(ROOT)) for p in ours} <= set(names)
    assert not any(Path(name).name.startswith("test_") for name in names)
