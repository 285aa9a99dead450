"""The object's own surface against pads: `python -m tests.benchmarks.surfaces [--quick]`.

Grasps of all families on convex and other objects, each validated twice: with fingertips on the
object itself, and on pads that are flush with its faces. Verdicts must be the same, and critical
frictions within `ALIKE`; each exception is listed. Of many more grasps, those are counted whose
fingertips, as large as they are unless stated, would overlap a face at the start.
"""

import sys
from dataclasses import dataclass
from itertools import product

import grasp_core as gc
import scenes
from scenes.mujoco.fingertips import clashes, fitting_radius
from sim_validate.closure.validate import tested
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import Outcome
from sim_validate.kit.processes import available_cores, each
from sim_validate.settings import FrictionProtocol
from tests.benchmarks.objects import FAMILIES

OBJECTS = (
    "tetrahedron", "octahedron", "wedge", "chamfered-box", "double-wedge-bar", "prism",
    "hexagonal-pyramid", "random-12-1", "random-20-7", "l-bracket", "cross", "screwdriver", "mug",
    "hex-nut", "dodecahedron",
)  # fmt: skip
QUICK = ("wedge", "l-bracket", "hex-nut")
FRICTION, EACH = 0.5, 6
FRICTIONS, MOST = (0.2, 0.5, 0.8), 300
"""Frictions and largest number of grasps of one plan whose starts are looked at."""
ALIKE = 1e-3
"""Largest relative difference of critical frictions."""
AGENDA = Agenda(controls=False)
FINE = FrictionProtocol(rounds=7)
"""Halves the interval of the critical friction to a share of 1.6e-4."""


@dataclass(frozen=True)
class Pair:
    """What one grasp gave on the object's own surface, and on pads."""

    name: str
    grasp: str
    own: tuple[str, ...]
    pads: tuple[str, ...]
    critical: tuple[float | None, float | None]
    predicted: float

    @property
    def alike(self):
        own, pads = self.critical
        close = own == pads if None in self.critical else abs(own - pads) <= ALIKE * pads
        return self.own == self.pads and close

    def __str__(self):
        other = [pair for pair in zip(self.own, self.pads, strict=True) if pair[0] != pair[1]]
        critical = f"critical {self.critical}, predicted {self.predicted:.6g}"
        return f"{self.name} {self.grasp}: {critical}; outcomes {other}"


def compared(case):
    name, grasp = case
    body = scenes.example_object(name)
    found = [
        tested(body, grasp, FRICTION, None, AGENDA, Setup(surface=surface, friction=FINE))
        for surface in ("object", "pads")
    ]
    outcomes = [tuple(each.hold.outcome.value for each in verdict.wrenches) for verdict in found]
    critical = [verdict.critical_friction.simulated for verdict in found]
    return Pair(name, grasp.id, *outcomes, tuple(critical), grasp.critical_friction)


def cases(names):
    for name in names:
        body = scenes.example_object(name)
        for family in FAMILIES:
            for grasp in gc.plan(body, FRICTION, families=(family,), limit=EACH).grasps:
                yield name, grasp


def overlapping(case):
    """The number of grasps of a plan, and the names of those that start overlapping."""
    name, friction = case
    body = scenes.example_object(name)
    grasps = gc.plan(body, friction, limit=MOST).grasps
    radii = [fitting_radius(body, grasp.positions, grasp.normals) for grasp in grasps]
    return len(grasps), [
        f"{name} {grasp.id}"
        for grasp, radius in zip(grasps, radii, strict=True)
        if clashes(body, grasp.positions, grasp.normals, radius)
    ]


def main():
    names = QUICK if "--quick" in sys.argv else OBJECTS
    found = list(each(compared, list(cases(names)), jobs=available_cores()))
    invalid = [pair for pair in found if Outcome.INVALID_START.value in pair.own]
    differ = [pair for pair in found if not pair.alike]
    print(f"{len(found)} grasps on {len(names)} objects, friction {FRICTION}")
    print(f"{len(differ)} differ from pads (outcome, or critical friction by over {ALIKE:g}):")
    print(*(f"  {pair}" for pair in differ), sep="\n")
    print(f"{len(invalid)} start overlapping:", *(f"{p.name} {p.grasp}" for p in invalid))
    starts = list(each(overlapping, list(product(names, FRICTIONS)), jobs=available_cores()))
    bad = [grasp for _, own in starts for grasp in own]
    print(f"{len(bad)} of {sum(count for count, _ in starts)} planned start overlapping:", *bad)


if __name__ == "__main__":
    main()
