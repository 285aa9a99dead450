"""Predicted against simulated, with teeth: `python -m tests.benchmarks.fidelity [OBJECT ..]`.

`--quick` tries few grasps. `--torsion SHARE` tries some hundred grasps with soft fingertips
instead, whose torsional coefficient is that share of the object's radius, and finds limits by
repeated holds: soft contacts yield a little before they turn, which a ramp may read as the limit.
Objects are built-in ones, or "bar with holes".

Grasps of all families on several objects, friction 0.2 to 0.8: critical friction, largest wrench in
random directions, holds inside and outside the predicted limit, and negative controls.
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.closure.contacts import contact_frictions, contact_torsions
from grasp_core.quality.wrench_limits import WrenchBody, limit_of
from grasp_core.time_spent import TIME_SPENT, in_words
from scenes.mujoco_options import PhysicsSettings
from sim_validate.closure.controls import negative_controls, try_control
from sim_validate.engine.held_or_let_go import Outcome, judge
from sim_validate.engine.rig import squeezed
from sim_validate.engine.schedules import TrialLoad, part
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.simulated_friction import released_friction
from sim_validate.engine.simulated_limits import bisected_limits, ramped_limits
from sim_validate.engine.stepping import Bench
from sim_validate.processes.workers import available_cores, each
from tests.benchmarks.objects import FAMILIES
from tests.grasp_core.long_shapes import MM, with_holes

OBJECTS = (
    "tetrahedron", "octahedron", "wedge", "chamfered-box", "double-wedge-bar", "box", "prism",
    "l-bracket", "cross", "screwdriver", "hexagonal-pyramid", "random-8-3", "random-12-1",
    "random-16-1", "random-20-7",
)  # fmt: skip
FRICTIONS = (0.2, 0.35, 0.5, 0.8)
QUICK = (("wedge", "chamfered-box", "l-bracket", "random-12-1"), (0.3, 0.6))
SOFT = (*QUICK[0], "box", "tetrahedron"), (0.2, 0.5)
EACH = 3
"""Grasps of one family on one object at one friction."""
DIRECTIONS = 24
INSIDE, OUTSIDE = 0.9, 1.1
HELD_DIRECTIONS = 10


@dataclass(frozen=True)
class Case:
    body: gc.Polyhedron
    grasp: gc.Grasp
    friction: float
    place: int
    torsion: float
    """Torsional coefficient over the object's radius."""

    @property
    def setup(self):
        return Setup(physics=PhysicsSettings(torsion_m=self.torsion * self.body.radius))


@dataclass(frozen=True)
class Found:
    """What one grasp gave."""

    family: str
    name: str
    critical: object
    shares: list
    inside: list
    outside: list
    controls: list


def body_of(name):
    if name == "bar with holes":
        made = with_holes((120.0, 40.0, 20.0), 16.0, 3, 8)
        return gc.Polyhedron.from_mesh(MM * made.vertices, made.faces, name=name)
    return scenes.example_object(name)


def cases(objects, frictions, each_family, torsion=0.0):
    found = []
    for name, friction, family in product(objects, frictions, FAMILIES):
        body = body_of(name)
        for grasp in gc.plan(body, friction, families=(family,), limit=each_family).grasps:
            found.append(Case(body, grasp, friction, len(found), torsion))
    return found


def limiting_loads(case, setup, count, seed):
    """Random wrenches at their predicted limits, with the forces that balance them."""
    body, grasp, mu = case.body, case.grasp, contact_frictions(case.friction, 4)
    resisted = WrenchBody(
        grasp.positions - body.center_of_mass, grasp.normals, mu,
        setup.fingers.max_normal_force_n, torsions=contact_torsions(setup.physics.torsion_m, mu),
    )  # fmt: skip
    scale = np.array([1.0] * 3 + [body.radius] * 3)
    drawn = np.random.default_rng(seed).normal(size=(count, 6)) * scale
    limits = [limit_of(resisted, wrench) for wrench in drawn]
    return [TrialLoad(limit.limit * limit.wrench, limit.forces) for limit in limits]


