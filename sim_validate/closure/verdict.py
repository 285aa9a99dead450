"""Verdicts on a grasp: on each wrench, on repeats with noise, and on all of its trials.

Each sets what was predicted beside what was simulated, and says where the two contradict each
other. They are also what `verdicts.json` holds.
"""

import importlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from annotated_types import Len
from pydantic import computed_field

from grasp_core.allowed_values import FLAT, Friction, Measured, OrInfinity, path_of
from grasp_core.arrays import Array, Shape, Wrench
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.declared import Declared, declared
from grasp_core.figures import Compared, Shown, figure, less, more
from grasp_core.files.file_kinds import VERDICTS
from grasp_core.files.records import UNRECORDED
from grasp_core.messages import MICRO
from grasp_core.notebooks import InNotebooks
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.mujoco.closure_scene import FingerDrive, Layout, Scene
from sim_validate.closure.controls import ControlVerdict
from sim_validate.engine.held_or_let_go import LET_GO, HoldVerdict, Outcome, Trace
from sim_validate.engine.known_cases import Gate
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.engine.simulated_friction import CriticalFriction
from sim_validate.engine.simulated_limits import SimulatedLimit
from sim_validate.files.result_files import AboutGrasps, AboutObject
from sim_validate.settings import Noise

AGREEMENT = 0.02
"""Largest relative error of simulated limits and frictions: five times the worst measured."""


@declared
class WrenchVerdict(Declared):
    """One wrench on a grasp, predicted and simulated."""

    name: str
    wrench: Wrench
    predicted_limit: OrInfinity
    """Largest multiple of the applied wrench that the analysis says is resisted."""
    required_friction: OrInfinity
    """Least coefficient with which the planned contact forces balance the wrench."""
    hold: Annotated[HoldVerdict, FLAT]
    let_go_at: SimulatedLimit | None = None
    """Where the object lets go, in shares of the predicted limit; None if not measured, or not
    found."""
    trace: Annotated[Trace | None, UNRECORDED] = field(default=None, compare=False)

    @computed_field
    @property
    def simulated_limit(self) -> float | None:
        """Multiple of the applied wrench at which the object lets go; None if not found."""
        return None if self.let_go_at is None else self.let_go_at.share * self.predicted_limit

    @property
    def contradiction(self) -> str:
        """How simulation contradicts the analysis, in words; empty if it does not."""
        outcome, predicted = self.hold.outcome, self.predicted_limit
        wrong = Outcome.HELD if predicted < 1.0 - AGREEMENT else None
        if (outcome in LET_GO and predicted > 1.0 + AGREEMENT) or outcome is wrong:
            return (f"{self.name}: {outcome.value}, though the predicted limit is "
                    f"{predicted:.4g} times the wrench")  # fmt: skip
        if self.let_go_at and abs(self.let_go_at.share - 1.0) > AGREEMENT:
            return f"{self.name}: let go at {self.let_go_at.share:.4g} of the predicted limit"
        return ""


class HoldsWrenches(Declared):
    """Base of the verdicts on what a grasp, or a hand in it, holds."""

    __slots__ = ()
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[Any, ...]
    """How each negative control ended: `let_go` says whether it let go of the object."""
    agenda: Agenda

    @property
    def failures(self) -> tuple[WrenchVerdict, ...]:
        """The wrenches that were not held, in order."""
        return tuple(trial for trial in self.wrenches if trial.hold.outcome is not Outcome.HELD)

    @property
    def mismatches(self) -> tuple[str, ...]:
        """Where simulation contradicts the analysis, one sentence each."""
        return tuple(self._contradictions())

    @property
    def controls_let_go(self) -> Annotated[bool, Shown("controls let go", compared=None)]:
        """Whether every negative control let go of the object, as it must."""
        return all(control.let_go for control in self.controls)

    @property
    def good(self) -> bool:
        """Whether all wrenches held, negative controls let go, and nothing was contradicted."""
        return not self.failures and self.controls_let_go and not self.mismatches

    @property
    def _weakest(self) -> WrenchVerdict:
        return next(trial for trial in self.wrenches if trial.name == WEAKEST)

    def _largest_n(self, radius_m: float) -> float:
        """Return the size of the weakest wrench at its predicted limit, torques over a radius."""
        weakest, scale = self._weakest, np.array([1.0] * 3 + [radius_m] * 3)
        return weakest.predicted_limit * float(np.linalg.norm(weakest.wrench / scale))

    def _contradictions(self) -> Iterator[str]:
        yield from (each.contradiction for each in self.wrenches if each.contradiction)
        if self.agenda.limits != "none":
            yield from (
                f"{each.name}: the limit was not found near the predicted one"
                for each in self.wrenches if each.let_go_at is None
            )  # fmt: skip


