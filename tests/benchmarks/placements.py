"""How often grasps are closed when objects are not in their place, as proved and as drawn.

    python -m tests.benchmarks.placements [--grasps 5] [--draws 10000]

Each draw moves the object, the fingers and the friction, lets every finger meet the mesh, and
decides force closure of the contacts that come of it. No proved bound may be above the share of
draws in force closure by more than the luck of the draws.
"""

import argparse
import math
import time

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.regions.placement import bound
from tests.benchmarks.objects import FAMILIES
from tests.placements import share_closed

NAMES = (
    "wedge", "tetrahedron", "octahedron", "dodecahedron", "icosahedron", "box", "prism",
    "l-bracket", "hexagonal-pyramid", "chamfered-box", "double-wedge-bar", "random-12-1",
)  # fmt: skip
FRICTION = (0.5, 0.05)
SIZES = (1.0, 2.0, 3.0)
"""Standard deviations of translation [mm] and turn [deg]."""
FINGER_M = 5e-4
HIGH, NEAR = 0.9, 0.1
"""Rates from which a bound should be near, and how near."""


def timed(call):
    """What a call gives, and its processor time [s]."""
    begun = time.process_time()
    return call(), time.process_time() - begun


def cases(grasps):
    """Yield an object, a grasp of it, and a size."""
    for name in NAMES:
        body = scenes.example_object(name)
        for family in FAMILIES:
            for grasp in gc.plan(body, FRICTION[0], families=family, limit=grasps).grasps:
                for size in SIZES:
                    yield body, grasp, size


def bounded(body, grasp, size):
    """The bound for one size of errors, or None."""
    return gc.placement_probability(
        body, grasp, FRICTION, pose_sigma_m=1e-3 * size, pose_sigma_rad=math.radians(size),
        contact_sigma_m=FINGER_M,
    )  # fmt: skip


def main():
    """Print the figures of each size; 1 if a bound is above what the draws allow."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=5, help="of each family and object")
    parser.add_argument("--draws", type=int, default=10_000)
    asked = parser.parse_args()
    rows, above, finding, reckoning = [], 0, [], []
    for body, grasp, size in cases(asked.grasps):
        found, seconds = timed(lambda b=body, g=grasp, s=size: bounded(b, g, s))
        finding.append(seconds)
        if found is None:
            rows.append((size, 0.0, math.nan, math.nan))
            continue
        reckoning.append(timed(lambda f=found: bound(f))[1])
        rate = share_closed(body, found, asked.draws, seed=len(rows))
        above += found.lower > rate + 4.0 * math.sqrt(max(rate * (1.0 - rate), 1e-4) / asked.draws)
        rows.append((size, found.lower, rate, found.estimate))
    sizes, lowers, *shares = np.array(rows).T
    for size in SIZES:
        said = []
        for share in shares:
            high = (sizes == size) & (share >= HIGH)
            near = np.count_nonzero(share[high] - lowers[high] <= NEAR)
            said.append(f"{near} of {np.count_nonzero(high)}")
        print(
            f"{size:g} mm and degrees: bounds within {NEAR} for {said[0]} grasps that are closed in"
            f" {HIGH:.0%} of draws, and for {said[1]} that are so on the planned faces"
        )
    print(
        f"{len(rows)} bounds, {len(rows) - len(reckoning)} not found, {above} above what draws "
        f"allow; {1e3 * np.median(finding):.0f} ms in the median to find a bound, "
        f"{1e3 * np.median(reckoning):.1f} ms to reckon it"
    )
    return int(above > 0)


if __name__ == "__main__":
    raise SystemExit(main())
