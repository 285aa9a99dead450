"""How often a grasp holds although nothing is quite as planned: repeats with seeded noise.

Each repeat draws noise, lets the analysis say which of the nominal loads are still resisted, and
simulates them all, with forces planned for the contacts as they are then: it asks whether the
grasp still can hold, not whether fingers notice. Contacts that lost force closure are loaded like
a negative control. Analysis and simulation must agree in every repeat; how many hold is a count,
and comes with an interval.
"""

import importlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from grasp_core.arrays import Array
from grasp_core.closure.contact_arrays import stacked
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import UndecidedError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.fingertips import clashes
from scenes.mjcf import Scene, to_text
from sim_validate.simulation.hold_verdict import LET_GO, Outcome, invalid_start, judge
from sim_validate.simulation.loads import PlannedLoad, loads_as_they_are
from sim_validate.simulation.noise import Disturbed, Noise, disturbed
from sim_validate.simulation.rig import Rig, squeezed
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.simulation.simulate import Bench
from sim_validate.validation.control_trials import try_control
from sim_validate.validation.controls import Control
from sim_validate.validation.wrench_verdict import AGREEMENT, WrenchVerdict

NamedLoad: TypeAlias = tuple[str, Array]
"""A wrench (6,) [N, N m] by its name, torque about the centre of mass."""
OPEN = "noise"
"""Contacts that noise has opened, as a control."""


@dataclass(frozen=True, slots=True)
class NoisyTrial:
    """A repeat with noise."""

    number: int
    predicted: bool | None
    """Whether the analysis says that every load is resisted; None if that is too close to call."""
    outcome: Outcome
    """`held`, or how the first load that did not hold ended."""
    wrench: str
    """That load's name; empty if all held, or if nothing was loaded."""
    reason: str
    contradictions: tuple[str, ...]
    """Where simulation contradicts the analysis, or says nothing about it, in words."""
    close: bool = False
    """Whether a load is within a trifle of what the analysis says is resisted."""