@declared
class NoisyTrial(Declared):
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


@declared
class Robustness(Declared):
    """All repeats of a grasp with noise, and their statistics."""

    noise: Noise
    trials: Annotated[tuple[NoisyTrial, ...], Len(1)]

    @computed_field
    @property
    def held(self) -> int:
        """Number of repeats in which every load held."""
        return sum(trial.outcome is Outcome.HELD for trial in self.trials)

    @computed_field
    @property
    def predicted(self) -> int:
        """Number of repeats in which every load is resisted according to the analysis."""
        return sum(trial.predicted is True for trial in self.trials)

    @computed_field
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


def interval(count: int, of: int) -> tuple[float, float]:
    """The 95 % confidence interval of a share, by Clopper and Pearson's exact method."""
    stats: Any = importlib.import_module("scipy.stats")  # has no types, takes half a second
    found = stats.binomtest(count, of).proportion_ci(0.95, method="exact")
    return float(found.low), float(found.high)


TRIALS_SHOWN = 8


@declared
class TrialScale(Declared):
    """The sizes with which the trials of a grasp were simulated."""

    grasp_size_m: float
    """Root mean square lever of the contacts [m]; displacements are judged relative to it."""
    object_radius_m: float
    """Largest distance of the object's surface from its centre of mass [m]."""
    object_mass_kg: float
    """Mass of the object, not its own: it is chosen so that similar grasps behave alike [kg]."""
    object_inertia_kg_m2: Annotated[Array, Shape(3, 3)]
    fingers: FingerDrive

    @classmethod
    def of(cls, body: Polyhedron, at: Layout) -> Self:
        """Take the sizes from the layout of a scene."""
        return cls(at.grasp_size_m, body.radius, at.object_kg, at.inertia_kg_m2, at.drive)


FRICTION_PREDICTED = Compared(more, analysed=True, friction=True)
PREDICTED_FRICTION = Shown("mu*", ".4f", compared=FRICTION_PREDICTED)
SIMULATED_FRICTION = Shown("in sim", ".4f", compared=Compared(more, friction=True))
SHARES_SHOWN = Shown("limits", ".3f", compared=None)
OBJECT_MOVED = Compared(more, follows=True)
MICRONS_MOVED = Shown("um moved", ".2g", MICRO, compared=OBJECT_MOVED)
MICRONS_LOADED = Shown("um when loaded", ".2g", MICRO, compared=None)
ENDED = Compared(lambda _, after: after is not Outcome.HELD, follows=True)
WRENCHES_LOST = Compared(items=("no longer held", "held now"), follows=True)
LOST_WITH_NOISE = Compared(
    items=("repeats with noise no longer held", "repeats with noise held now"), close="noisy_close"
)
CONTROL_COUNTS = Compared(less, "negative controls", of_part=True)
CONTROLS_NOT_LET_GO = Compared(more, "negative controls that were not let go")
CONTRADICTED = Compared(more, "contradictions of the analysis", follows=True)
"""How the figures of a verdict are shown, and compared with those of an earlier one."""


