"""Version, package page and what a wheel holds."""

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
PACKAGES = ("grasp_core", "scenes", "sim_validate")


def test_the_version_stands_in_one_place_and_in_the_citation():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["version"] == gc.__version__
    assert cited["license"] == PROJECT["license"]
    assert "version" in PROJECT["dynamic"]
    assert "version" not in PROJECT


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
