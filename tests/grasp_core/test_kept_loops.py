"""Compiled loops are kept where other environments with the same texts find them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from grasp_core import kept_loops

ROOT = Path(__file__).parents[2]
CALLER, CALLED = "grasp_core.cones.tilting_kernel", "grasp_core.geometry.vectors_kernel"
NOWHERE = "/proc/nowhere"
SCRIPT = f"""
import numpy as np
from grasp_core.compiled import compiled
cross = compiled("{CALLED}").cross
cross(np.zeros(3), np.zeros(3), np.zeros(3))
print(sum(cross.stats.cache_hits.values()))
print(compiled("{CALLER}").half_angles.stats.cache_path)
"""
UNKEPT = """
import numpy as np
from grasp_core.solvers.nearest_point import least_distance
print(least_distance(np.eye(3), -np.ones((1, 3))))
"""


def compiled_in(folder, kept):
    """Compile a loop in a copy of the package; return hits, and where another's code is kept."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(kept)}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=folder, env=environment, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    hits, path = done.stdout.split()
    return int(hits), path


@pytest.fixture(scope="module")
def copies(tmp_path_factory):
    """Two folders with the same package, as two environments have it."""
    folder = tmp_path_factory.mktemp("environments")
    for name in ("one", "two"):
        shutil.copytree(
            ROOT / "grasp_core", folder / name / "grasp_core",
            ignore=shutil.ignore_patterns("__pycache__"), copy_function=shutil.copyfile,
        )  # fmt: skip
    return folder


def test_another_environment_finds_what_one_has_compiled(copies, tmp_path):
    hits, path = compiled_in(copies / "one", tmp_path)
    assert hits == 0
    assert compiled_in(copies / "two", tmp_path) == (1, path)


def test_a_change_of_what_a_kernel_calls_gives_it_another_folder(copies, tmp_path):
    _, path = compiled_in(copies / "one", tmp_path)
    text = copies / "two" / (CALLED.replace(".", "/") + ".py")
    before = text.read_text()
    text.write_text(before.replace("\n\n\n", "\n\n\nCHANGED = True\n\n\n", 1))
    try:
        hits, other = compiled_in(copies / "two", tmp_path)
    finally:
        text.write_text(before)
    assert hits == 0
    assert Path(other).name != Path(path).name
    assert Path(other).name.startswith("tilting_kernel-")


def test_code_that_numba_does_not_keep_runs_without_a_word(tmp_path):
    """Without optimization it holds addresses of this process."""
    environment = {
        **os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_OPT": "0",
    }  # fmt: skip
    done = subprocess.run([sys.executable, "-c", UNKEPT], env=environment, capture_output=True,
                          text=True, check=False)  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "[[-1. -1. -1.]]\n", "")


@pytest.mark.parametrize("home", [NOWHERE, "/proc"])
def test_without_a_home_code_is_kept_beside_the_module(home, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", home)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", NOWHERE)
    monkeypatch.chdir(tmp_path)
    module = tmp_path / "own_kernel.py"
    module.write_text("ONE = 1\n")
    found = kept_loops.folder_for.__wrapped__("own_kernel", str(module))
    assert found is not None
    assert found.parent == tmp_path / "__pycache__"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["__pycache__", "own_kernel.py"]


def test_where_nothing_can_be_written_nothing_is_kept(monkeypatch, tmp_path):
    module = tmp_path / "own_kernel.py"
    module.write_text("ONE = 1\n")
    monkeypatch.setattr(kept_loops, "folders", lambda _: [Path(NOWHERE), Path("/dev/null")])
    assert kept_loops.folder_for.__wrapped__("own_kernel", str(module)) is None


def test_the_users_folder_comes_before_the_one_beside_the_module(monkeypatch, tmp_path):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    users, beside = kept_loops.folders(Path("/a/b_kernel.py"))
    assert users.is_relative_to(tmp_path)
    assert beside == Path("/a/__pycache__")
