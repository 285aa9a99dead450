"""How many of the face quadruples that hold a grasp the planner finds, and by which method.

    python -m tests.benchmarks.recall [--quick]

Every face quadruple of convex objects ends as held, with a certificate, as proved to hold nothing,
or open. The first two need no judge; contacts are still sampled on quadruples of all three kinds
and tested for exact closure, so that a wrong proof of absence, or a grasp missed, would show.
"""

import sys
import time
from collections import Counter

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.errors import UndecidedError
from grasp_core.planning.result import FAMILIES
from sim_validate.processes.workers import available_cores, each

OBJECTS = (
    "tetrahedron", "octahedron", "wedge", "box", "prism", "hexagonal-pyramid", "double-wedge-bar",
    "chamfered-box", "dodecahedron", "random-10-1", "random-12-1", "random-12-2", "random-14-1",
)  # fmt: skip
QUICK = ("box", "prism", "octahedron", "wedge", "random-10-1")
FRICTIONS = (0.2, 0.3, 0.5, 0.8)
SAMPLES = 60
"""Contact quadruples per face quadruple."""
JUDGED = 40
"""Face quadruples of an object that are sampled beside the open ones."""


def examine(case):
    """Count what became of the face quadruples, and sample."""
    name, friction = case
    body = scenes.example_object(name)
    paper = gc.plan(body, friction, families=FAMILIES, cones="normal")
    found = gc.plan(body, friction)
    held = {tuple(sorted(g.faces)) for g in found.grasps}
    regions = {tuple(sorted(g.faces)) for g in found.grasps if g.radius > 0.0}
    rng = np.random.default_rng(0)
    absent = list(found.absences)
    chosen = [absent[i] for i in rng.permutation(len(absent))[:JUDGED]]
    counts = Counter(
        quadruples=found.counts.quadruples, held=len(held), regions=len(regions),
        paper=len({tuple(sorted(g.faces)) for g in paper.grasps}), absent=len(absent),
        open=found.outcomes.open, judged_absent=len(chosen),
        missed=sum(closed_somewhere(body, faces, friction, rng) for faces in found.undecided),
        wrongly_absent=sum(closed_somewhere(body, faces, friction, rng) for faces in chosen),
    )  # fmt: skip
    return friction, counts


def closed_somewhere(body, faces, friction, rng):
    """Whether random contacts on four convex faces are in force closure."""
    normals = body.normals[list(faces)]
    polygons = [body.faces[face].polygon for face in faces]
    for _ in range(SAMPLES):
        points = [rng.dirichlet(np.full(len(p), 0.5)) @ p for p in polygons]
        try:
            if gc.force_closure(points, normals, friction).closed:
                return True
        except UndecidedError:
            continue
    return False


def main():
    """Print a line per friction and the totals."""
    quick = "--quick" in sys.argv[1:]
    names = QUICK if quick else OBJECTS
    begun = time.perf_counter()
    cases = [(name, friction) for friction in FRICTIONS for name in names]
    found = list(each(examine, cases, jobs=available_cores()))
    print(f"{len(names)} objects, {time.perf_counter() - begun:.0f} s")
    print("friction quadruples  held  absent  open  missed  recall  regions  paper")
    for friction in (*FRICTIONS, None):
        total = Counter()
        for own, counts in found:
            if friction in (own, None):
                total += counts
        graspable = total["held"] + total["missed"]
        print(
            f"{'all' if friction is None else friction:>8} {total['quadruples']:10d} "
            f"{total['held']:5d} {total['absent']:7d} {total['open']:5d} {total['missed']:7d}  "
            f"{total['held'] / graspable:.4f}   {total['regions'] / graspable:.4f} "
            f"{total['paper'] / graspable:.4f}"
        )
    print(f"proofs of absence sampled: {total['judged_absent']}, wrong: {total['wrongly_absent']}")
    if total["wrongly_absent"] or total["missed"]:
        sys.exit("sampling found grasps that the planner missed")


if __name__ == "__main__":
    main()
