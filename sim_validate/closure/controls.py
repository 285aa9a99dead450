"""Makes negative controls, contact sets that are proved unable to hold the object, and tries them.

A validator that never rejects anything proves nothing. Each control is derived from a grasp and
carries a proof that it is not force-closed: a separating wrench that no contact forces within the
friction cones oppose, whatever the fingers do. In simulation it is loaded with this wrench. If
contact forces cannot balance even the bare squeeze, it is also tried without a load. The fingers do
their best: they apply the forces that need the least friction or, if none balance, those closest to
balance.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Annotated

import numpy as np
from annotated_types import Len
from pydantic import Field, computed_field

from grasp_core.allowed_values import FLAT, Friction
from grasp_core.arrays import Array, Wrench, cross, rounded, to_digits
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.contacts import stacked, unit_size
from grasp_core.closure.decision import deepest_forces
from grasp_core.declared import Declared, declared
from grasp_core.errors import SolverError, UndecidedError
from grasp_core.figures import Shown
from grasp_core.files.records import UNRECORDED
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.contact_forces import least_friction_forces
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.fingertip_room import clashes, fitting_radius
from sim_validate.engine.held_or_let_go import LET_GO, HoldVerdict, Outcome, Trace, judge
from sim_validate.engine.rig import Rig, squeezed
from sim_validate.engine.schedules import TrialLoad
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.stepping import Bench

LOW_FRICTION = "low_friction"
FRICTION_SHARE = 0.9
"""Friction of the low-friction control, relative to the lowest at which the grasp is in closure."""
LEAST_CONTROL_FRICTION = 1e-4
"""Lowest friction of a negative control; the simulator's own limit is 1e-5."""
CLOSED_MARGIN = 1e-6
"""Margin of closure above which contacts are passed over without a proof: they make no control."""
SEARCH = 64
"""Number of random displacements of the contacts that are tried to lose force closure."""
TOWARD_CORNER = 0.95
"""How far a moved contact goes towards a corner of its face, as a share of the way."""


