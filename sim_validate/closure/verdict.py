"""Verdicts on a grasp: on each wrench, on repeats with noise, and on all of its trials.

Each sets what was predicted beside what was simulated, and says where the two contradict each
other.
"""

import importlib
from dataclasses import dataclass
from typing import Any

from grasp_core.arrays import Array
from grasp_core.declared import ByValue
from grasp_core.notebooks import InNotebooks
from grasp_core.values import Contact
from scenes.mujoco.closure_scene import Scene
from sim_validate.closure.controls import ControlVerdict
from sim_validate.engine.gate import Gate
from sim_validate.engine.limits import CriticalFriction, SimulatedLimit
from sim_validate.engine.setup import Agenda, Noise, Setup
from sim_validate.engine.traces import LET_GO, HoldVerdict, Outcome, Trace

AGREEMENT = 0.02
"""Largest relative error of simulated limits and critical frictions: five times the worst that was
measured."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WrenchVerdict(ByValue):
    """One wrench on a grasp, predicted and simulated."""

    name: str
    wrench: Array
    predicted_limit: float
    """Largest multiple of the applied wrench that the analysis says is resisted."""
    required_friction: float
    hold: HoldVerdict
    simulated_limit: SimulatedLimit | None = None
    """Where the object lets go, relative to the predicted limit; None if not measured, or not
    found."""
    trace: Trace | None = None

    @property
    def contradiction(self) -> str:
        """How simulation contradicts the analysis, in words; empty if it does not."""
        outcome, predicted = self.hold.outcome, self.predicted_limit
        wrong = Outcome.HELD if predicted < 1.0 - AGREEMENT else None
        if (outcome in LET_GO and predicted > 1.0 + AGREEMENT) or outcome is wrong:
            return (f"{self.name}: {outcome.value}, though the predicted limit is "
                    f"{predicted:.4g} times the wrench")  # fmt: skip
        if self.simulated_limit and abs(self.simulated_limit.share - 1.0) > AGREEMENT:
            return f"{self.name}: let go at {self.simulated_limit.share:.4g} of the predicted limit"
        return ""


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


def interval(count: int, of: int) -> tuple[float, float]:
    """The 95 % confidence interval of a share, by Clopper and Pearson's exact method."""
    stats: Any = importlib.import_module("scipy.stats")  # has no types, takes half a second
    found = stats.binomtest(count, of).proportion_ci(0.95, method="exact")
    return float(found.low), float(found.high)


ROWS = 8
"""Largest number of trials that notebooks show."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Verdict(ByValue, InNotebooks):
    """The result of simulating a grasp: what it held, and whether that fits the analysis."""

    id: str
    contacts: tuple[Contact, ...]
    friction: float
    critical_friction: CriticalFriction
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[ControlVerdict, ...]
    robustness: Robustness | None
    """How often the grasp holds with noise, if asked for."""
    gate: Gate
    scene: Scene
    setup: Setup
    agenda: Agenda

    @property
    def predicted_critical_friction(self) -> float:
        """The critical friction by analysis, as `SavedVerdict` names it."""
        return self.critical_friction.predicted

    @property
    def simulated_critical_friction(self) -> float | None:
        """The one found in simulation; None if it was not measured or not found."""
        return self.critical_friction.simulated

    @property
    def failures(self) -> tuple[WrenchVerdict, ...]:
        """The wrenches that were not held, in order."""
        return tuple(trial for trial in self.wrenches if trial.hold.outcome is not Outcome.HELD)

    @property
    def outcome(self) -> Outcome:
        """`held`, or how the first wrench that was not held ended."""
        return self.failures[0].hold.outcome if self.failures else Outcome.HELD

    @property
    def held(self) -> bool:
        """Whether every wrench held."""
        return self.outcome is Outcome.HELD

    @property
    def controls_let_go(self) -> bool:
        """Whether every negative control let go of the object, as it must."""
        return all(control.let_go for control in self.controls)

    @property
    def mismatches(self) -> tuple[str, ...]:
        """Where simulation contradicts the analysis, one sentence each."""
        found = [trial.contradiction for trial in self.wrenches if trial.contradiction]
        if self.agenda.critical_friction and (fault := _disagreement(self.critical_friction)):
            found.append(f"critical friction: {fault}")
        if self.agenda.limits != "none":
            found += [f"{trial.name}: the limit was not found near the predicted one"
                      for trial in self.wrenches if trial.simulated_limit is None]  # fmt: skip
        if self.robustness is not None:
            found += self.robustness.contradictions
        return tuple(found)

    @property
    def good(self) -> bool:
        """Whether all wrenches held, negative controls let go, and nothing was contradicted."""
        return self.held and self.controls_let_go and not self.mismatches

    def _html(self) -> str:
        """Return a picture of the scene with how the trials ended, the failed ones first."""
        from scenes.drawing.in_notebooks import card, placed

        title = f"{self.id}: {self.outcome.value.replace('_', ' ')}"
        return card(placed(self.scene.layout), title, _rows(self))


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
    for trial in trials[:ROWS]:
        found, predicted = trial.simulated_limit, trial.predicted_limit
        simulated = "-" if found is None else f"{found.share * predicted:.4g}"
        rows.append((trial.name, trial.hold.outcome.value, f"{predicted:.4g}", simulated))
    let_go = sum(control.let_go for control in verdict.controls)
    rows.append((f"{len(verdict.failures)} of {len(trials)} trials failed",))
    rows.append((f"{let_go} of {len(verdict.controls)} negative controls let go",))
    return rows + [(mismatch,) for mismatch in verdict.mismatches]
