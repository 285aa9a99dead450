"""Repeats the trials of a grasp with seeded noise, and counts how often the grasp still holds.

Each repeat disturbs the contacts, friction and mass. The analysis says which loads the disturbed
grasp resists, and simulation applies them all with forces planned for the disturbed contacts. So a
repeat asks whether the grasp can still hold, not whether fingers notice the change. Contacts that
noise takes out of force closure are tested as a negative control: they must let go. Analysis and
simulation must agree in every repeat. The share that holds has a confidence interval.
"""

import importlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from grasp_core.arrays import Array
from grasp_core.closure.contacts import stacked
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
"""A name with a wrench, (6,) [N, N m], torque about the centre of mass."""
OPEN = "noise"
"""Name of the negative control made of contacts that noise took out of force closure."""


@dataclass(frozen=True, slots=True)
class NoisyTrial:
    """The outcome of one repeat with noise."""

    number: int
    predicted: bool | None
    """Whether the analysis says that every load is resisted; None if it is undecided."""
    outcome: Outcome
    """`held`, or how the first load that did not hold ended."""
    wrench: str
    """Name of the first load that did not hold; empty if all held, or if nothing was loaded."""
    reason: str
    contradictions: tuple[str, ...]
    """Where simulation contradicts the analysis, or says nothing about it, in words."""
    close: bool = False
    """Whether a predicted limit is so close to a load that the analysis may err either way."""


@dataclass(frozen=True, slots=True)
class Robustness:
    """All repeats of a grasp with noise, and their statistics."""

    noise: Noise
    trials: tuple[NoisyTrial, ...]

    @property
    def held(self) -> int:
        """Number of repeats in which every load held."""
        return sum(trial.outcome is Outcome.HELD for trial in self.trials)

    @property
    def predicted(self) -> int:
        """Number of repeats in which every load is resisted according to the analysis."""
        return sum(trial.predicted is True for trial in self.trials)

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % confidence interval of the share of repeats that hold."""
        return interval(self.held, len(self.trials))

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Where simulation contradicts the analysis in any repeat, in words."""
        return tuple(
            f"trial {trial.number}: {text}"
            for trial in self.trials
            for text in trial.contradictions
        )


def robustness(
    body: Polyhedron, grasp: Grasp, friction: float, loads: Sequence[NamedLoad],
    agenda: Agenda, setup: Setup,
) -> Robustness:  # fmt: skip
    """Repeat the holds of a grasp with noise."""
    trials = tuple(
        noisy_trial(body, disturbed_in(body, grasp, friction, agenda, number), loads, number, setup)
        for number in range(agenda.trials)
    )
    return Robustness(agenda.noise, trials)


def for_repeats(setup: Setup, scene: Scene) -> Setup:
    """The setup for repeats: the undisturbed grasp's fingertips, on pads that may lean."""
    fingers = replace(setup.fingers, radius_m=scene.layout.drive.radius_m)
    return replace(setup, fingers=fingers, surface="pads")


def disturbed_in(
    body: Polyhedron, grasp: Grasp, friction: float, agenda: Agenda, number: int
) -> Disturbed:
    """Disturb a grasp by the noise of one repeated trial."""
    return disturbed(body, grasp, friction, agenda.noise, (agenda.seed, number))


def noisy_trial(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], number: int, setup: Setup
) -> NoisyTrial:
    """Simulate one repeat: hold all loads, or let go if noise took the contacts out of closure."""
    if case.missed:
        reason = f"finger {case.missed[0]} misses its face"
        return NoisyTrial(number, False, Outcome.LOST_CONTACT, "", reason, ())
    positions, normals = stacked(case.contacts)
    try:
        certificate = force_closure(positions, normals, case.friction, torsion_m=setup.torsion_m)
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
    """Describe an outcome that decides nothing; fingertips without room are not reported."""
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
    """Close fingers on the contacts of a repeat, and plan forces for its loads."""
    scene = heavier(setup.scene(body, case.contacts, case.friction), case.mass)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, scene.layout.squeeze_forces, case.friction)
    heavy = [(name, case.mass * wrench) for name, wrench in loads]
    return rig, loads_as_they_are(body, case.contacts, case.friction, rig.idle, heavy, setup)


def heavier(scene: Scene, factor: float) -> Scene:
    """Scale the mass and inertia of the object in a scene."""
    layout = replace(
        scene.layout,
        mass_kg=factor * scene.layout.mass_kg,
        inertia_kg_m2=factor * scene.layout.inertia_kg_m2,
    )
    return replace(scene, xml=to_text(layout, scene.physics, scene.surface), layout=layout)


def _opened(body: Polyhedron, control: Control, number: int, setup: Setup) -> NoisyTrial:
    """Simulate contacts that are not force-closed as a negative control, which must let go."""
    verdict = try_control(body, control, Agenda(), setup)
    if verdict.held:
        wrong = ("contacts that are proved not force-closed held the object",)
        return NoisyTrial(number, False, Outcome.HELD, "", "", wrong)
    first = verdict.tried[0]
    ended = first.hold.outcome
    return NoisyTrial(number, False, ended, first.name, first.hold.reason, _silent(ended))


CONFIDENCE = 0.95


def interval(count: int, of: int) -> tuple[float, float]:
    """The 95 % confidence interval of a share, by Clopper and Pearson's exact method."""
    found = _stats().binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def _stats() -> Any:
    """SciPy's statistics, imported on use: it has no types and takes half a second to import."""
    return importlib.import_module("scipy.stats")
