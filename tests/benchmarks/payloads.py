"""Predicted against simulated payloads: `python -m tests.benchmarks.payloads`.

An object of the predicted mass (`gc.payload(...).mass_kg`, pushes up to 10 N) is squeezed. In each
of 42 directions that share the sphere evenly, and in the worst one, its weight grows slowly to 1.15
times as much, under the one squeeze. The least multiple at which a contact slips, times the
predicted mass, is the simulated payload. Ends with an error if one is more than 2 % off, or a
prediction more than 1 % too high.

    python -m tests.benchmarks.payloads [--quick] [--stiffness N_PER_M] [--jobs N]
"""

import sys
import time
from dataclasses import dataclass
from itertools import combinations

import numpy as np

import grasp_core as gc
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from sim_validate.parallel.processes import each
from tests.benchmarks import held_grasps as held

EACH, QUICK_EACH = 12, 1
BEYOND = 1.15
OFF, TOO_HIGH = 0.02, 0.01


@dataclass(frozen=True)
class Found:
    name: str
    mass_kg: float
    ratio: float
    """Simulated payload over the predicted one; NaN where the simulator failed."""
    place: int
    """Direction that slipped first: 0 to 41, or 42 for the worst."""


def directions():
    """Return the corners and the middles of the edges of an icosahedron, (42, 3)."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    flat = np.array([[0.0, s, t * golden] for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(flat, turn, axis=1) for turn in range(3)])
    edges = [a + b for a, b in combinations(corners, 2) if np.linalg.norm(a - b) < 2.1]
    ways = np.concatenate([corners, edges])
    assert len(ways) == 42
    return ways / np.linalg.norm(ways, axis=1)[:, None]


def measure(unit):
    """Compare one payload; None if no squeeze holds stably."""
    case, stiffness = unit
    body = held.body_of(case.source)
    try:
        found = gc.payload(
            body, case.grasp, held.FRICTION, max_push_n=held.PUSH_N, stiffness=stiffness,
            tip_radius_m=held.tip_radius(body, case.grasp),
        )  # fmt: skip
    except gc.NoForcesError:
        return None
    mass, best = found.mass_kg, found.fixed
    worst = best.load[:3] / np.linalg.norm(best.load[:3])
    bench = held.bench_of(body, best.grip, mass)
    time_s = held.slowness(bench, best.grip)
    weights = mass * GRAVITY_M_PER_S2 * np.vstack([directions(), worst])
    drives = [held.ramp(np.append(weight, np.zeros(3)), BEYOND, time_s) for weight in weights]
    multiples = np.array(list(held.first_slips(bench, best.grip, drives)))
    place = int(np.argmin(np.where(np.isnan(multiples), -np.inf, multiples)))
    return Found(f"{body.name} {case.grasp.id}", mass, float(multiples[place]), place)


def report(found):
    """Print the errors, and the worst grasps; whether the bar is met."""
    real = [one for one in found if one is not None]
    print(f"{len(real)} payloads, {len(found) - len(real)} grasps without a stable squeeze")
    ratios = np.array([one.ratio for one in real])
    masses = [one.mass_kg for one in real]
    print(f"predicted from {min(masses):.2f} to {max(masses):.2f} kg; the worst direction slips "
          f"first in {sum(one.place == 42 for one in real)}")  # fmt: skip
    print(f"{np.isnan(ratios).sum()} failures of the simulator")
    print(f"simulated over predicted: {held.spread(ratios[~np.isnan(ratios)] - 1.0)}")
    too_high = 1.0 / ratios - 1.0
    print(f"{(too_high > TOO_HIGH).sum()} predictions are more than {100 * TOO_HIGH:g} % too high, "
          f"{(np.abs(ratios - 1.0) > OFF).sum()} more than {100 * OFF:g} % off")  # fmt: skip
    for place in np.argsort(-np.abs(np.nan_to_num(ratios) - 1.0))[:6]:
        one = real[place]
        print(f"  {one.name}: {one.mass_kg:.3f} kg, simulated over predicted {one.ratio:.4f}")
    return bool((np.abs(ratios - 1.0) <= OFF).all() and (too_high <= TOO_HIGH).all())


def main():
    options = held.options_of(__doc__)
    begun = time.perf_counter()
    cases = held.planned_cases(QUICK_EACH if options.quick else EACH)
    found = list(each(measure, [(case, options.stiffness) for case in cases], jobs=options.jobs))
    print(f"{time.perf_counter() - begun:.0f} s")
    if not report(found):
        sys.exit(f"a payload is more than {100 * OFF:g} % off, or {100 * TOO_HIGH:g} % too high")


if __name__ == "__main__":
    main()
