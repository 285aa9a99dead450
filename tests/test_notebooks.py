"""The notebooks run by themselves, and show what they are kept with."""

import re

import pytest

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

from tests.notebooks import NOTEBOOKS, executed, printed  # noqa: E402 - after the skips

pytestmark = pytest.mark.slow
SMALL = 130_000
"""Largest notebook [bytes], its pictures included: they are kept as text in the repository."""


def test_there_are_three():
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_what_it_is_kept_with(path, tmp_path):
    kept = nbformat.read(path, as_version=4)
    shown = printed(kept)
    assert printed(executed(path, tmp_path)) == shown
    assert sum(map(len, shown)) >= 6
    assert not list(tmp_path.iterdir())
    assert path.stat().st_size < SMALL


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_asks_for_nothing_else(path):
    """It imports what graspproof itself needs, and reads no file that it has not made."""
    cells = nbformat.read(path, as_version=4).cells
    code = "\n".join(cell.source for cell in cells if cell.cell_type == "code")
    imported = set(re.findall(r"^(?:import|from) (\w+)", code, re.MULTILINE))
    standard = {"json", "pathlib", "re", "subprocess", "sys", "tempfile"}
    ours = {"grasp_core", "scenes", "sim_validate"}
    assert imported <= standard | ours | {"numpy", "trimesh", "IPython", "pytest"}
    assert not re.search(r"https?:|\.\./|example_object", code)
