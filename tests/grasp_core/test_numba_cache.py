"""Kept loops do what newly compiled ones do, alone and inside loops that are compiled later."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOOPS = '''
import numpy as np
from grasp_core.compiled import loop

@loop()
def shares(parts, whole):
    """Divide into a new array; zero is an error."""
    made = np.empty(len(parts))
    for i in range(len(parts)):
        made[i] = parts[i] / whole
    return made

@loop()
def stacked(parts, whole):
    """Call a loop, and functions of numba."""
    if whole < 0.0:
        raise ValueError("negative")
    return np.vstack((shares(parts, whole), np.ones(len(parts)))), np.abs(parts).max()

@loop()
def doubled(parts, whole):
    """Call a loop that calls a loop."""
    both, most = stacked(parts, whole)
    return 2.0 * both, most
'''
RUN = """
import sys
import numpy as np
import own_kernel as own
for name in sys.argv[1:]:
    function = getattr(own, name)
    parts = function(np.array([1.0, -3.0]), 2.0)
    print(name, [np.asarray(part).tolist() for part in parts], end=" ")
    for whole in (0.0, -1.0):
        try:
            function(np.ones(1), whole)
        except (ZeroDivisionError, ValueError) as error:
            print(repr(error), end=" ")
    print(sum(function.stats.cache_hits.values()))
print("numba.np.arrayobj" in sys.modules)
"""
STACKED = "[[[0.5, -1.5], [1.0, 1.0]], 3.0]"
STACKED_TWICE = "[[[1.0, -3.0], [2.0, 2.0]], 3.0]"
REFUSED = "ZeroDivisionError('division by zero') ValueError('negative')"


@pytest.fixture
def ran(tmp_path):
    """Run loops of a kernel in a new process, with one folder for what is kept."""
    (tmp_path / "own_kernel.py").write_text(LOOPS)
    places = os.pathsep.join([str(tmp_path), str(ROOT)])
    environment = os.environ | {"PYTHONPATH": places, "NUMBA_CACHE_DIR": str(tmp_path / "kept")}

    def run(*names):
        done = subprocess.run(
            [sys.executable, "-c", RUN, *names], cwd=tmp_path, env=environment,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    return run


def test_a_kept_loop_gives_the_same_arrays_and_errors_without_what_compiles(ran):
    said = f"stacked {STACKED} {REFUSED}"
    assert ran("stacked") == [f"{said} 0", "True"]
    assert ran("stacked") == [f"{said} 1", "False"]


def test_a_kept_loop_is_put_into_one_that_is_compiled_later(ran):
    ran("stacked")
    before, after, imported = ran("stacked", "doubled")
    assert before == f"stacked {STACKED} {REFUSED} 1"
    assert after == f"doubled {STACKED_TWICE} {REFUSED} 0"
    assert imported == "True"


def test_a_loop_that_is_inside_a_kept_one_is_kept_too(ran):
    ran("doubled")
    assert ran("stacked")[-1] == "False"
