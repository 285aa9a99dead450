"""What holds for all tests: no clock decides, files stay together, and kernels compile once."""

import fcntl
import gc
import os

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")


def pytest_configure(config):
    """Let only one worker compile at a time; the others then find the kernel in the cache."""
    if hasattr(config, "workerinput"):
        from numba.core import event

        event.register("numba:compiler_lock", one_compiles(event.Listener))


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


def one_compiles(listener):
    """What numba tells before and after it compiles; this file is the lock of all workers."""

    class OneCompiles(listener):
        def __init__(self):
            self.lock, self.depth = os.open(__file__, os.O_RDONLY), 0

        def on_start(self, _):
            self.depth += 1
            fcntl.flock(self.lock, fcntl.LOCK_EX)

        def on_end(self, _):
            self.depth -= 1
            if self.depth == 0:
                fcntl.flock(self.lock, fcntl.LOCK_UN)

    return OneCompiles()
