"""What is kept of verdicts, to compare later ones with: a header, and an entry for each grasp."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from grasp_core.values import Grasp
from sim_validate.grasp_verdict import Verdict
from sim_validate.setup import WEAKEST
from sim_validate.wrench_verdict import WrenchVerdict

DIGITS = 12
"""Of numbers that are kept."""
NUMBERS = (
    "critical_friction", "simulated_critical_friction", "limit_n", "simulated_limit_n",
    "displacement_m", "rotation_rad",
)  # fmt: skip
"""What is measured."""


@dataclass(frozen=True, slots=True)
class Entry:
    """What is kept of the verdict on one grasp."""

    id: str
    contacts_sha256: str
    """Of positions and normals, in finger order."""
    outcome: str
    """`held`, or how the first wrench that did not hold ended."""
    first_failure: str
    """That wrench's name, empty if all held."""
    controls_held: int
    """Negative controls that held: none must."""
    mismatches: int
    """In how many ways simulation contradicts the analysis."""
    critical_friction: float
    simulated_critical_friction: float | None
    """None if it was not found."""
    limit_n: float
    """Largest multiple of the weakest wrench that is resisted, by analysis: its size [N], torques
    over the object's radius."""
    simulated_limit_n: float | None
    """The same in simulation; None if not measured."""
    displacement_m: float
    """Largest motion of the object in any trial."""
    rotation_rad: float
    noisy_trials: int
    """Repeats with noise."""
    noisy_held: int
    """How many of them held."""

    @property
    def held(self) -> bool:
        """Whether every wrench held."""
        return not self.first_failure


@dataclass(frozen=True, slots=True)
class Baseline:
    """Verdicts on the grasps of one object, and all that they depend on."""

    grasps_file: str
    """Where the grasps are, from the baseline's folder."""
    object: str
    content_sha256: str
    """Of the object's mesh."""
    friction: float
    settings: Mapping[str, Any]
    """How trials were simulated, and which."""
    versions: Mapping[str, str]
    arithmetic: str
    """A hash of how the process rounds that measured them."""
    entries: tuple[Entry, ...]
    """Sorted by id."""


def contacts_sha256(grasp: Grasp) -> str:
    """A hash of the contacts of a grasp."""
    numbers = np.concatenate([grasp.positions.ravel(), grasp.normals.ravel()]) + 0.0
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()


def entry_of(grasp: Grasp, verdict: Verdict, radius_m: float) -> Entry:
    """What is kept of a verdict.

    Args:
        grasp: The grasp.
        verdict: What simulation says about it.
        radius_m: Of the object.
    """
    failures = [trial.name for trial in verdict.wrenches if trial.hold.outcome.value != "held"]
    weakest = next(trial for trial in verdict.wrenches if trial.name == WEAKEST)
    predicted, simulated = _limits(weakest, radius_m)
    friction, repeats = verdict.critical_friction, verdict.robustness
    found = Entry(
        id=grasp.id,
        contacts_sha256=contacts_sha256(grasp),
        outcome=verdict.outcome.value,
        first_failure=failures[0] if failures else "",
        controls_held=sum(control.held for control in verdict.controls),
        mismatches=len(verdict.mismatches),
        critical_friction=friction.predicted,
        simulated_critical_friction=friction.simulated,
        limit_n=predicted,
        simulated_limit_n=simulated,
        displacement_m=max(trial.hold.displacement_m for trial in verdict.wrenches),
        rotation_rad=max(trial.hold.rotation_rad for trial in verdict.wrenches),
        noisy_trials=0 if repeats is None else len(repeats.trials),
        noisy_held=0 if repeats is None else repeats.held,
    )
    return replace(found, **{name: _rounded(getattr(found, name)) for name in NUMBERS})


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{DIGITS}g}")


def _limits(trial: WrenchVerdict, radius_m: float) -> tuple[float, float | None]:
    """The size of the largest wrench along a trial's, by analysis and in simulation."""
    scaled = trial.wrench / np.array([1.0] * 3 + [radius_m] * 3)
    predicted = trial.predicted_limit * float(np.linalg.norm(scaled))
    found = trial.simulated_limit
    return predicted, None if found is None else predicted * found.share
