"""How often grasps are closed when objects are not in their place: proved, drawn, and simulated.

    python -m tests.benchmarks.placements [--grasps 5] [--draws 10000] [--starts 0] [--jobs 1]

Each draw moves the object, the fingers and the friction, lets every finger meet the mesh, and
decides force closure of the contacts that come of it. No proved bound may be above the share of
draws in force closure by more than the luck of the draws.

With `--starts 30`, each grasp is also executed so many times with the object misplaced by the same
errors, and the bound is compared with the share of these starts that are closed and survive.
"""

import argparse
import math
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
from scipy.stats import spearmanr

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.regions.placement import bound
from tests.benchmarks.objects import FAMILIES
from tests.placements import share_closed

NAMES = (
    "wedge", "tetrahedron", "octahedron", "dodecahedron", "icosahedron", "box", "prism",
    "l-bracket", "hexagonal-pyramid", "chamfered-box", "double-wedge-bar", "random-12-1",
)  # fmt: skip
FRICTION = (0.5, 0.05)
SIZES = (0.5, 1.0, 2.0)
"""Standard deviations of translation [mm] and turn [deg]."""
FINGER_M = 5e-4
HIGH, NEAR = 0.9, 0.1
"""Rates from which a bound should be near, and how near."""
STARTS = (3.0, 5.0)
"""Standard deviations of translation [mm] and turn [deg] of executions."""
MASS_KG = 0.1
FIGURES = ("proved bound", "estimate", "disc radius", "Ferrari-Canny", "critical friction")


def timed(call):
    """What a call gives, and its processor time [s]."""
    begun = time.process_time()
    return call(), time.process_time() - begun


def bounded(body, grasp, size, friction, finger_m):
    """The bound for one size of errors, or None."""
    return gc.placement_probability(
        body, grasp, friction, pose_sigma_m=1e-3 * size, pose_sigma_rad=math.radians(size),
        contact_sigma_m=finger_m,
    )  # fmt: skip


def started(body, grasp, size, starts):
    """Share of starts that are closed, and of those that survive too; None without a squeeze."""
    settings = sv.ExecutionSettings(
        mass_kg=MASS_KG, trials=("misplaced",), off_by="deviation", off_mm=size, off_deg=size,
        misplacements=starts,
    )  # fmt: skip
    try:
        trials = sv.execute(body, grasp, FRICTION[0], settings).trials
    except gc.NoForcesError:
        return None
    closed = [trial.starts_closed is True for trial in trials]
    kept = [trial.survived for trial in trials]
    return np.mean(closed), np.mean(np.logical_and(closed, kept))


def of_object(name, asked):
    """Rows of an object's grasps: bounds against draws, and figures against executions."""
    body, drawn, executed = scenes.example_object(name), [], []
    for family in FAMILIES:
        for grasp in gc.plan(body, FRICTION[0], families=family, limit=asked.grasps).grasps:
            others = grasp.radius, grasp.ferrari_canny[0], -grasp.critical_friction
            for size in SIZES:
                found, finding = timed(partial(bounded, body, grasp, size, FRICTION, FINGER_M))
                if found is None:
                    drawn.append((size, 0.0, math.nan, math.nan, *others, finding, math.nan))
                    continue
                reckoning = timed(lambda f=found: bound(f))[1]
                rate = share_closed(body, found, asked.draws, seed=len(drawn))
                proved = found.lower, rate, found.estimate
                drawn.append((size, *proved, *others, finding, reckoning))
            for size in STARTS if asked.starts else ():
                if (shares := started(body, grasp, size, asked.starts)) is not None:
                    found = bounded(body, grasp, size, FRICTION[0], 0.0)
                    proved = (0.0, 0.0) if found is None else (found.lower, found.estimate)
                    executed.append((size, *shares, *proved, *others))
    return drawn, executed


def ranked(figures, shares):
    """Name the rank correlation of each figure with shares."""
    ranks = [spearmanr(figure, shares).statistic for figure in figures]
    return ", ".join(f"{name} {rank:.2f}" for name, rank in zip(FIGURES, ranks, strict=True))


def say_drawn(rows, draws):
    """Print the figures of each size, and return how many bounds are above what draws allow."""
    sizes, lowers, rates, estimates, *others, finding, reckoning = np.array(rows).T
    for size in SIZES:
        said = []
        for share in (rates, estimates):
            high = (sizes == size) & (share >= HIGH)
            near = np.count_nonzero(share[high] - lowers[high] <= NEAR)
            said.append(f"{near} of {np.count_nonzero(high)}")
        print(
            f"{size:g} mm and degrees: bounds within {NEAR} for {said[0]} grasps that are closed in"
            f" {HIGH:.0%} of draws, and for {said[1]} that are so on the planned faces"
        )
        here = (sizes == size) & np.isfinite(rates)
        figures = [figure[here] for figure in (lowers, estimates, *others)]
        print("  rank correlations with the share of draws:", ranked(figures, rates[here]))
    luck = 4.0 * np.sqrt(np.maximum(rates * (1.0 - rates), 1.0 / draws) / draws)
    above = int(np.count_nonzero(lowers > rates + luck))
    print(
        f"{len(rows)} bounds, {np.count_nonzero(np.isnan(rates))} not found, {above} above what "
        f"draws allow; {1e3 * np.median(finding):.0f} ms in the median to find a bound, "
        f"{1e3 * np.nanmedian(reckoning):.1f} ms to reckon it"
    )
    return above


def say_executed(rows):
    """Print how each figure ranks grasps, against the shares of starts."""
    table = np.array(rows)
    for size in STARTS:
        _, closed, kept, *figures = table[table[:, 0] == size].T
        print(
            f"{size:g} mm and degrees, {len(closed)} grasps: {closed.mean():.1%} of starts closed,"
            f" {kept.mean():.1%} closed and kept"
        )
        print("  rank correlations with starts that are closed:", ranked(figures, closed))
        print("  and with those that are closed and kept:", ranked(figures, kept))


def main():
    """Print all figures; 1 if a bound is above what the draws allow."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=5, help="of each family and object")
    parser.add_argument("--draws", type=int, default=10_000)
    parser.add_argument("--starts", type=int, default=0, help="executions of each grasp")
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    drawn, executed = [], []
    with ProcessPoolExecutor(asked.jobs, mp_context=get_context("spawn")) as workers:
        for own, tried in workers.map(partial(of_object, asked=asked), NAMES):
            drawn += own
            executed += tried
    above = say_drawn(drawn, asked.draws)
    if executed:
        say_executed(executed)
    return int(above > 0)


if __name__ == "__main__":
    raise SystemExit(main())
