"""Bounds on friction and wrenches that simulation finds without knowing the planned forces.

Forces planned for a load presume the analysis that they are to confirm. Three kinds of trial
need none of these forces:

* Rigid fingertips are each put equally deep into their faces, so that elasticity alone squeezes the
  object. The least friction at which the object stays is never below the critical friction: where
  all fingers push and it rests, balanced forces in the cones exist. It may be far above, as equal
  depths need not give the best forces.
* With a fixed squeeze the fingers keep the forces of the gentle grasp, whatever the load. The
  largest multiple of a wrench that is resisted is never above the predicted limit, as the forces at
  rest are within the cones and the limit on the push. It may be far below.
* The acceleration that an axis wrench causes in the first instant is measured with rigid fingertips
  that just touch. No force is left over in any direction if contacts can oppose all of them.
  Contacts that only touch must be pressed first, so a small share is always left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.wrench_limits import axis_wrenches
from grasp_core.values import Grasp
from sim_validate.simulation.rig import Rig, squeezed
from sim_validate.simulation.schedules import Load
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import Bench, acceleration
from sim_validate.simulation.traces import Trace

INDENTATION = 2e-5
"""Depth to which rigid fingertips are put into the faces, in grasp sizes. Much deeper ones let the
object turn and adapt, and accept frictions below the critical one; without depth, contacts open and
nothing holds."""
TOUCH = 2e-6
"""Depth of rigid fingertips that only just touch, in grasp sizes. It is not zero because vertices
of a mesh have single precision."""
STEPS = (0.98, 1.02, 1.05, 1.1, 1.2, 1.4, 1.7, 2.0, 3.0, 5.0)
"""Frictions at which rigid fingertips are tried, relative to the critical friction."""
STIFFER = 20.0
"""Stiffness of the servos that keep a fixed squeeze, relative to servos that follow planned
forces."""
RISE_S = 2.0
LARGEST_SHARE = 1.2
"""Largest load that is tried with a fixed squeeze, relative to the predicted limit. The load rises
to it in `RISE_S` seconds, which is slow enough."""
SLIDING = 1e-3
"""Slide of a fingertip at which a fixed squeeze counts as given way, in grasp sizes."""
SLACK = 0.05
"""Relative excess by which a fixed squeeze may seem to pass a predicted limit: the object moves
under the load by some per cent of the grasp size."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds on friction and wrenches that trials without planned forces gave."""

    friction_at_most: float | None
    """Least friction tried at which rigid fingertips hold the object; None if they never did. If
    the analysis is right, it is not below the critical friction."""
    friction_slipped: float | None
    """Largest friction below `friction_at_most` at which the object slipped; None if it never
    did."""
    limit_shares: tuple[float, ...]
    """For each wrench, the share of its predicted limit at which a fixed squeeze gives way."""
    residual: float
    """Largest share of an axis wrench that accelerates the object in the first instant. Below about
    0.3 every wrench is opposed; near one some wrench is not."""

    def agree(self, critical: float) -> bool:
        """Tell whether the bounds lie on the right side of the predictions."""
        lowest = self.friction_at_most is None or self.friction_at_most >= critical
        return lowest and max(self.limit_shares) <= 1.0 + SLACK


def independent_bounds(
    body: Polyhedron, grasp: Grasp, critical: float, rig: Rig, limits: Sequence[Load]
) -> Bounds:
    """Measure bounds with rigid fingertips, with a fixed squeeze, and in the first instant."""
    slipped, stayed = _rigid_friction(body, grasp, critical, rig.setup)
    return Bounds(
        friction_at_most=stayed,
        friction_slipped=slipped,
        limit_shares=_fixed_squeeze(body, grasp, rig, limits),
        residual=first_residual(body, grasp, rig.friction, rig.setup),
    )


def _rigid_friction(
    body: Polyhedron, grasp: Grasp, critical: float, setup: Setup
) -> tuple[float | None, float | None]:
    """Find the largest friction at which the object slipped, and the least at which it stayed."""
    protocol = setup.friction
    frictions = [step * max(critical, protocol.least_friction) for step in STEPS]
    high = protocol.settling_friction * max(frictions)
    rig = _rigid(body, grasp, high, setup, INDENTATION)
    size = rig.bench.scene.layout.grasp_size_m
    threshold = protocol.threshold * size
    stays = [trace.stayed(threshold) for trace in rig.release(high, frictions, threshold)]
    first = stays.index(True) if True in stays else len(stays)
    slipped = frictions[first - 1] if first and stays[first - 1] is False else None
    return slipped, frictions[first] if first < len(stays) else None


def _rigid(
    body: Polyhedron, grasp: Grasp, friction: float, setup: Setup, indentation: float
) -> Rig:
    fingers = replace(setup.fingers, drive="rigid", indentation=indentation)
    scene = replace(setup, fingers=fingers).scene(body, grasp, friction)
    nothing = Load(np.zeros(6), np.zeros((len(grasp.contacts), 3)))
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    return Rig(bench, setup, friction, nothing, None)


def _fixed_squeeze(
    body: Polyhedron, grasp: Grasp, rig: Rig, limits: Sequence[Load]
) -> tuple[float, ...]:
    """Find the share of each limit at which a finger slides although forces stay unchanged.

    The servos are stiffer than usual, because without planned forces their springs give way to the
    whole load.
    """
    usual = rig.bench.scene.layout.drive.stiffness_n_per_m
    fingers = replace(rig.setup.fingers, stiffness_n_per_m=STIFFER * usual)
    slow = replace(rig.setup.limit, ramp_s=RISE_S)
    setup = replace(rig.setup, fingers=fingers, limit=slow)
    scene = setup.scene(body, grasp, rig.friction)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    stiff = squeezed(bench, setup, rig.idle.forces, rig.friction)
    kept = [Load(limit.wrench, rig.idle.forces) for limit in limits]
    traces, shares = stiff.ramp(kept, (0.0, LARGEST_SHARE))
    threshold = SLIDING * scene.layout.grasp_size_m
    return tuple(_until(trace, shares, threshold) for trace in traces)


def _until(trace: Trace, shares: Array, threshold: float) -> float:
    """Return the share of the load that is applied when a finger slides over or leaves its face."""
    moved = np.maximum(trace.slips_m, trace.gaps_m).max(axis=1)
    sliding = np.flatnonzero(~(moved < threshold))
    count = int(sliding[0]) if sliding.size else len(trace.times_s)
    return float(shares[count - 1]) if count else 0.0


def first_residual(body: Polyhedron, grasp: Grasp, friction: float, setup: Setup) -> float:
    """Compute the largest share of an axis wrench that accelerates the object at first."""
    physics = replace(
        setup.physics, diagexact=True, solref=(0.02, 1.0), tolerance=1e-15,
        solimp=(0.9999, 0.9999, 0.001, 0.5, 2.0),
    )  # fmt: skip
    rig = _rigid(body, grasp, friction, replace(setup, physics=physics), TOUCH)
    layout = rig.bench.scene.layout
    scale = np.array([1.0] * 3 + [layout.grasp_size_m] * 3)
    wrenches = axis_wrenches(layout.grasp_size_m) * rig.setup.fingers.max_normal_force_n
    left = acceleration(rig.bench.scene, wrenches)
    sizes = np.linalg.norm(wrenches / scale, axis=1)
    return float((np.linalg.norm(left / scale, axis=1) / sizes).max())
