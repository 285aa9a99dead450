"""The planner's linear programs, solved by the compiled method and by what others would use.

    python -m tests.benchmarks.programs [--quick]

First every program of several plans is solved by the compiled method and by HiGHS, both at their
door with all checks; the verdicts must be the same. Values are compared in units of the largest
multiplier where that is above one: HiGHS stops at points that violate rows by up to 1e-9, and a
multiplier says what that is worth. More than 1e-8 are counted.
Then a sample is timed, all contenders in turn on each block of programs, so that a busy machine
slows all of them alike. Ratios are medians over the blocks.
"""

import sys
import time
from collections import Counter

import numpy as np
import qpsolvers
from scipy import sparse
from scipy.optimize import linprog

import grasp_core as gc
from grasp_core.families import placements, regulus
from grasp_core.families.disc_bounds import AttemptBounds
from grasp_core.solvers import lp
from scenes.example_objects import example_object

PLANS = [
    (name, friction)
    for name in ("wedge", "random-10-1", "random-12-1", "l-bracket", "chamfered-box", "hex-nut",
                 "double-wedge-bar", "random-14-1", "random-20-7", "icosahedron")
    for friction in (0.17, 0.3, 0.5, 0.8)
]  # fmt: skip
COUNT, QUICK = 100_000, 4_000
SAMPLE, BLOCKS = 20, 15
APART = 1e-8


class EnoughError(Exception):
    """As many programs as were asked for."""


def programs(count):
    """The first so many programs of the plans, with the cutoff asked for."""
    found, solve = [], lp.maximize_above

    def record(program, cutoff):
        found.append((program, cutoff))
        if len(found) >= count:
            raise EnoughError
        return solve(program, cutoff)

    lp.maximize_above = placements.maximize_above = record
    bounds, choice = AttemptBounds.of, regulus._best_choice
    AttemptBounds.of = lambda *args: np.full(len(args[2].faces), np.inf)  # by whole programs
    regulus._best_choice = lambda *_: None
    try:
        for name, friction in PLANS:
            gc.plan(example_object(name), friction)
    except EnoughError:
        pass
    finally:
        AttemptBounds.of, regulus._best_choice = bounds, choice
        lp.maximize_above = placements.maximize_above = solve
    return found


def disagreement(program, cutoff, tally):
    """How far the two are apart, as accuracy of a row; infinite if their verdicts differ."""
    try:
        ours = lp._by_simplex(program, cutoff)
    except (gc.SolverError, np.linalg.LinAlgError):
        tally["left to HiGHS"] += 1
        return 0.0
    tally[type(ours).__name__] += 1
    theirs = lp._by_highs(program)
    if isinstance(ours, lp.Infeasible) or isinstance(theirs, lp.Infeasible):
        same = type(ours) is type(theirs) or isinstance(ours, lp.Below)
        return 0.0 if same else np.inf
    if isinstance(ours, lp.Below):
        return max(theirs.value - ours.bound, ours.bound - cutoff, 0.0)
    return abs(ours.value - theirs.value) / max(1.0, np.abs(ours.multipliers).max())


def by_qpsolvers(solver):
    """A contender: the program as a quadratic one without a quadratic term.

    Clarabel takes sparse matrices. ProxQP (proxsuite 0.8.0) writes beyond its memory if it is given
    sparse ones of some of these programs, and with dense ones it is faster.
    """
    kind = sparse.csc_matrix if solver == "clarabel" else np.asarray

    def solve(program):
        rows = None if program.A_eq is None else kind(program.A_eq)
        return qpsolvers.solve_qp(
            kind(np.zeros((len(program.c), len(program.c)))), -program.c, kind(program.A),
            program.b, rows, program.b_eq, solver=solver,
        )  # fmt: skip

    return solve


def by_linprog(program):
    return linprog(
        -program.c, program.A, program.b, program.A_eq, program.b_eq, bounds=(None, None),
        method="highs",
    )  # fmt: skip


COMPILED = "compiled, checked"
CONTENDERS = {
    COMPILED: lp.maximize,
    "HiGHS, checked": lp._by_highs,
    "scipy.linprog": by_linprog,
    "qpsolvers, clarabel": by_qpsolvers("clarabel"),
    "qpsolvers, proxqp": by_qpsolvers("proxqp"),
}
if "daqp" in qpsolvers.available_solvers:
    CONTENDERS["qpsolvers, daqp"] = by_qpsolvers("daqp")


def timed(sample):
    """Seconds of each contender on each block, (contenders, blocks)."""
    blocks = np.array_split(np.arange(len(sample)), BLOCKS)
    seconds = np.zeros((len(CONTENDERS), BLOCKS))
    for place, block in enumerate(blocks):
        order = list(enumerate(CONTENDERS.values()))
        for row, solve in order if place % 2 else reversed(order):
            begun = time.process_time()
            for index in block:
                solve(sample[index])
            seconds[row, place] = (time.process_time() - begun) / len(block)
    return seconds


def main():
    """Compare, then time; fail where two verdicts differ."""
    found = programs(QUICK if "--quick" in sys.argv[1:] else COUNT)
    tally = Counter()
    apart = np.array([disagreement(program, cutoff, tally) for program, cutoff in found])
    wrong, off = int(np.isinf(apart).sum()), apart[np.isfinite(apart)]
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(tally.items()))
    print(f"{len(found)} programs ({kinds}): {wrong} verdicts differ")
    print(f"values are up to {off.max():.1e} apart, {(off > APART).sum()} by more than {APART:g}")
    rng = np.random.default_rng(0)
    sample = [found[i][0] for i in rng.choice(len(found), SAMPLE * BLOCKS, replace=False)]
    seconds = timed(sample)
    print(f"{'per program':24s} {'median us':>10s} {'ratio':>8s}")
    for name, row in zip(CONTENDERS, seconds, strict=True):
        print(f"{name:24s} {1e6 * np.median(row):10.0f} {np.median(row / seconds[0]):8.1f}")
    if wrong:
        sys.exit("verdicts differ")


if __name__ == "__main__":
    main()