@declared
class Control(Declared):
    """A negative control: contacts that must not hold, with the proof that they cannot."""

    name: Annotated[str, Shown("control")]
    friction: Annotated[Friction, Shown("friction")]
    """The coefficient of the control: that of the run, or 0.9 of the critical friction
    (`low_friction`)."""
    certificate: ClosureCertificate
    """The proof that its contacts are not in force closure."""

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts, which the certificate is about."""
        proof = self.certificate
        return tuple(map(Contact, proof.positions, proof.normals))

    def separating_wrench(self, center: Array) -> Array:
        """The wrench that the contacts provably cannot resist, (6,), with torque about `center`."""
        wrench = self.certificate.separating_wrench
        assert wrench is not None  # noqa: S101 - controls are refuted by construction
        return np.concatenate([wrench[:3] + cross(wrench[3:], center), wrench[3:]])


def negative_controls(
    body: Polyhedron, grasp: Grasp, friction: float, seed: int, setup: Setup | None = None
) -> tuple[Control, ...]:
    """Make the controls that exist: low friction, fewer fingers, moved contacts; all proved."""
    setup = setup or Setup()
    lower = FRICTION_SHARE * grasp.critical_friction
    low_friction = _refuted(LOW_FRICTION, grasp.contacts, lower, setup)
    candidates = (
        low_friction if lower >= LEAST_CONTROL_FRICTION else iter(()),
        _fingers_removed(grasp, friction, setup),
        _contacts_moved(body, grasp, friction, setup, np.random.default_rng(seed)),
    )
    return tuple(found for tries in candidates if (found := next(tries, None)) is not None)


def _fingers_removed(grasp: Grasp, friction: float, setup: Setup) -> Iterator[Control]:
    """Yield a negative control with one finger fewer, at lower friction if needed, or two fewer.

    Without friction no three contacts are in closure, so any three are open below some friction.
    Two hard contacts are open at any friction, because the object can always turn about the line
    between them.
    """
    threes = list(combinations(grasp.contacts, 3))
    for rest in threes:
        yield from _refuted("fingers_removed", rest, friction, setup)
    for rest in threes:
        lower = math.inf
        with suppress(SolverError, UndecidedError):
            lower = FRICTION_SHARE * setup.critical_friction(rest)
        if LEAST_CONTROL_FRICTION <= lower <= friction:
            yield from _refuted("fingers_removed", rest, lower, setup)
    for rest in combinations(grasp.contacts, 2):
        yield from _refuted("fingers_removed", rest, friction, setup)


def _contacts_moved(
    body: Polyhedron, grasp: Grasp, friction: float, setup: Setup, rng: np.random.Generator
) -> Iterator[Control]:
    pieces = [body.faces[face].pieces for face in grasp.faces]
    for _ in range(SEARCH):
        moved = list[Contact]()
        for choice, contact in zip(pieces, grasp.contacts, strict=True):
            piece = choice[int(rng.integers(len(choice)))]
            corner, middle = piece[int(rng.integers(len(piece)))], piece.mean(axis=0)
            moved.append(Contact(middle + TOWARD_CORNER * (corner - middle), contact.normal))
        positions, normals = stacked(moved)
        for control in _refuted("contacts_moved", moved, friction, setup):
            if not clashes(body, positions, normals, fitting_radius(body, positions, normals)):
                yield control


def _refuted(
    name: str, contacts: Sequence[Contact], friction: float, setup: Setup
) -> Iterator[Control]:
    """Yield the negative control if the analysis proves that it is not force-closed."""
    positions, normals = stacked(contacts)
    given = unit_size(positions)[0][None], normals[None], np.array([friction])
    margin = float(deepest_forces(*given)[2][0, 0])
    if margin > CLOSED_MARGIN:  # a proof takes ten times as long
        return
    try:
        certificate = setup.closure(contacts, friction)
    except UndecidedError:
        return
    if not certificate.closed:
        yield Control(name, friction, certificate)


SEPARATING = "separating"
UNLOADED = "unloaded"


@dataclass(frozen=True, slots=True, eq=False)
class ControlLoad:
    """A load under which a negative control must let go of the object."""

    name: str
    load: TrialLoad
    settling: float  # friction coefficient while the object settles, before the load is applied
    required_friction: float | None


@declared
class ControlTrial(Declared):
    """One simulated trial of a negative control under one load."""

    name: str
    wrench: Wrench
    required_friction: float | None
    """Friction coefficient that the planned forces need; None if no forces balance the wrench."""
    hold: Annotated[HoldVerdict, FLAT]
    trace: Annotated[Trace | None, UNRECORDED] = field(default=None, compare=False)


@declared
class ControlVerdict(Declared):
    """How a negative control, a contact set proved not to be force-closed, ended in simulation."""

    control: Annotated[Control, FLAT]
    tried: Annotated[tuple[ControlTrial, ...], Len(1), Field(alias="trials")]

    @computed_field
    @property
    def held(self) -> bool:
        """Whether the control held any of the loads, which it must not."""
        return any(trial.hold.outcome is Outcome.HELD for trial in self.tried)

    @computed_field
    @property
    def let_go(self) -> bool:
        """Whether the object moved in every trial, as it must."""
        return all(trial.hold.outcome in LET_GO for trial in self.tried)


def try_control(
    body: Polyhedron, control: Control, agenda: Agenda, setup: Setup,
    compiled: Bench[Scene] | None = None,
) -> ControlVerdict:  # fmt: skip
    """Simulate a negative control under the loads that it must not hold (see `control_case`)."""
    rig, loads = control_case(body, control, setup, compiled)
    traces = rig.traced(rig.holds([each.load for each in loads], [each.settling for each in loads]))
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
    body: Polyhedron, control: Control, setup: Setup, compiled: Bench[Scene] | None = None
) -> tuple[Rig, tuple[ControlLoad, ...]]:
    """Close fingers on a control, and find the loads that it must not hold.

    A scene of the same contacts that is `compiled` with any friction is used again: trials are told
    theirs.
    """
    idle = _planned(body, control, setup, UNLOADED, np.zeros(6))
    bench = compiled
    if bench is None:
        # other contacts than the grasp's may lack room for its fingertips
        fitting = replace(setup, fingers=replace(setup.fingers, fingertip_radius_m=None))
        scene = fitting.scene(body, control.contacts, control.friction, idle.load.forces)
        bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, idle.load.forces, control.friction, idle.settling)
    # The separating wrench is a linear function of wrenches. With torques measured in object
    # radii its coefficients are times the scale; the wrench along them is times it once more.
    scale = np.array([1.0] * 3 + [body.radius] * 3)
    facing = -control.separating_wrench(body.center_of_mass) * scale**2
    size = setup.hold.control_load * setup.fingers.max_normal_force_n
    wrench = to_digits(size * facing / float(np.linalg.norm(facing / scale)))
    loads = [_planned(body, control, setup, SEPARATING, wrench)]
    if control.certificate.margin < -setup.hold.least_excess:  # no forces balance the bare squeeze
        loads.append(idle)
    return rig, tuple(loads)


def _planned(
    body: Polyhedron, control: Control, setup: Setup, name: str, wrench: Array
) -> ControlLoad:
    """Plan forces for a wrench: of least friction, or nearest to balance where none balance it."""
    largest = setup.fingers.max_normal_force_n
    limits = (setup.hold.least_normal_share * largest, largest)
    forces, needed = least_friction_forces(
        *stacked(control.contacts), control.friction, wrench,
        normal_force=limits, center=body.center_of_mass,
    )  # fmt: skip
    needed = None if needed is None else rounded(needed)
    settling = setup.hold.settling_friction * max(control.friction, needed or 0.0)
    return ControlLoad(name, TrialLoad(wrench, to_digits(forces)), settling, needed)
