"""The notebooks run by themselves, and show what they are kept with."""

import pytest

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

from tests.notebooks import NOTEBOOKS, executed, printed  # noqa: E402 - after the skips

pytestmark = pytest.mark.slow
SMALL = 130_000
"""Largest notebook [bytes], its pictures included: they are kept as text in the repository."""


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_what_it_is_kept_with(path, tmp_path):
    kept = nbformat.read(path, as_version=4)
    shown = printed(kept)
    assert printed(executed(path, tmp_path)) == shown
    assert sum(map(len, shown)) >= 6
    assert not list(tmp_path.iterdir())
    assert path.stat().st_size < SMALL
