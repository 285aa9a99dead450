"""The same loads, controls and releases simulated twice: in full, and until the answer is known.

Loads are from 0.5 to 1.2 times what each grasp resists and frictions from 0.9 to 1.1 times the
critical one, with many close to 1, where verdicts could differ.
"""

from dataclasses import dataclass, replace

import grasp_core as gc
from sim_validate.closure.controls import control_case, negative_controls
from sim_validate.engine.bench import Bench
from sim_validate.engine.rig import Analysis, forces_just_above, part, squeezed
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import judge

SHARES = (0.5, 0.8, 0.95, 0.99, 0.998, 1.002, 1.01, 1.05, 1.2)
"""Loads, relative to the largest that the analysis says is resisted."""
NEAR = (0.9, 0.99, 0.997, 0.999, 1.0, 1.0006, 1.001, 1.002, 1.004, 1.01, 1.03, 1.1)
"""Frictions, relative to the critical one."""


@dataclass(frozen=True)
class Pair:
    """A trial to its full length, and the same trial until its answer is known."""

    whole: str
    early: str
    samples: tuple[int, int]
    """Samples watched in the whole trial and in the other one."""


def compared(case):
    body, grasp, friction = case
    held = [*of_holds(body, grasp, friction), *of_controls(body, grasp, friction)]
    return [*held, *of_releases(body, grasp)]


def of_holds(body, grasp, friction):
    setup = Setup()
    scene = setup.scene(body, grasp, friction)
    rig = squeezed(Bench(scene), setup, scene.layout.squeeze_forces, friction)
    planned = Analysis(body, grasp.contacts, friction, setup, None).planned(rig.idle, Agenda())
    loads = [part(rig.idle, each.limit, share) for each in planned for share in SHARES]
    return judged(rig, loads)


def of_controls(body, grasp, friction):
    exact = replace(grasp, critical_friction=gc.critical_friction(grasp))
    for control in negative_controls(body, exact, friction, 0):
        rig, loads = control_case(body, control, Setup())
        settling = [each.settling for each in loads]
        yield from judged(rig, [each.load for each in loads], settling)


def judged(rig, loads, settling=None):
    layout, protocol = rig.bench.scene.layout, rig.setup.hold
    pairs = zip(
        replace(rig, whole=True).hold(loads, settling), rig.hold(loads, settling), strict=True
    )
    for traces in pairs:
        whole, early = (judge(trace, layout, protocol) for trace in traces)
        yield Pair(whole.outcome.value, early.outcome.value, lengths(traces))


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
        yield Pair(*ends, lengths(traces))


def lengths(traces):
    whole, early = (len(trace.times_s) for trace in traces)
    return whole, early
