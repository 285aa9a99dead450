"""The verdict on a grasp: its trials, negative controls, and contradictions of the analysis."""

from dataclasses import dataclass

from grasp_core.by_value import ByValue
from grasp_core.notebooks import InNotebooks
from grasp_core.values import Contact
from scenes.mjcf import Scene
from sim_validate.simulation.critical_friction import CriticalFriction
from sim_validate.simulation.gate.gate import Gate
from sim_validate.simulation.hold_verdict import Outcome
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.simulation.unplanned_bounds import Bounds
from sim_validate.validation.control_trials import ControlVerdict
from sim_validate.validation.renamed import Renamed
from sim_validate.validation.repeats import Robustness
from sim_validate.validation.wrench_verdict import AGREEMENT, WrenchVerdict

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
    bounds: Bounds | None
    """Bounds on the wrenches held by fingers without planned forces; None if not asked for."""
    robustness: Robustness | None
    """How often the grasp holds with noise, if asked for."""
    accepted_by: dict[str, bool]
    """For each acceptance rule of another tool, whether it would accept the grasp."""
    gate: Gate
    scene: Scene
    setup: Setup
    agenda: Agenda

    controls_failed = Renamed("controls_let_go")

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
        if self.bounds is not None and not self.bounds.agree(self.critical_friction.predicted):
            found.append("bounds found without planned forces are on the wrong side")
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
    """Describe how simulated and predicted critical friction differ; empty if they agree."""
    simulated, predicted = friction.simulated, friction.predicted
    if simulated is None:
        return "not found near the predicted one"
    if simulated > 0.0 and abs(simulated - predicted) > AGREEMENT * predicted:
        return f"{simulated:.4g} in simulation, {predicted:.4g} predicted"
    return ""


def _rows(verdict: Verdict) -> list[tuple[str, ...]]:
    """Return the cells of the table by which notebooks show a verdict."""
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
