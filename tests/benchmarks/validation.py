"""Validation in simulation: how long one takes, and the share of each kind of work.

Shares are of a profiled run, by functions of which none calls another one listed.
"""

import cProfile
import pstats

import numpy as np

import grasp_core as gc
from scenes.example_objects import example_object
from sim_validate import Agenda, validate
from tests.benchmarks.timing import in_turns, row

OBJECT, FRICTION, GRASPS, BLOCKS = "random-20-7", 0.5, 6, 4
WRENCHES = (0, 13, 39, 91)
"""Random ones beside the thirteen of every agenda."""
KINDS = {
    "stepping": [("bench.py", "run")],
    "building": [("mjcf.py", "build_scene"), ("bench.py", "compiled")],
    "analysis": [
        ("controls.py", "negative_controls"),
        ("rig.py", "planned"),
        ("contact_forces.py", "least_friction_forces"),
        ("rig.py", "forces_just_above"),
    ],
    "reading motions": [("traces.py", "traces"), ("traces.py", "judge")],
}


def grasps():
    body = example_object(OBJECT)
    return body, gc.plan(body, FRICTION, limit=GRASPS).grasps


def shares(body, every):
    """Of the time of whole validations, by kind."""
    profile = cProfile.Profile()
    profile.enable()
    for grasp in every:
        validate(body, grasp, FRICTION)
    profile.disable()
    spent, total = dict.fromkeys(KINDS, 0.0), 0.0
    for (path, _, function), (*_, cumulative, _) in pstats.Stats(profile).stats.items():
        name = path.rpartition("/")[2]
        total = max(total, cumulative)
        for kind, members in KINDS.items():
            if (name, function) in members:
                spent[kind] += cumulative
    assert all(spent.values()), "a listed function was not called"
    return {kind: seconds / total for kind, seconds in spent.items()}


def rows():
    body, every = grasps()
    assert all(validate(body, grasp, FRICTION).held for grasp in every)
    told = ", ".join(f"{share:.0%} {kind}" for kind, share in shares(body, every).items())
    runs = {"a validation with controls": None} | {
        f"  without, {13 + count} wrenches": Agenda(random_wrenches=count, controls=False)
        for count in WRENCHES
    }

    def run(agenda):
        return lambda block: len([validate(body, g, FRICTION, agenda=agenda) for g in block])

    seconds = in_turns({name: run(agenda) for name, agenda in runs.items()}, [every] * BLOCKS)
    cases = BLOCKS * len(every)
    return [
        row("validation", name, cases, own, "" if place else told)
        for place, (name, own) in enumerate(zip(runs, np.asarray(seconds), strict=True))
    ]