@dataclass(frozen=True, slots=True)
class Robustness:
    """Repeats with noise, as statistics."""

    noise: Noise
    trials: tuple[NoisyTrial, ...]

    @property
    def held(self) -> int:
        """How many repeats held every load."""
        return sum(trial.outcome is Outcome.HELD for trial in self.trials)

    @property
    def predicted(self) -> int:
        """How many of them hold every load by analysis."""
        return sum(trial.predicted is True for trial in self.trials)

    @property
    def interval(self) -> tuple[float, float]:
        """Where the share of repeats that hold is with 95 % confidence."""
        return interval(self.held, len(self.trials))

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Where simulation contradicts the analysis, in words."""
        return tuple(
            f"trial {trial.number}: {text}"
            for trial in self.trials
            for text in trial.contradictions
        )


def robustness(
    body: Polyhedron, grasp: Grasp, friction: float, loads: Sequence[NamedLoad],
    agenda: Agenda, setup: Setup,
) -> Robustness:  # fmt: skip
    """Repeat the holds of a grasp with noise.

    Args:
        body: The object.
        grasp: In force closure at this friction.
        friction: Coulomb coefficient that was planned with.
        loads: What each repeat must hold.
        agenda: How many repeats, with how much noise, and the seed.
        setup: How trials are simulated: as `for_repeats` says.
    """
    trials = tuple(
        noisy_trial(body, disturbed_in(body, grasp, friction, agenda, number), loads, number, setup)
        for number in range(agenda.trials)
    )
    return Robustness(agenda.noise, trials)


def for_repeats(setup: Setup, scene: Scene) -> Setup:
    """How repeats are simulated: with the fingertips of the grasp itself, on leaning pads."""
    fingers = replace(setup.fingers, radius_m=scene.layout.drive.radius_m)
    return replace(setup, fingers=fingers, surface="pads")


def disturbed_in(
    body: Polyhedron, grasp: Grasp, friction: float, agenda: Agenda, number: int
) -> Disturbed:
    """What noise makes of a grasp in one repeat."""
    return disturbed(body, grasp, friction, agenda.noise, (agenda.seed, number))


def noisy_trial(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], number: int, setup: Setup
) -> NoisyTrial:
    """Simulate one repeat."""
    if case.missed:
        reason = f"finger {case.missed[0]} misses its face"
        return NoisyTrial(number, False, Outcome.LOST_CONTACT, "", reason, ())
    positions, normals = stacked(case.contacts)
    try:
        certificate = force_closure(positions, normals, case.friction)
    except UndecidedError as error:
        return NoisyTrial(number, None, Outcome.ERROR, "", str(error), ())
    if not certificate.closed:
        control = Control(OPEN, case.contacts, case.friction, certificate)
        return _opened(body, control, number, setup)
    verdicts = tuple(_held_loads(body, case, loads, setup))
    first = next((each for each in verdicts if each.hold.outcome is not Outcome.HELD), None)
    silent = () if first is None else _silent(first.hold.outcome)
    return NoisyTrial(
        number=number,
        predicted=all(each.predicted_limit >= 1.0 for each in verdicts),
        outcome=Outcome.HELD if first is None else first.hold.outcome,
        wrench="" if first is None else first.name,
        reason="" if first is None else first.hold.reason,
        contradictions=(*(each.contradiction for each in verdicts if each.contradiction), *silent),
        close=any(abs(each.predicted_limit - 1.0) <= AGREEMENT for each in verdicts),
    )


def _silent(outcome: Outcome) -> tuple[str, ...]:
    """Endings that say nothing about the object; fingertips without room are none of them."""
    says = (Outcome.HELD, *LET_GO, Outcome.INVALID_START)
    return () if outcome in says else (f"{outcome.value}: neither held nor let go",)


def _held_loads(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], setup: Setup
) -> Iterator[WrenchVerdict]:
    rig, planned = noisy_case(body, case, loads, setup)
    layout = rig.bench.scene.layout
    overlap = clashes(body, *stacked(case.landed), layout.drive.radius_m)
    for each, trace in zip(planned, rig.hold([one.load for one in planned]), strict=True):
        hold = judge(trace, layout, setup.hold)
        yield WrenchVerdict(
            each.name, each.load.wrench, each.predicted_limit, each.required_friction,
            invalid_start(hold, overlap) if overlap else hold,
        )  # fmt: skip


def noisy_case(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], setup: Setup
) -> tuple[Rig, tuple[PlannedLoad, ...]]:
    """The contacts of a repeat, in force closure, in the grip of their fingers, and the loads.

    Args:
        body: The object.
        case: What noise made of the grasp.
        loads: What is to be held, but for the mass.
        setup: How trials are simulated.
    """
    scene = heavier(setup.scene(body, case.contacts, case.friction), case.mass)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, scene.layout.squeeze_forces, case.friction)
    heavy = [(name, case.mass * wrench) for name, wrench in loads]
    return rig, loads_as_they_are(body, case.contacts, case.friction, rig.idle, heavy, setup)


def heavier(scene: Scene, factor: float) -> Scene:
    """A scene with an object of more mass."""
    layout = replace(
        scene.layout,
        mass_kg=factor * scene.layout.mass_kg,
        inertia_kg_m2=factor * scene.layout.inertia_kg_m2,
    )
    return replace(scene, xml=to_text(layout, scene.physics, scene.surface), layout=layout)


def _opened(body: Polyhedron, control: Control, number: int, setup: Setup) -> NoisyTrial:
    """Contacts that are not in force closure: as a control they must let go."""
    verdict = try_control(body, control, Agenda(), setup)
    if verdict.held:
        wrong = ("contacts without force closure held",)
        return NoisyTrial(number, False, Outcome.HELD, "", "", wrong)
    first = verdict.tried[0]
    ended = first.hold.outcome
    return NoisyTrial(number, False, ended, first.name, first.hold.reason, _silent(ended))


CONFIDENCE = 0.95


def interval(count: int, of: int) -> tuple[float, float]:
    """Where the share behind a count is with 95 % confidence (Clopper and Pearson, exact).

    Args:
        count: How many did.
        of: How many were tried, at least one.
    """
    found = _stats().binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def _stats() -> Any:
    """SciPy's statistics, which has no types and takes half a second to import."""
    return importlib.import_module("scipy.stats")
