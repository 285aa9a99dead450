"""Simulates one trial of a recorded contact set again.

Trials of a scene do not influence each other, so one by itself moves as it did among the others.
It is simulated twice: until its answer is known, for the verdict as it was recorded, and to the
protocol's full length, to be looked at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grasp_core.closure.contacts import stacked
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.fingertips import clashes
from scenes.mjcf import Scene
from sim_validate.replaying.recorded import Recorded
from sim_validate.simulation.hold_verdict import HoldVerdict, invalid_start, judge
from sim_validate.simulation.loads import PlannedLoad, planned_loads
from sim_validate.simulation.rig import Rig, Watched, squeezed
from sim_validate.simulation.schedules import Load
from sim_validate.simulation.setup import WEAKEST, Setup
from sim_validate.simulation.simulate import Bench
from sim_validate.validation.control_trials import control_case
from sim_validate.validation.controls import Control
from sim_validate.validation.repeats import OPEN, disturbed_in, for_repeats, noisy_case


@dataclass(frozen=True, slots=True, eq=False)
class Replayed:
    """The motion and outcome of one trial that was simulated again."""

    name: str
    """Name of the wrench that is applied."""
    load: Load
    predicted_limit: float | None
    """Largest multiple of the wrench that is resisted, according to the analysis. It is None for
    contacts without force closure, whose loads nothing resists."""
    required_friction: float | None
    """Friction coefficient that the planned forces need; None if no forces balance the wrench."""
    friction: float
    hold: HoldVerdict
    """The verdict on the trial, which ends when its answer is known."""
    watched: Watched
    """The motion of the trial to its full length."""
    scene: Scene


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """A load that can be simulated again, and how it is applied."""

    load: Load
    predicted_limit: float | None
    required_friction: float | None
    settling: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """Contacts squeezed by their fingers, and the loads that can be applied to them."""

    rig: Rig
    loads: Mapping[str, _Held]
    overlap: tuple[str, ...] = ()


def replayed(recorded: Recorded, wrench: str | None = None) -> Replayed:
    """Simulate one trial of a recorded contact set again."""
    case = _case(recorded)
    name = wrench or recorded.usual or _likeliest(recorded, case)
    if name not in case.loads:
        known = ", ".join(case.loads)
        raise InputError(f"{recorded.name}: no wrench is named {name!r}; choose from {known}")
    held, rig = case.loads[name], case.rig
    watched = rig.watch(held.load, held.settling)
    scene = rig.bench.scene
    (ended,) = rig.hold([held.load], None if held.settling is None else [held.settling])
    hold = judge(ended, scene.layout, recorded.setup.hold)
    return Replayed(
        name=name,
        load=held.load,
        predicted_limit=held.predicted_limit,
        required_friction=held.required_friction,
        friction=rig.friction,
        hold=invalid_start(hold, case.overlap) if case.overlap else hold,
        watched=watched,
        scene=scene,
    )


def _likeliest(recorded: Recorded, case: _Case) -> str:
    """Choose the wrench that is hardest to hold."""
    if recorded.trial is None and WEAKEST in case.loads:
        return WEAKEST
    return min(case.loads, key=lambda name: case.loads[name].predicted_limit or 0.0)


def _case(recorded: Recorded) -> _Case:
    body, setup = recorded.body, recorded.setup
    if recorded.control is not None:
        return _opened(body, recorded.control, recorded.contacts, recorded.friction, setup)
    scene = setup.scene(body, recorded.grasp or recorded.contacts, recorded.friction)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, scene.layout.squeeze_forces, recorded.friction)
    contacts, friction = recorded.contacts, recorded.friction
    planned = planned_loads(body, contacts, friction, rig.idle, recorded.agenda, setup)
    if recorded.trial is not None and recorded.grasp is not None:
        return _noisy(recorded, recorded.grasp, recorded.trial, planned, scene)
    return _Case(rig, _as_planned(planned), _overlap(body, contacts, scene))


def _noisy(
    recorded: Recorded, grasp: Grasp, trial: int, planned: Sequence[PlannedLoad], scene: Scene
) -> _Case:
    body, setup = recorded.body, for_repeats(recorded.setup, scene)
    case = disturbed_in(body, grasp, recorded.friction, recorded.agenda, trial)
    if case.missed:
        raise InputError(
            f"{recorded.name}: this repeat has no trial to simulate, because noise made finger "
            f"{case.missed[0]} miss its face"
        )
    if not force_closure(*stacked(case.contacts), case.friction, torsion_m=setup.torsion_m).closed:
        return _opened(body, OPEN, case.contacts, case.friction, setup)
    loads = [(each.name, each.load.wrench) for each in planned]
    rig, heavy = noisy_case(body, case, loads, setup)
    return _Case(rig, _as_planned(heavy), _overlap(body, case.landed, rig.bench.scene))


def _opened(
    body: Polyhedron, name: str, contacts: tuple[Contact, ...], friction: float, setup: Setup
) -> _Case:
    """Prepare contacts without force closure as a negative control."""
    certificate = force_closure(*stacked(contacts), friction, torsion_m=setup.torsion_m)
    if certificate.closed:
        raise InputError(
            f"{name}: expected contacts without force closure, but these are force-closed at "
            f"friction {friction}"
        )
    control = Control(name, contacts, friction, certificate)
    rig, loads = control_case(body, control, setup)
    return _Case(
        rig,
        {
            each.name: _Held(each.load, None, each.required_friction, each.settling)
            for each in loads
        },
    )


def _as_planned(planned: Sequence[PlannedLoad]) -> dict[str, _Held]:
    return {
        each.name: _Held(each.load, each.predicted_limit, each.required_friction)
        for each in planned
    }


def _overlap(body: Polyhedron, contacts: Sequence[Contact], scene: Scene) -> tuple[str, ...]:
    return clashes(body, *stacked(contacts), scene.layout.drive.radius_m)
