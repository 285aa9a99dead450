"""Tasks that tests give to other processes, which import them by name."""

import os
import time
from pathlib import Path

from grasp_core.errors import MeshError, MeshRefusal


def doing(here):
    """Make the function that does a task: an action and what it needs.

    Args:
        here: The process that asks, by its number.
    """
    return lambda task: ACTIONS[task[0]](*task[1:], here)


def square(number, _):
    print("what tasks print is no answer")
    return number * number


def refuse(_):
    raise MeshError(MeshRefusal.OPEN, "close the mesh")


def meet(mine, other, _):
    """Wait for the process that does the other task; alone this would never end."""
    Path(mine).touch()
    while not Path(other).exists():
        time.sleep(0.01)
    return os.getpid()


def meet_and_refuse(mine, other, here):
    """Meet, and refuse in any process but the one that asked."""
    if meet(mine, other, here) != here:
        refuse(here)


def end_elsewhere(here):
    """End any process but the one that asked."""
    if os.getpid() != here:
        os._exit(1)
    return "done here"


ACTIONS = {
    "square": square,
    "refuse": refuse,
    "meet": meet,
    "end": end_elsewhere,
    "refuse elsewhere": meet_and_refuse,
}