def examine(case):
    """All figures of one grasp."""
    setup = case.setup
    scene = setup.scene(case.body, case.grasp, case.friction)
    bench, layout = Bench(scene), scene.layout
    squeeze = np.einsum("kij,kj->ki", layout.frames, layout.squeeze)
    rig = squeezed(bench, setup, squeeze, case.friction)
    limits = limiting_loads(case, setup, DIRECTIONS, case.place)
    near = limits[:HELD_DIRECTIONS]
    tried = [part(rig.idle, limit, share) for share in (INSIDE, OUTSIDE) for limit in near]
    ends = [judge(trace, layout, setup.hold).outcome for trace in rig.traced(rig.holds(tried))]
    critical = gc.critical_friction(case.grasp, torsion_m=setup.physics.torsion_m)
    known = replace(case.grasp, critical_friction=critical)
    verdicts = [
        try_control(case.body, control, Agenda(), setup)
        for control in negative_controls(case.body, known, case.friction, case.place, setup)
    ]
    measured = bisected_limits(rig, near) if case.torsion else ramped_limits(rig, limits)
    return Found(
        family=case.grasp.family,
        name=case.body.name,
        critical=released_friction(bench, known.positions, known.normals, critical, setup),
        shares=[limit.share if limit else float("nan") for limit in measured],
        inside=ends[: len(near)],
        outside=ends[len(near) :],
        controls=[(each.control.name, each.held, each.let_go) for each in verdicts],
    )


MUST_BE_ZERO = (
    "critical_not_found", "limits_not_found", "false_unstable", "false_stable", "controls_held",
    "controls_not_let_go",
)  # fmt: skip


def report(found):
    """The figures of all grasps, and lines that say them."""
    positive = [f.critical for f in found if f.critical.predicted >= 1e-3]
    ratios = np.array([c.simulated / c.predicted if c.simulated else np.nan for c in positive])
    shares = np.concatenate([f.shares for f in found])
    inside = Counter(end for f in found for end in f.inside)
    outside = Counter(end for f in found for end in f.outside)
    controls = [control for f in found for control in f.controls]
    kinds = Counter(kind for kind, _, _ in controls)
    off, wide = np.abs(ratios - 1.0), np.abs(shares - 1.0)
    figures = {
        "grasps": len(found),
        "families": dict(Counter(f.family for f in found)),
        "objects": len({f.name for f in found}),
        "critical_frictions": len(ratios),
        "critical_not_found": int(np.isnan(ratios).sum()),
        "critical_worst": float(np.nanmax(off)),
        "tiny_critical_frictions": len(found) - len(positive),
        "limits": len(shares),
        "limits_not_found": int(np.isnan(shares).sum()),
        "limit_median_error": float(np.nanmedian(wide)),
        "limit_range": [float(np.nanmin(shares)), float(np.nanmax(shares))],
        "inside": sum(inside.values()),
        "false_unstable": sum(inside.values()) - inside[Outcome.HELD],
        "outside": sum(outside.values()),
        "false_stable": outside[Outcome.HELD],
        "outside_outcomes": {end.value: count for end, count in outside.items()},
        "controls": len(controls),
        "control_kinds": dict(kinds),
        "controls_held": sum(held for _, held, _ in controls),
        "controls_not_let_go": sum(not failed for _, _, failed in controls),
    }
    for name, value in figures.items():
        print(f"{name.replace('_', ' '):34s} {value}")
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="*", metavar="OBJECT")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--torsion", type=float, default=0.0, metavar="SHARE")
    options = parser.parse_args()
    usual, each_family = (OBJECTS, FRICTIONS), EACH
    if options.torsion:
        usual = SOFT
    elif options.quick:
        usual, each_family = QUICK, 2
    chosen = cases(options.objects or usual[0], usual[1], each_family, options.torsion)
    begun = time.perf_counter()
    TIME_SPENT.taken()  # that of planning
    found = list(each(examine, chosen, jobs=available_cores()))
    print(f"examined in {time.perf_counter() - begun:.0f} s; {in_words(TIME_SPENT.taken())}")
    figures = report(found)
    wrong = [name for name in MUST_BE_ZERO if figures[name]]
    if wrong:
        sys.exit(f"these must be zero: {', '.join(wrong)}")


if __name__ == "__main__":
    main()
