"""Planning many grasps from end to end: all of random hulls, and the best of large ones.

    python -m tests.benchmarks.many_grasps [--quick]

Processor seconds of `gc.plan`, with everything between an object and its certified grasps.
The ratio r is the processor time per grasp over that of one linear program of 90 random rows and 16
variables, solved by `scipy.optimize.linprog` with HiGHS in turns with the plans: it carries over to
other machines, seconds do not. Where all grasps are planned, the figures that grasps compute when
they are asked for are timed too. First the plans of small objects are checked: every grasp is in
force closure by `gc.force_closure`, and in the order of its radius within its family.
"""

import sys
import time

import numpy as np
from scipy.optimize import linprog

import grasp_core as gc
from scenes.example_objects import example_object
from tests.benchmarks.objects import PAPER, TEN_DEGREES, sphere_hull

ALL = (11, 18, 24, 30)
"""Numbers of faces of random objects all of whose quadruples are decided, by all methods."""
NORMAL = (18, 24)
BEST, LIMIT = (100, 200, 400, 800), 20
ROWS, VARIABLES, PROGRAMS = 90, 16, 25
CHECKED = ("random-11-1", "wedge")
UNDECIDED = 0.001
"""Share of the quadruples that the free method may leave undecided."""


def check():
    """Every grasp is closed when asked one by one, and families have falling radii."""
    for name in CHECKED:
        plan = gc.plan(example_object(name), TEN_DEGREES)
        assert plan.outcomes.open <= UNDECIDED * plan.counts.quadruples
        assert len(plan.grasps) > 100
        radii = {}
        for grasp in plan.grasps:
            assert gc.force_closure(grasp, friction=TEN_DEGREES).closed
            assert grasp.radius <= radii.get(grasp.family, np.inf) * (1.0 + 1e-5)
            radii[grasp.family] = grasp.radius or np.inf


def program_seconds():
    """Processor time of one linear program, the median of some; bounded by random half-spaces."""
    rng, taken = np.random.default_rng(0), []
    for _ in range(PROGRAMS):
        A, c = rng.normal(size=(ROWS, VARIABLES)), rng.normal(size=VARIABLES)
        b = rng.uniform(0.5, 1.5, ROWS)
        begun = time.process_time()
        linprog(c, A_ub=A, b_ub=b, bounds=(None, None), method="highs")
        taken.append(time.process_time() - begun)
    return float(np.median(taken))


def row(what, plan, figures=False):
    """Print one line of the table."""
    program = program_seconds()
    begun = time.process_time()
    grasps = plan().grasps
    seconds = time.process_time() - begun
    program = 0.5 * (program + program_seconds())
    each = seconds / max(len(grasps), 1)
    begun, late = time.process_time(), ""
    if figures:
        for grasp in grasps:
            _ = grasp.critical_friction, grasp.ferrari_canny
        late = f"{time.process_time() - begun:8.2f}"
    print(
        f"{what:44} {len(grasps):7d} {seconds:8.2f} {1e3 * each:9.3f} {each / program:6.2f} {late}",
        flush=True,
    )


def main():
    """Print the table; only the small objects with `--quick`."""
    quick = "--quick" in sys.argv
    gc.plan(example_object("random-9-7"), 0.5)
    gc.plan(
        example_object("random-9-7"),
        0.5,
        families=PAPER,
        limit=2,
        settings=gc.PlanSettings(cones="normal"),
    )
    check()
    print(f"{'plan':44} grasps    CPU s  ms/grasp      r figures s")
    for faces in NORMAL[: 1 if quick else None]:
        body = example_object(f"random-{faces}-1")
        row(
            f"the paper's families, {faces} faces",
            lambda b=body: gc.plan(
                b, TEN_DEGREES, families=PAPER, settings=gc.PlanSettings(cones="normal")
            ),
            figures=not quick,
        )
    for faces in ALL[: 1 if quick else None]:
        body = example_object(f"random-{faces}-1")
        row(f"all methods, {faces} faces", lambda b=body: gc.plan(b, TEN_DEGREES))
    for faces in BEST[: 1 if quick else None]:
        body = sphere_hull(faces)
        row(
            f"best {LIMIT} of {faces} faces, tilted cones",
            lambda b=body: gc.plan(b, TEN_DEGREES, families=PAPER, limit=LIMIT),
        )
    row("all methods, wedge", lambda: gc.plan(example_object("wedge"), 0.5), figures=True)


if __name__ == "__main__":
    main()
