"""The package page and what a wheel holds."""

import re
import subprocess
import sys
import zipfile
from email import message_from_bytes
from importlib.util import find_spec
from pathlib import Path

import pytest

import grasp_core as gc

ROOT = Path(__file__).parent.parent
PACKAGES = ("grasp_core", "scenes", "sim_validate")


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
    links = re.findall(r"\]\(([^)\s]+)\)", metadata.get_payload())
    assert all(re.search(rf"/(blob|raw)/v{gc.__version__}/", link) for link in links)
    assert links
    tops = {name.partition("/")[0] for name in names}
    assert tops == {*PACKAGES, f"graspproof-{gc.__version__}.dist-info"}
    for package in PACKAGES:
        assert f"{package}/py.typed" in names
        assert f"{package}/__init__.pyi" in names
        ours = (p for p in (ROOT / package).rglob("*.py*") if p.suffix in {".py", ".pyi"})
        assert {str(p.relative_to(ROOT)) for p in ours} <= set(names)
    assert not any(Path(name).name.startswith("test_") for name in names)
