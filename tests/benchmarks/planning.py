"""Whole plans: the best few of small and large objects, all grasps of small ones, and growth.

The hull of points on a sphere has as many triangular faces as wanted. A plan with a limit has to
hold the largest discs of a plan without one, where that is affordable; that is checked first.
"""

import gc as garbage
import resource

import numpy as np
import trimesh

import grasp_core as gc
from scenes.objects import example_object
from tests.benchmarks.timing import once

LIMIT = 100
FACES = (12, 30, 100, 200, 400, 800)
PAPER = ("concurrent", "pencil", "regulus")
TEN_DEGREES = 0.1763
ALL = ("tetrahedron", "octahedron", "wedge", "dodecahedron")
CHECKED = "random-14-1"


def sphere_hull(faces, seed=0):
    """A polytope with so many triangles."""
    points = np.random.default_rng(seed).normal(size=(faces // 2 + 2, 3))
    hull = trimesh.convex.convex_hull(points / np.linalg.norm(points, axis=1, keepdims=True))
    return gc.Polyhedron.from_mesh(hull.vertices, hull.faces, name=f"hull of {faces} faces")


def check():
    """The largest discs of a limited plan are those of a plan without a limit."""
    body = example_object(CHECKED)
    for family in ("concurrent", "pencil"):
        options = {"families": family, "cones": "normal"}
        every = sorted(g.radius for g in gc.plan(body, TEN_DEGREES, **options).grasps)
        best = sorted(g.radius for g in gc.plan(body, TEN_DEGREES, limit=20, **options).grasps)
        assert len(best) == min(20, len(every))
        assert np.allclose(best, every[-len(best) :], rtol=2e-5)


def megabytes():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


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
            garbage.collect()
            what = f"best {LIMIT} of {body.name}, {cones} cones"
            row, plan = once(
                "planning", what,
                lambda b=body, c=cones: gc.plan(
                    b, TEN_DEGREES, families=PAPER, limit=LIMIT, cones=c
                ),
            )  # fmt: skip
            tried = sum(counts.tried for counts in plan.counts.families.values())
            remark = f"{len(plan.grasps)} grasps, {tried} tried, peak {megabytes():.0f} MB"
            found.append(row.with_remark(remark))
    return found
