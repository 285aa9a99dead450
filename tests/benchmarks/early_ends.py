"""Trials that end early against trials of full length: `python -m tests.benchmarks.early_ends`.

The same loads, controls and releases are simulated twice: to the protocol's full length, and until
the answer is known (`sim_validate.simulation.early_ends`). Loads are from 0.5 to 1.2 times what
each grasp resists and frictions from 0.9 to 1.1 times the critical one, with many close to 1, where
verdicts could differ. Ends with an error if one verdict differs.

    python -m tests.benchmarks.early_ends [--quick] [--jobs N]
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
from sim_validate.parallel.processes import each
from sim_validate.simulation.bench import Bench
from sim_validate.simulation.limits import forces_just_above, part
from sim_validate.simulation.loads import planned_loads
from sim_validate.simulation.rig import squeezed
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.simulation.traces import judge
from sim_validate.validation.controls import control_case, negative_controls

OBJECTS = (
    "tetrahedron", "octahedron", "dodecahedron", "box", "wedge", "chamfered-box", "l-bracket",
    "cross", "screwdriver", "prism", "random-8-3", "random-20-7",
)  # fmt: skip
FRICTIONS = (0.2, 0.5, 0.8)
FAMILIES = ("concurrent", "pencil", "regulus", "free")
SHARES = (0.5, 0.8, 0.95, 0.99, 0.998, 1.002, 1.01, 1.05, 1.2)
"""Loads, relative to the largest that the analysis says is resisted."""
NEAR = (0.9, 0.99, 0.997, 0.999, 1.0, 1.0006, 1.001, 1.002, 1.004, 1.01, 1.03, 1.1)
"""Frictions, relative to the critical one."""


@dataclass(frozen=True)
class Pair:
    """A trial to its full length, and the same trial until its answer is known."""

    kind: str
    where: str
    whole: str
    early: str
    moved: float
    """How much more the object moves in the whole trial if held, in thresholds."""
    samples: tuple[int, int]
    """Samples watched in the whole trial and in the other one."""


def cases(quick):
    each_kind = 1 if quick else 2
    for name, friction in product(OBJECTS[::3] if quick else OBJECTS, FRICTIONS):
        body = scenes.example_object(name)
        for family in FAMILIES:
            for grasp in gc.plan(body, friction, families=(family,), limit=each_kind).grasps:
                yield body, grasp, friction


def compared(case):
    body, grasp, friction = case
    where = f"{body.name} {grasp.id} at {friction:g}"
    found = [*of_holds(body, grasp, friction), *of_controls(body, grasp, friction)]
    return [replace(pair, where=where) for pair in (*found, *of_releases(body, grasp))]


def of_holds(body, grasp, friction):
    setup = Setup()
    scene = setup.scene(body, grasp, friction)
    rig = squeezed(Bench(scene), setup, scene.layout.squeeze_forces, friction)
    planned = planned_loads(body, grasp.contacts, friction, rig.idle, Agenda(), setup)
    loads = [part(rig.idle, each.limit, share) for each in planned for share in SHARES]
    return judged("hold", rig, loads)


def of_controls(body, grasp, friction):
    exact = replace(grasp, critical_friction=gc.critical_friction(grasp))
    for control in negative_controls(body, exact, friction, 0):
        rig, loads = control_case(body, control, Setup())
        settling = [each.settling for each in loads]
        yield from judged("control", rig, [each.load for each in loads], settling)


def judged(kind, rig, loads, settling=None):
    layout, protocol = rig.bench.scene.layout, rig.setup.hold
    whole = replace(rig, whole=True).hold(loads, settling)
    pairs = zip(whole, rig.hold(loads, settling), strict=True)
    limit = protocol.hold_threshold * layout.grasp_size_m
    for traces in pairs:
        whole, early = (judge(trace, layout, protocol) for trace in traces)
        held = whole.outcome.value == "held"
        moved = (whole.displacement_m - early.displacement_m) / limit if held else 0.0
        yield Pair(kind, "", whole.outcome.value, early.outcome.value, moved, lengths(traces))


def of_releases(body, grasp):
    setup, predicted = Setup(), gc.critical_friction(grasp)
    protocol = setup.friction
    least = max(predicted, protocol.least_friction)
    high = protocol.settling_friction * least
    try:
        forces = forces_just_above(grasp.positions, grasp.normals, least)
    except gc.UndecidedError:
        return
    forces *= 0.6 * setup.fingers.max_normal_force_n
    bench = Bench(setup.scene(body, grasp, least))
    rig = squeezed(bench, setup, forces, least, high)
    limit = min(protocol.threshold, 2e-3 * least) * bench.scene.layout.grasp_size_m
    frictions = [near * least for near in NEAR]
    whole, early = rig.release(high, frictions), rig.at_rest(high).release(high, frictions, limit)
    for traces in zip(whole, early, strict=True):
        ends = ["held" if trace.stayed(limit) else "slipped" for trace in traces]
        most = [float(trace.displacements_m.max()) / limit for trace in traces]
        moved = most[0] - most[1] if ends[0] == "held" else 0.0
        yield Pair("release", "", *ends, moved, lengths(traces))


def lengths(traces):
    whole, early = (len(trace.times_s) for trace in traces)
    return whole, early


def report(pairs):
    """Print a line for each kind of trial, then every difference; whether there is none."""
    for kind in dict.fromkeys(pair.kind for pair in pairs):
        own = [pair for pair in pairs if pair.kind == kind]
        ends = Counter(pair.whole for pair in own)
        told = ", ".join(f"{count} {end}" for end, count in ends.most_common())
        whole, early = np.sum([pair.samples for pair in own], axis=0)
        more = max(pair.moved for pair in own)
        unlike = sum(pair.whole != pair.early for pair in own)
        print(
            f"{kind:8s} {len(own)} trials ({told}), {unlike} verdicts differ; watched "
            f"{early / whole:.1%} as long, held objects move by {more:.2%} of the threshold more"
        )
    bad = [pair for pair in pairs if pair.whole != pair.early]
    for pair in bad:
        print(f"  {pair.kind} {pair.where}: {pair.whole} to the end, {pair.early} when ended early")
    print(f"{len(pairs)} trials, {len(bad)} verdicts differ")
    return not bad


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a sixth of the trials")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    begun = time.perf_counter()
    chosen = list(cases(options.quick))
    pairs = [pair for one in each(compared, chosen, jobs=options.jobs) for pair in one]
    good = report(pairs)
    print(f"{len(chosen)} grasps in {time.perf_counter() - begun:.0f} s")
    if not good:
        sys.exit("trials that end early are judged otherwise than trials of full length")


if __name__ == "__main__":
    main()
