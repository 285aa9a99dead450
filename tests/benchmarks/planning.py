"""Whole plans: the best few of small and large objects, all grasps of small ones, and growth.

A plan with a limit has to hold the largest discs of a plan without one, where that is affordable;
that is checked first.
"""

import subprocess
import sys

import numpy as np

import grasp_core as gc
from scenes.example_objects import example_object
from tests.benchmarks.objects import PAPER, TEN_DEGREES, sphere_hull
from tests.benchmarks.timing import Row, once

LIMIT = 100
FACES = (12, 30, 100, 200, 400, 800)
MEMORY = ((200, "normal"), (800, "normal"), (800, "tilted"))
MEASURED = """
import grasp_core as gc
from tests.benchmarks.objects import PAPER, TEN_DEGREES, sphere_hull
body = sphere_hull({faces})
gc.plan(sphere_hull(8), TEN_DEGREES, limit=4)
if {limit}:
    gc.plan(body, TEN_DEGREES, families=PAPER, limit={limit}, cones={cones!r})
print(*[line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")])
"""
ALL = ("tetrahedron", "octahedron", "wedge", "dodecahedron")
CHECKED = "random-14-1"


def check():
    """The largest discs of a limited plan are those of a plan without a limit."""
    body = example_object(CHECKED)
    for family in ("concurrent", "pencil"):
        options = {"families": family, "cones": "normal"}
        every = sorted(g.radius for g in gc.plan(body, TEN_DEGREES, **options).grasps)
        best = sorted(g.radius for g in gc.plan(body, TEN_DEGREES, limit=20, **options).grasps)
        assert len(best) == min(20, len(every))
        assert np.allclose(best, every[-len(best) :], rtol=2e-5)


def megabytes(faces, cones):
    """Peak of a process that makes one such plan, and of one that only imports and loads.

    As Linux counts it since the process began; `getrusage` also counts what its parent had.
    """
    peaks = []
    for limit in (0, LIMIT):
        code = MEASURED.format(faces=faces, cones=cones, limit=limit)
        answer = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        peaks.append(int(answer.stdout) / 1024)
    return peaks


def rows():
    check()
    gc.plan(example_object("wedge"), 0.5)
    found = []
    for name in ALL:
        body = example_object(name)
        row, plan = once("planning", f"every grasp of the {name}", lambda b=body: gc.plan(b, 0.5))
        found.append(row.with_remark(f"{len(plan.grasps)} grasps, four methods"))
    for faces in FACES:
        body = sphere_hull(faces)
        for cones in ("normal", "tilted"):
            what = f"best {LIMIT} of {body.name}, {cones} cones"
            row, plan = once(
                "planning", what,
                lambda b=body, c=cones: gc.plan(
                    b, TEN_DEGREES, families=PAPER, limit=LIMIT, cones=c
                ),
            )  # fmt: skip
            tried = sum(counts.tried for counts in plan.counts.families.values())
            found.append(row.with_remark(f"{len(plan.grasps)} grasps, {tried} tried"))
    for faces, cones in MEMORY:
        without, with_plan = megabytes(faces, cones)
        what = f"memory of the best {LIMIT} of {faces} faces, {cones} cones"
        remark = f"peak {with_plan:.0f} MB, {without:.0f} MB without the plan"
        found.append(Row("planning", what, 1, 0.0, remark=remark))
    return found
