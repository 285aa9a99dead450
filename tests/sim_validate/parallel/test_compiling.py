"""Inner loops that are not kept yet are compiled beside a plan, once."""

import os
import subprocess
import sys
from concurrent.futures import Future
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from grasp_core import compiled as loops
from sim_validate.parallel import compiling
from sim_validate.parallel.processes import ProcessEndedError

ROOT = Path(__file__).parents[3]
FIRST = "grasp_core.solvers.nearest_point_kernel"
SCRIPT = """
import sys
from grasp_core import compiled as loops
from sim_validate.parallel import compiling

with compiling.compiled_beside(int(sys.argv[1]), {"%s": compiling.BESIDE["%s"]}):
    compiling.BESIDE["%s"](compiling.OUTWARD, compiling.OUTWARD)
stats = loops.compiled("%s").solve.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
""".replace("%s", FIRST)


@pytest.fixture
def waiting():
    yield loops
    loops.wait_for({})


@pytest.mark.parametrize(
    ("jobs", "found"), [("2", "1 0"), pytest.param("1", "0 1", marks=pytest.mark.slow)]
)
def test_what_another_process_compiles_is_waited_for_and_found(jobs, found, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    environment = {
        **os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "kept")
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, str(script), jobs], env=environment, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert (done.stdout.strip(), done.stderr) == (found, "")


def test_where_all_is_kept_no_process_is_begun(monkeypatch):
    monkeypatch.setattr(compiling, "is_kept", lambda _: True)
    monkeypatch.setattr(compiling, "local_processes", lambda _: pytest.fail("a process is begun"))
    with compiling.compiled_beside(8):
        pass


def test_every_kernel_has_a_call_that_uses_it(waiting):
    for name, call in compiling.BESIDE.items():
        asked = []
        loops.compiled.cache_clear()
        waiting.wait_for({name: lambda asked=asked: asked.append(1)})
        call(compiling.OUTWARD / 3.0, -compiling.OUTWARD / 3.0**0.5)
        assert asked == [1], name


def test_the_end_of_the_other_process_ends_the_wait():
    failed = Future()
    failed.set_exception(ProcessEndedError())
    compiling._wait(failed)


def test_each_kernel_is_waited_for_alone(monkeypatch):
    done, waits = [], {}
    monkeypatch.setattr(compiling, "is_kept", lambda _: False)
    monkeypatch.setattr(compiling, "wait_for", lambda given: waits.update(given))
    monkeypatch.setattr(compiling, "local_processes", lambda _: nullcontext(Later(done)))
    with compiling.compiled_beside(2, {"one": abs, "two": abs}) as jobs:
        assert jobs == 1
        waits["one"]()
        assert done == [0]


class Later:
    """An engine whose tasks are done when their results are asked for, and noted then."""

    def __init__(self, done):
        self.done, self.count = done, 0

    def submit(self, *_):
        number, self.count = self.count, self.count + 1
        return SimpleNamespace(result=lambda: self.done.append(number))