@declared
class Verdict(HoldsWrenches, InNotebooks):
    """The result of simulating a grasp: what it held, and whether that fits the analysis."""

    id: Annotated[str, Shown("grasp", compared=None)]
    contacts: tuple[Contact, ...]
    friction: Friction
    critical_friction: CriticalFriction
    wrenches: Annotated[tuple[WrenchVerdict, ...], Compared(less)]
    controls: Annotated[tuple[ControlVerdict, ...], CONTROL_COUNTS]
    robustness: Robustness | None
    """How often the grasp holds with noise, if asked for."""
    setup: Setup
    agenda: Agenda
    scale: TrialScale
    gate: Annotated[Gate | None, UNRECORDED] = field(default=None, compare=False)
    """How the simulator did on cases with known answers; a file has it once, for all verdicts."""
    scene: Annotated[Scene | None, UNRECORDED] = field(default=None, compare=False)
    """The scene that was simulated; None if the verdict was read from a file."""

    @computed_field
    @property
    def contacts_sha256(self) -> str:
        """Hash of the contacts, which tells grasps of one id apart."""
        return contacts_sha256(self.contacts)

    @computed_field
    @property
    def predicted_critical_friction(self) -> Annotated[OrInfinity, PREDICTED_FRICTION]:
        """The critical friction by analysis."""
        return self.critical_friction.predicted

    @computed_field
    @property
    def simulated_critical_friction(self) -> Annotated[float | None, SIMULATED_FRICTION]:
        """The one found in simulation; None if it was not measured or not found."""
        return self.critical_friction.simulated

    @computed_field
    @property
    def shares_found(self) -> Annotated[tuple[float, float] | None, SHARES_SHOWN]:
        """Least and largest share of predicted limits at which the object let go; None if none."""
        found = [each.let_go_at.share for each in self.wrenches if each.let_go_at]
        return (min(found), max(found)) if found else None

    @computed_field
    @property
    def displacement_m(self) -> Annotated[Measured, MICRONS_MOVED]:
        """Largest displacement of the object under any wrench, after friction was lowered [m]."""
        return _largest([trial.hold.displacement_m for trial in self.wrenches])

    @computed_field
    @property
    def start_displacement_m(self) -> Annotated[Measured, MICRONS_LOADED]:
        """Largest one before that, at high friction: the fingers give way a little [m]."""
        return _largest([trial.hold.start_displacement_m for trial in self.wrenches])

    @figure
    def rotation_rad(self) -> Annotated[Measured, OBJECT_MOVED]:
        """Largest rotation of the object in the trials that hold a wrench [rad]."""
        return _largest([trial.hold.rotation_rad for trial in self.wrenches])

    @figure
    def limit_n(self) -> Annotated[OrInfinity, Compared(less, analysed=True)]:
        """Largest wrench that is resisted in the weakest direction, by analysis [N].

        Torques are divided by the object's radius.
        """
        return self._largest_n(self.scale.object_radius_m)

    @figure
    def simulated_limit_n(self) -> Annotated[float | None, Compared(less)]:
        """The one found in simulation [N]; None if it was not measured or not found."""
        found = self._weakest.let_go_at
        return None if found is None else self.limit_n * found.share

    @computed_field
    @property
    def outcome(self) -> Annotated[Outcome, Shown("outcome", compared=ENDED)]:
        """`held`, or how the first wrench that was not held ended."""
        return self.failures[0].hold.outcome if self.failures else Outcome.HELD

    @property
    def not_simulated(self) -> str:
        """Why no trial was simulated; empty if any was."""
        if any(each.wrench.any() for each in self.wrenches) or not self.failures:
            return ""
        return self.failures[0].hold.reason

    @computed_field
    @property
    def held(self) -> bool:
        """Whether every wrench held."""
        return self.outcome is Outcome.HELD

    @figure
    def not_held(self) -> Annotated[tuple[str, ...], WRENCHES_LOST]:
        """Names of the wrenches that were not held, in order."""
        return tuple(trial.name for trial in self.failures)

    controls_let_go = computed_field(HoldsWrenches.controls_let_go)  # type: ignore[override]

    @figure
    def controls_held(self) -> Annotated[tuple[str, ...], CONTROLS_NOT_LET_GO]:
        """Names of the negative controls that did not let go: they held, or are undecided."""
        return tuple(each.control.name for each in self.controls if not each.let_go)

    @computed_field
    @property
    def mismatches(self) -> Annotated[tuple[str, ...], CONTRADICTED]:
        """Where simulation contradicts the analysis, one sentence each."""
        found = list(self._contradictions())
        if self.agenda.critical_friction and (fault := _disagreement(self.critical_friction)):
            found.append(f"critical friction: {fault}")
        if self.robustness is not None:
            found += self.robustness.contradictions
        return tuple(found)

    @figure
    def noisy_trials(self) -> Annotated[int, Compared(less, "repeats with noise")]:
        """Number of repeats with noise."""
        return len(self._repeats)

    @figure
    def noisy_not_held(self) -> Annotated[tuple[int, ...], LOST_WITH_NOISE]:
        """Numbers of the repeats with noise in which a load was not held."""
        return tuple(trial.number for trial in self._repeats if trial.outcome is not Outcome.HELD)

    @figure
    def noisy_close(self) -> Annotated[tuple[int, ...], Compared(None, items=("", ""))]:
        """Numbers of the repeats with a load very close to the largest that can be resisted."""
        return tuple(trial.number for trial in self._repeats if trial.close)

    @property
    def _repeats(self) -> tuple[NoisyTrial, ...]:
        return () if self.robustness is None else self.robustness.trials

    good = computed_field(HoldsWrenches.good)  # type: ignore[override]

    def _html(self) -> str | None:
        """Return a picture of the scene with how the trials ended, the failed ones first."""
        if self.scene is None:
            return None
        from scenes.drawing.pages import card, placed

        title = f"{self.id}: {self.outcome.value.replace('_', ' ')}"
        return card(placed(self.scene.layout), title, _rows(self))


