"""Inner loops that are not kept yet are compiled beside a plan, once."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from grasp_core import compiled as loops
from sim_validate.parallel import compiling

ROOT = Path(__file__).parents[3]
FIRST = "grasp_core.solvers.nearest_point_kernel"
SCRIPT = """
import sys
from grasp_core import compiled as loops
from sim_validate.parallel import compiling

if __name__ == "__main__":
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
    monkeypatch.setattr("multiprocessing.get_context", lambda _: pytest.fail("a process is begun"))
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
    class Broken:
        def recv(self):
            raise EOFError

    compiling._wait(Broken(), FIRST, set())


def test_each_kernel_is_waited_for_alone():
    names = iter([FIRST, "another", "a third"])

    class Pipe:
        def recv(self):
            return next(names)

    done = set()
    compiling._wait(Pipe(), "another", done)
    assert done == {FIRST, "another"}
    compiling._wait(Pipe(), FIRST, done)
    assert next(names) == "a third"
