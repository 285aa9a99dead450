"""Simulated against predicted critical friction: `python -m tests.benchmarks.critical_frictions`.

Grasps of all families whose critical friction can be measured: of boxes planned at friction 1 to 2,
where two fingers alone may need it, of other objects, and of objects of a millimetre and of two
metres. Ends with an error if one is not found, or farther off than half a per cent.

    python -m tests.benchmarks.critical_frictions [--only boxes|others|1mm|2m] [--jobs N]
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

import grasp_core as gc
import scenes
from sim_validate.engine.setup import Setup
from sim_validate.engine.simulated_friction import released_friction
from sim_validate.engine.stepping import Bench
from sim_validate.processes.workers import available_cores, each
from tests.benchmarks.objects import FAMILIES

WORST = 0.005
"""Largest error of a critical friction, relative to the predicted one."""
OBJECTS = (
    "tetrahedron", "octahedron", "wedge", "chamfered-box", "double-wedge-bar", "prism",
    "l-bracket", "cross", "screwdriver", "hexagonal-pyramid", "random-8-3", "random-12-1",
    "random-16-1", "random-20-7",
)  # fmt: skip
FRICTIONS = (0.2, 0.35, 0.5, 0.8)
HIGH_FRICTIONS = (1.0, 1.25, 1.5, 2.0)
EACH = 4
"""Grasps of one family on one object at one friction."""


@dataclass(frozen=True)
class Case:
    group: str
    body: gc.Polyhedron
    grasp: gc.Grasp
    friction: float


def boxes() -> Iterator[tuple[gc.Polyhedron, float]]:
    """Boxes of many proportions, the example among them, each with a friction to plan at."""
    rng = np.random.default_rng(0)
    example = scenes.example_object("box")
    while True:
        for friction in HIGH_FRICTIONS:
            yield example, friction
        stretch = rng.uniform(0.3, 1.0, size=3)
        example = gc.Polyhedron.from_mesh(
            stretch * scenes.example_object("box").vertices, example.triangles, name="box"
        )


def others() -> Iterator[tuple[gc.Polyhedron, float]]:
    for friction, name in product(FRICTIONS, OBJECTS):
        yield scenes.example_object(name), friction


def of_extent(extent_m: float) -> Iterator[tuple[gc.Polyhedron, float]]:
    """The same objects and boxes at another size."""
    for friction, name in product((0.3, 1.0, 0.6, 1.5), ("box", *OBJECTS)):
        body = scenes.example_object(name)
        scale = extent_m / float(np.ptp(body.vertices, axis=0).max())
        yield gc.Polyhedron.from_mesh(scale * body.vertices, body.triangles, name=name), friction


GROUPS = {
    "boxes": (boxes, 150),
    "others": (others, 450),
    "1mm": (lambda: of_extent(1e-3), 100),
    "2m": (lambda: of_extent(2.0), 100),
}


def cases(group: str) -> Iterator[Case]:
    """As many grasps as asked for whose critical friction is not too small to be measured."""
    source, count = GROUPS[group]
    least = Setup().friction.least_friction
    found = (
        Case(group, body, grasp, friction)
        for body, friction in source()
        for family in FAMILIES
        for grasp in gc.plan(body, friction, families=(family,), limit=EACH).grasps
        if gc.critical_friction(grasp) >= least
    )
    return islice(found, count)


def measure(case: Case) -> tuple[Case, float, float]:
    """Its predicted critical friction and the simulated one, NaN where it was not found."""
    setup, grasp = Setup(), case.grasp
    predicted = gc.critical_friction(grasp)
    bench = Bench(setup.scene(case.body, grasp, max(case.friction, predicted)))
    found = released_friction(bench, grasp.positions, grasp.normals, predicted, setup)
    return case, predicted, np.nan if found.simulated is None else found.simulated


def report(found: list[tuple[Case, float, float]]) -> bool:
    """Print a line for each group, then the worst grasps; whether all are good."""
    errors = np.array([simulated / predicted - 1.0 for _, predicted, simulated in found])
    groups = np.array([case.group for case, _, _ in found])
    for group in dict.fromkeys(groups):
        own = errors[groups == group]
        missing = int(np.isnan(own).sum())
        low, middle, high = np.nanmin(own), np.nanmedian(own), np.nanmax(own)
        print(
            f"{group:8s} {len(own)} grasps, {missing} not found, error from {100 * low:+.3f} to "
            f"{100 * high:+.3f} %, median {100 * middle:+.3f} %"
        )
    off = np.where(np.isnan(errors), np.inf, np.abs(errors))
    for place in np.argsort(-off)[:5]:
        case, predicted, simulated = found[place]
        name = f"{case.group} {case.body.name} {case.grasp.id} at {case.friction:g}"
        print(f"  {name}: {simulated:.5f}, predicted {predicted:.5f}")
    return bool((off <= WORST).all())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=GROUPS, default=tuple(GROUPS))
    parser.add_argument("--jobs", type=int, default=available_cores())
    options = parser.parse_args()
    chosen = [case for group in options.only for case in cases(group)]
    short = [
        group for group in options.only
        if sum(case.group == group for case in chosen) < GROUPS[group][1]
    ]  # fmt: skip
    good = report(list(each(measure, chosen, jobs=options.jobs)))
    if short:
        sys.exit(f"too few grasps: {', '.join(short)}")
    if not good:
        sys.exit(f"a critical friction is missing, or more than {100 * WORST:g} % off")


if __name__ == "__main__":
    main()
