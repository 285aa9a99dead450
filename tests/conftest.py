"""What holds for all tests: no clock decides, files stay together, and kernels compile once."""

import gc
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

ROOT = Path(__file__).parents[1]
COMPILE = """
from sim_validate.processes.compiling import EVERYTHING, compile_loops, must_compile
if must_compile(EVERYTHING, jobs=2):
    compile_loops(EVERYTHING)
"""
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")


def pytest_configure(config):
    """Compile all kernels in two processes before several workers would each compile them."""
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        subprocess.run([sys.executable, "-c", COMPILE], cwd=ROOT, check=True)


def pytest_collection_finish():
    """Modules and tests stay to the end, so the garbage collector need not walk them each time.

    Every pytest that a test runs in this process collects garbage five times when it ends.
    """
    gc.collect()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """The tests of a file go to one worker, so that what they share is made once."""
    from xdist.scheduler import LoadFileScheduling

    return LoadFileScheduling(config, log) if config.getvalue("dist") == "load" else None
