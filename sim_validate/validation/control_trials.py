"""Simulates negative controls: contact sets that are proved unable to hold the object.

A proof that contacts are not in force closure is a separating wrench: no contact forces within the
friction cones oppose it. The control is loaded with this wrench. If contact forces cannot balance
even the bare squeeze, it is also tried without a load. The fingers do their best: they apply the
forces that need the least friction or, if none balance, those closest to balance.
"""

from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.by_value import ByValue
from grasp_core.forces.contact_forces import closest_forces, least_friction_forces
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.simulation.hold_verdict import LET_GO, HoldVerdict, Outcome, judge
from sim_validate.simulation.rig import Rig, squeezed
from sim_validate.simulation.schedules import Load
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.simulation.simulate import Bench
from sim_validate.simulation.traces import Trace
from sim_validate.validation.controls import Control

SEPARATING = "separating"
"""Name of the trial with the separating wrench, which the contacts provably cannot resist."""
UNLOADED = "unloaded"


@dataclass(frozen=True, slots=True, eq=False)
class ControlLoad:
    """A load under which a negative control must let go of the object."""

    name: str
    load: Load
    settling: float
    """Friction coefficient while the object settles, before the load is applied."""
    required_friction: float | None
    """Friction coefficient that the planned forces need; None if no forces balance the wrench."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ControlTrial(ByValue):
    """One simulated trial of a negative control under one load."""

    name: str
    wrench: Array
    """Applied external wrench, (6,) [N, N m], torque about the centre of mass."""
    required_friction: float | None
    """Friction coefficient that the planned forces need; None if no forces balance the wrench."""
    hold: HoldVerdict
    trace: Trace | None
    """Recorded motion in the trial; kept only if asked for."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ControlVerdict(ByValue):
    """How a negative control, a contact set proved not to be force-closed, ended in simulation."""

    control: Control
    tried: tuple[ControlTrial, ...]
    """Trials of the loads that no contact forces can balance."""

    @property
    def held(self) -> bool:
        """Whether the control held any of the loads, which it must not."""
        return any(trial.hold.outcome is Outcome.HELD for trial in self.tried)

    @property
    def let_go(self) -> bool:
        """Whether the object moved in every trial, as it must."""
        return all(trial.hold.outcome in LET_GO for trial in self.tried)


def try_control(body: Polyhedron, control: Control, agenda: Agenda, setup: Setup) -> ControlVerdict:
    """Simulate a negative control under the loads that it must not hold."""
    rig, loads = control_case(body, control, setup)
    traces = rig.hold([each.load for each in loads], [each.settling for each in loads])
    layout = rig.bench.scene.layout
    tried = tuple(
        ControlTrial(
            each.name, each.load.wrench, each.required_friction, judge(trace, layout, setup.hold),
            trace if agenda.keep_traces else None,
        )
        for each, trace in zip(loads, traces, strict=True)
    )  # fmt: skip
    return ControlVerdict(control, tried)


def control_case(
    body: Polyhedron, control: Control, setup: Setup
) -> tuple[Rig, tuple[ControlLoad, ...]]:
    """Close fingers on a control, and find the loads that it must not hold."""
    # Other contacts than the grasp's may lack room for its fingertips or lie off the mesh.
    fingers = replace(setup.fingers, radius_m=None)
    on_pads = replace(setup, fingers=fingers, surface="pads")
    scene = on_pads.scene(body, control.contacts, control.friction)
    plan = _Planner(body, control, setup)
    idle = plan.load(UNLOADED, np.zeros(6))
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, idle.load.forces, control.friction, idle.settling)
    hopeless = _hopeless(body, control, setup)
    return rig, tuple(
        idle if name == UNLOADED else plan.load(name, wrench) for name, wrench in hopeless
    )


def _hopeless(body: Polyhedron, control: Control, setup: Setup) -> list[tuple[str, Array]]:
    """The separating wrench, and a zero wrench if no forces balance the bare squeeze."""
    # The separating wrench is a linear function of wrenches. With torques measured in object
    # radii its coefficients are times the scale; the wrench along them is times it once more.
    scale = np.array([1.0] * 3 + [body.radius] * 3)
    facing = -control.separating_wrench(body.center_of_mass) * scale**2
    size = setup.hold.control_load * setup.fingers.max_normal_force_n
    loads = [(SEPARATING, to_digits(size * facing / float(np.linalg.norm(facing / scale))))]
    if control.certificate.margin < -setup.hold.least_excess:
        loads.append((UNLOADED, np.zeros(6)))
    return loads


class _Planner:
    """Plans finger forces on a negative control: of least friction, or nearest to balance."""

    def __init__(self, body: Polyhedron, control: Control, setup: Setup) -> None:
        self.contacts = (
            np.array([contact.position for contact in control.contacts]),
            np.array([contact.normal for contact in control.contacts]),
            control.friction,
        )
        largest = setup.fingers.max_normal_force_n
        self.limits = (setup.hold.least_normal_share * largest, largest)
        self.center, self.protocol = body.center_of_mass, setup.hold

    def load(self, name: str, wrench: Array) -> ControlLoad:
        """Plan forces for a wrench."""
        forces, needed = self._forces(wrench)
        settling = self.protocol.settling_friction * max(self.contacts[2], needed or 0.0)
        return ControlLoad(name, Load(wrench, forces), settling, needed)

    def _forces(self, wrench: Array) -> tuple[Array, float | None]:
        """Planned forces, (k, 3) [N], and their friction; None if none balance."""
        limits, center = self.limits, self.center
        balanced = least_friction_forces(*self.contacts, wrench, normal_force=limits, center=center)
        if balanced is not None:
            return to_digits(balanced[0]), float(to_digits(np.array(balanced[1])))
        return to_digits(
            closest_forces(*self.contacts, wrench, normal_force=limits, center=center)
        ), None
