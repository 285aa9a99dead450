"""Mesh files of a folder, planned for fingers that must reach, and simulated on the true surface.

    python -m tests.benchmarks.real_objects FOLDER [--limit 24]

For each file: how its faces are taken, grasps that are certified and reached by fingertips of 6 %
of the object's radius on free lines half a radius long, how many hold in simulation, with their
negative controls, and the seconds for all of it on one core.
"""

import sys
import time
from pathlib import Path

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.parallel.processes import available_cores, each
from tests.benchmarks.objects import meshes_in

FRICTION = 0.5
TIP, APPROACH = 0.06, 0.5
"""In object radii."""


def examine(case):
    """One line of the table."""
    path, limit = case
    begun = time.perf_counter()
    body = gc.load_polyhedron(path)
    finger = gc.Finger(TIP * body.radius, APPROACH * body.radius)
    plan = gc.plan(body, FRICTION, limit=limit, finger=finger)
    planned = time.perf_counter() - begun
    setup = sv.Setup(fingers=scenes.FingerSettings(radius_m=finger.radius_m))
    verdicts = [sv.validate(body, grasp, FRICTION, setup=setup) for grasp in plan.grasps]
    certified = sum(gc.force_closure(grasp, friction=FRICTION).verify() for grasp in plan.grasps)
    return (
        path.name, f"{len(body.faces)} {'patches' if body.patches else 'faces'}",
        len(plan.grasps), certified, sum(grasp.radius > 0.0 for grasp in plan.grasps),
        sum(verdict.held for verdict in verdicts),
        sum(len(verdict.controls) for verdict in verdicts),
        sum(not trial.let_go for verdict in verdicts for trial in verdict.controls),
        sum(bool(verdict.mismatches) for verdict in verdicts),
        planned, time.perf_counter() - begun,
    )  # fmt: skip


def main():
    """Print a line per file; fail where a grasp does not hold or a control does."""
    folder = Path(sys.argv[1])
    limit = int(sys.argv[sys.argv.index("--limit") + 1]) if "--limit" in sys.argv else 24
    paths = meshes_in(folder)
    print("file                             faces       grasps certified regions held "
          "controls not let go, mismatches, plan s  all s")  # fmt: skip
    bad = False
    for row in each(examine, [(path, limit) for path in paths], jobs=available_cores()):
        name, faces, grasps, certified, regions, held, controls, kept, off, planned, total = row
        print(
            f"{name:32} {faces:11} {grasps:6d} {certified:9d} {regions:7d} {held:4d} "
            f"{controls:8d} {kept:4d} {off:10d} {planned:6.1f} {total:6.1f}",
            flush=True,
        )
        bad |= not grasps == certified == held or kept > 0
    if bad:
        sys.exit("a grasp did not hold, or a control did")


if __name__ == "__main__":
    main()
