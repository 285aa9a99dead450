"""A command keeps bytecode somewhere, whatever Python is told."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sim_validate import start

ROOT = str(Path(__file__).parents[2])
PROGRAM = """
import os, sys
from sim_validate import start
start.PROBES = ("probe",)
start.keep_bytecode()
import probe
print(probe.__cached__, os.path.exists(probe.__cached__), os.environ.get(start.NEVER))
"""


@pytest.fixture
def modules(tmp_path):
    """A folder with a module that nobody has compiled, and one for what is kept."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "probe.py").write_text("VALUE = 1\n")
    return folder


def started(modules, **more):
    """Where the bytecode of the module is, whether it is there, and what a child would be told."""
    usual = {start.NEVER: "1", "XDG_CACHE_HOME": str(modules.parent / "cache")}
    kept = {name: value for name, value in os.environ.items() if name not in
            {"NUMBA_CACHE_DIR", start.INSTEAD, start.NEVER}}  # fmt: skip
    told = {**kept, "PYTHONPATH": f"{ROOT}{os.pathsep}{modules}", **usual, **more}
    ran = subprocess.run([sys.executable, "-c", PROGRAM], env=told, capture_output=True, text=True,
                         check=True)  # fmt: skip
    return ran.stdout.split()


def test_bytecode_that_must_not_lie_beside_modules_is_kept_with_compiled_loops(modules):
    own = modules.parent / "cache" / "graspproof" / "bytecode"
    for _ in range(2):  # what is kept there is no reason to go back
        cached, there, told = started(modules)
        assert Path(cached).is_relative_to(own)
        assert (there, told) == ("True", "None")
    assert [each.name for each in modules.iterdir()] == ["probe.py"]
    chosen = modules.parent / "chosen"
    assert started(modules, NUMBA_CACHE_DIR=str(chosen))[0].startswith(str(chosen / "graspproof"))


def test_bytecode_is_left_where_python_keeps_it_or_was_told_to(modules):
    beside = str(modules / "__pycache__")
    asked = str(modules.parent / "asked")
    assert started(modules, PYTHONPYCACHEPREFIX=asked)[0].startswith(asked)
    assert not (modules.parent / "asked").exists()  # that was forbidden, too
    cached, there, *_ = started(modules, PYTHONDONTWRITEBYTECODE="")
    assert (cached.startswith(beside), there) == (True, "True")
    assert started(modules) == [cached, "True", "1"]
    assert not (modules.parent / "cache").exists()


def test_without_a_folder_for_it_the_command_starts_all_the_same(modules):
    (modules.parent / "file").touch()
    cached, there, told = started(modules, XDG_CACHE_HOME=str(modules.parent / "file"))
    assert (cached.startswith(str(modules)), there, told) == (True, "False", "1")


@pytest.mark.parametrize(("given", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_a_command_leaves_out_threads_that_wait_and_a_last_look_for_circles(given, threads):
    code = (
        "import atexit, gc, os; atexit.register(lambda: print(gc.get_freeze_count() > 0,"
        " os.environ['OPENBLAS_NUM_THREADS']));"
        "from sim_validate.start import run_and_exit; run_and_exit()"
    )
    usual = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    ran = subprocess.run([sys.executable, "-c", code, "--version"], env=usual | given, cwd=ROOT,
                         capture_output=True, text=True, check=True)  # fmt: skip
    assert ran.stdout.split()[-2:] == ["True", threads]