def _largest(values: Sequence[float]) -> float:
    return math.nan if any(map(math.isnan, values)) else max(values, default=0.0)


def _disagreement(friction: CriticalFriction) -> str:
    simulated, predicted = friction.simulated, friction.predicted
    if simulated is None:
        return "not found near the predicted one"
    if simulated > 0.0 and abs(simulated - predicted) > AGREEMENT * predicted:
        return f"{simulated:.4g} in simulation, {predicted:.4g} predicted"
    return ""


def _rows(verdict: Verdict) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("trial", "outcome", "limit predicted", "simulated")]
    trials = sorted(verdict.wrenches, key=lambda trial: trial.hold.outcome is Outcome.HELD)
    for trial in trials[:TRIALS_SHOWN]:
        found = trial.simulated_limit
        simulated = "-" if found is None else f"{found:.4g}"
        predicted = f"{trial.predicted_limit:.4g}"
        rows.append((trial.name, trial.hold.outcome.value, predicted, simulated))
    let_go = sum(control.let_go for control in verdict.controls)
    rows.append((f"{len(verdict.failures)} of {len(trials)} trials failed",))
    rows.append((f"{let_go} of {len(verdict.controls)} negative controls let go",))
    return rows + [(mismatch,) for mismatch in verdict.mismatches]


@declared
class Verdicts(AboutGrasps[Verdict]):
    """The verdicts on an object's grasps, as `verdicts.json` holds them."""

    ITEMS = "verdicts"
    FILE = VERDICTS
    SCHEMA = 2

    gate: Gate
    """How the simulator did on cases with known answers."""
    verdicts: tuple[Verdict, ...]

    @classmethod
    def of(
        cls, body: Polyhedron, friction: float, gate: Gate, verdicts: tuple[Verdict, ...], *,
        complete: bool = True,
    ) -> Self:  # fmt: skip
        """Collect verdicts on the grasps of an object for a file."""
        return cls(AboutObject.of(body), friction, gate, verdicts, complete=complete)

    @computed_field
    @property
    def summary(self) -> Mapping[str, int]:
        """Numbers of grasps that held, of controls that let go and did not, and contradictions."""
        controls = [control for verdict in self.verdicts for control in verdict.controls]
        return {
            "grasps": len(self.verdicts),
            "grasps_held": sum(verdict.held for verdict in self.verdicts),
            "controls": len(controls),
            "controls_held": sum(len(verdict.controls_held) for verdict in self.verdicts),
            "controls_let_go": sum(control.let_go for control in controls),
            "mismatches": sum(len(verdict.mismatches) for verdict in self.verdicts),
        }


def load_verdicts(path: str | Path) -> Verdicts:
    """Read verdicts, as `graspproof validate` and `graspproof run` write them.

    Args:
        path: A `verdicts.json`.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    return Verdicts.read(path_of(path, "path"))


def trace_arrays(verdict: Verdict) -> dict[str, Array]:
    """Collect the recorded motion of every contact as arrays, named by trial and quantity."""
    fields = ("times_s", "displacements_m", "shifts_m", "rotations_rad", "slips_m", "gaps_m")
    kept: Sequence[tuple[str, Any]] = [
        *((trial.name, trial.trace) for trial in verdict.wrenches if trial.trace is not None),
        *((f"{control.control.name}.{trial.name}", trial.trace)
          for control in verdict.controls for trial in control.tried if trial.trace is not None),
    ]  # fmt: skip
    return {f"{name}.{field}": getattr(trace, field) for name, trace in kept for field in fields}
