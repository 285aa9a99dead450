"""How inner loops are declared, kept, and loaded where numba is as it should be, and where not."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from grasp_core.compiled import compiled, copy_of, folders, is_kept, loop, state_of, why_not_kept
from grasp_core.errors import InputError

ROOT = Path(__file__).parents[2]
KERNEL = "grasp_core.solvers.lp_kernel"
CALLER, CALLED = "grasp_core.cones.tilting_kernel", "grasp_core.geometry.vectors_kernel"
NOWHERE = "/proc/nowhere"
SCRIPT = f"""
import numpy as np
from grasp_core.compiled import compiled, is_kept
cross = compiled("{CALLED}").cross
cross(np.zeros(3), np.zeros(3), np.zeros(3))
print(sum(cross.stats.cache_hits.values()), is_kept("{CALLED}"))
print(compiled("{CALLER}").half_angles.py_func.__code__.co_filename)
"""
UNKEPT = """
import numpy as np
from grasp_core.solvers.qp import least_distance
print(least_distance(np.eye(3), -np.ones(3)))
"""


def half(x):
    return x / 2.0


def inverse(x):
    return 1.0 / x


def inverse_or_infinity(x):
    return 1.0 / x


def test_a_kernel_is_loaded_compiled_and_kept():
    assert state_of(compiled(KERNEL).solve) == "kept"


def test_without_a_folder_a_loop_is_compiled_but_not_kept(monkeypatch):
    monkeypatch.setattr("grasp_core.compiled.copy_of", lambda *_: None)
    declared = loop()(half)
    assert declared(3.0) == 1.5
    assert len(declared.signatures) == 1
    assert state_of(declared) == "not kept"


def test_division_by_zero_is_an_error_unless_it_is_asked_for():
    with pytest.raises(ZeroDivisionError):
        loop()(inverse)(0.0)
    assert loop("numpy")(inverse_or_infinity)(0.0) == float("inf")


def test_numba_can_leave_loops_to_python(monkeypatch):
    monkeypatch.setattr("numba.core.config.DISABLE_JIT", True)
    assert state_of(loop()(half)) == "interpreted"
    assert loop()(half)(3.0) == 1.5


@pytest.mark.parametrize(
    "error", [ImportError("no llvmlite"), ValueError("NUMBA_NUM_THREADS"), OSError("no such file")]
)
def test_a_numba_that_cannot_be_loaded_is_named_with_what_to_do(monkeypatch, error):
    class Broken:
        def find_spec(self, name, *_):
            if name == KERNEL:
                raise error

    monkeypatch.delitem(sys.modules, KERNEL, raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    with pytest.raises(InputError, match=f"numba can be loaded, got: {error}; unset"):
        compiled.__wrapped__(KERNEL)


def said_in(folder, script, **settings):
    """What a script says that finds the package in a folder."""
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(folder), **settings},
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.split()


@pytest.fixture
def copies(tmp_path_factory):
    """Two folders with the same package, as two environments have it."""
    folder = tmp_path_factory.mktemp("environments")
    for name in ("one", "two"):
        shutil.copytree(
            ROOT / "grasp_core", folder / name / "grasp_core",
            ignore=shutil.ignore_patterns("__pycache__"), copy_function=shutil.copyfile,
        )  # fmt: skip
    return folder


@pytest.mark.slow
def test_another_environment_finds_what_one_has_compiled_until_what_it_calls_is_changed(
    copies, tmp_path
):
    there = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(tmp_path)}
    hits, kept, path = said_in(copies / "one", SCRIPT, **there)
    assert (hits, kept) == ("0", "True")
    assert Path(path).is_relative_to(tmp_path / "graspproof")
    assert said_in(copies / "two", SCRIPT, **there) == ["1", "True", path]
    text = copies / "two" / (CALLED.replace(".", "/") + ".py")
    text.write_text(text.read_text().replace("\n\n\n", "\n\n\nCHANGED = True\n\n\n", 1))
    hits, _, other = said_in(copies / "two", SCRIPT, **there)
    assert hits == "0"
    assert Path(other).name != Path(path).name
    assert Path(other).name.startswith(f"{CALLER}-")


@pytest.mark.slow
def test_without_optimization_code_runs_without_a_word(tmp_path):
    """Numba keeps no such code, as it holds addresses of its process."""
    there = {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_OPT": "0"}
    assert said_in(ROOT, UNKEPT, **there) == ["[-1.", "-1.", "-1.]"]


@pytest.mark.parametrize("home", [NOWHERE, "/proc"])
def test_without_a_home_code_is_kept_beside_the_module(home, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", home)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", NOWHERE)
    module = tmp_path / "own_kernel.py"
    module.write_text("ONE = 1\n")
    found = copy_of.__wrapped__("own_kernel", str(module))
    assert found is not None
    assert found.parent == tmp_path / "__pycache__"
    assert found.read_text() == module.read_text()
    assert [path.name for path in found.parent.iterdir()] == [found.name]


def test_where_nothing_can_be_written_nothing_is_kept(monkeypatch, tmp_path):
    module = tmp_path / "own_kernel.py"
    module.write_text("ONE = 1\n")
    nowhere = [Path(NOWHERE), Path("/dev/null")]
    monkeypatch.setattr("grasp_core.compiled.folders", lambda _: nowhere)
    assert copy_of.__wrapped__("own_kernel", str(module)) is None
    said = why_not_kept()
    assert all(f"{folder}: " in said for folder in nowhere)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert why_not_kept() == ""
    monkeypatch.setattr("grasp_core.compiled.folders", lambda _: [Path(NOWHERE), tmp_path / "new"])
    assert why_not_kept() == ""


def test_the_chosen_folder_comes_first_and_the_users_before_the_module(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "chosen"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert list(folders(Path("/a/b_kernel.py"))) == [
        tmp_path / "chosen" / "graspproof", tmp_path / "cache" / "graspproof",
        Path("/a/__pycache__"),
    ]  # fmt: skip


def test_folders_that_others_remove_meanwhile_do_not_matter(monkeypatch, tmp_path):
    """Each process makes a folder of its own beside what is kept, and removes it."""
    copy, gone, scan = tmp_path / "graspproof" / "own.py", "tmp_gone", os.scandir
    (copy.parent / gone).mkdir(parents=True)
    monkeypatch.setattr("grasp_core.compiled.copy_of", lambda *_: copy)

    def scanned(path="."):
        if Path(path).name == gone:
            raise FileNotFoundError(2, "No such file or directory", str(path))
        return scan(path)

    monkeypatch.setattr(os, "scandir", scanned)
    assert not is_kept(KERNEL)
    (copy.parent / "own.py.nbi").touch()
    assert is_kept(KERNEL)


def test_folders_of_bytecode_are_not_searched_for_loops(tmp_path, monkeypatch):
    copy = tmp_path / "graspproof" / "a_kernel-1.py"
    monkeypatch.setattr("grasp_core.compiled.copy_of", lambda *_: copy)
    for folder, kept in (("bytecode", False), ("a_kernel_1", True)):
        (copy.parent / folder).mkdir(parents=True)
        (copy.parent / folder / "a_kernel-1.loop.py311.nbi").touch()
        assert is_kept(KERNEL) is kept
