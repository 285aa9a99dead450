"""Tasks that tests give to other processes, which import them by name."""

import os
import sys
import time
from pathlib import Path

from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.time_spent import TIME_SPENT


def square(number):
    print("what tasks print is no answer")
    return number * number


def all_input(_):
    return sys.stdin.read()


def refuse(_=None):
    raise MeshError(MeshRefusal.OPEN, "close the mesh")


def three_or_refusal(number):
    return number * number if number != 3 else refuse()


def meet(mine_and_other):
    """Wait for the process that does the other task; alone this would never end."""
    mine, other = mine_and_other
    Path(mine).touch()
    while not Path(other).exists():
        time.sleep(0.01)
    return os.getpid()


def meet_and_refuse(mine_other_and_here):
    """Meet, and refuse in any process but the one that asked."""
    *names, here = mine_other_and_here
    if meet(names) != here:
        refuse()


def end_elsewhere(here):
    """End any process but the one that asked."""
    if os.getpid() != here:
        os._exit(1)
    return "done here"


class Counter:
    """A function that counts its calls, as far as it is one and the same."""

    def __init__(self):
        self.calls = 0

    def __call__(self, _):
        self.calls += 1
        return self.calls


@TIME_SPENT.on("stepping")
def step_for(seconds_and_fails):
    """Use some processor time, and fail then if told to."""
    seconds, fails = seconds_and_fails
    begun = time.process_time()
    while time.process_time() < begun + seconds:
        pass
    if fails:
        refuse()
