"""What is kept of verdicts, to compare later ones with: a header, and an entry for each grasp."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from grasp_core.closure.contact_arrays import contacts_sha256
from grasp_core.values import Grasp
from sim_validate.simulation.hold_verdict import Outcome
from sim_validate.simulation.setup import WEAKEST
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.wrench_verdict import WrenchVerdict

DIGITS = 12
"""Of numbers that are kept."""
NUMBERS = (
    "critical_friction", "simulated_critical_friction", "limit_n", "simulated_limit_n",
    "displacement_m", "rotation_rad",
)  # fmt: skip
"""What is measured."""
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
Count = Annotated[int, Field(ge=0)]
Size = Annotated[float, Field(ge=0.0)]


@dataclass(frozen=True, slots=True, config=STRICT)
class Entry:
    """What is kept of the verdict on one grasp; what could not be measured is None."""

    id: str
    contacts_sha256: str
    """Of positions and normals, in finger order."""
    outcome: Outcome
    """`held`, or how the first wrench that was not held ended."""
    wrenches: Count
    """How many there were."""
    not_held: tuple[str, ...]
    """Names of those that were not held, in order."""
    controls: Count
    """How many negative controls there were."""
    controls_let_go: Count
    """How many of them ended as they must."""
    mismatches: Count
    """In how many ways simulation contradicts the analysis."""
    critical_friction: Size
    simulated_critical_friction: Size | None
    limit_n: Size
    """Largest multiple of the weakest wrench that is resisted, by analysis: its size [N], torques
    over the object's radius."""
    simulated_limit_n: Size | None
    """The same in simulation."""
    displacement_m: Size | None
    """Largest motion of the object in any trial."""
    rotation_rad: Size | None
    noisy_trials: Count
    """Repeats with noise."""
    noisy_not_held: tuple[Count, ...]
    """Numbers of those that were not held."""
    noisy_close: tuple[Count, ...]
    """Numbers of those with a load that is within a trifle of what can be resisted."""

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        if self.held == bool(self.not_held):
            raise ValueError(f"outcome {self.outcome.value}, but not held are {self.not_held}")
        if self.controls_let_go > self.controls or len(self.not_held) > self.wrenches:
            raise ValueError("more ended in some way than there were")
        if any(number >= self.noisy_trials for number in (*self.noisy_not_held, *self.noisy_close)):
            raise ValueError("there were not so many repeats with noise")

    @property
    def held(self) -> bool:
        """Whether every wrench held."""
        return self.outcome is Outcome.HELD

    @property
    def noisy_held(self) -> int:
        """How many repeats with noise held."""
        return self.noisy_trials - len(self.noisy_not_held)


@dataclass(frozen=True, slots=True, config=STRICT)
class Baseline:
    """Verdicts on the grasps of one object, and all that they depend on."""

    grasps_file: str
    """Where the grasps are, from the baseline's folder."""
    limit: Annotated[int, Field(ge=1)] | None
    """How many of them, the first ones; None for all."""
    object: str
    content_sha256: str
    """Of the object's mesh."""
    friction: Size
    planned_radius_m: Size | None
    """Of the fingertips that the grasps were planned for, if for any."""
    settings: Mapping[str, Any]
    """How trials were simulated, and which."""
    versions: Mapping[str, str]
    arithmetic: str
    """A hash of how the process rounds that measured them."""
    entries: tuple[Entry, ...]
    """Sorted by id."""

    def __post_init__(self) -> None:
        """Refuse two entries of one grasp."""
        if len({entry.id for entry in self.entries}) < len(self.entries):
            raise ValueError("two grasps have the same id")


def plain(entry: Entry | None) -> dict[str, Any] | None:
    """An entry as plain values, which travel between processes and into any file."""
    return None if entry is None else json.loads(json.dumps(asdict(entry), allow_nan=False))


def entry_of(grasp: Grasp, verdict: Verdict, radius_m: float) -> Entry:
    """What is kept of a verdict.

    Args:
        grasp: The grasp.
        verdict: What simulation says about it.
        radius_m: Of the object.
    """
    weakest = next(trial for trial in verdict.wrenches if trial.name == WEAKEST)
    predicted, simulated = _limits(weakest, radius_m)
    friction, repeats = verdict.critical_friction, verdict.robustness
    noisy = () if repeats is None else repeats.trials
    holds = [trial.hold for trial in verdict.wrenches]
    measured = {
        "critical_friction": friction.predicted,
        "simulated_critical_friction": friction.simulated,
        "limit_n": predicted,
        "simulated_limit_n": simulated,
        "displacement_m": float(np.max([hold.displacement_m for hold in holds])),
        "rotation_rad": float(np.max([hold.rotation_rad for hold in holds])),
    }
    return Entry(
        id=grasp.id,
        contacts_sha256=contacts_sha256(grasp.contacts),
        outcome=verdict.outcome,
        wrenches=len(verdict.wrenches),
        not_held=tuple(trial.name for trial in verdict.failures),
        controls=len(verdict.controls),
        controls_let_go=sum(control.failed for control in verdict.controls),
        mismatches=len(verdict.mismatches),
        noisy_trials=len(noisy),
        noisy_not_held=tuple(t.number for t in noisy if t.outcome is not Outcome.HELD),
        noisy_close=tuple(trial.number for trial in noisy if trial.close),
        **{name: _rounded(value) for name, value in measured.items()},  # pyright: ignore
    )


def _rounded(value: float | None) -> float | None:
    """To the digits that are kept; None for what no file can hold."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}")


def _limits(trial: WrenchVerdict, radius_m: float) -> tuple[float, float | None]:
    """The size of the largest wrench along a trial's, by analysis and in simulation."""
    scaled = trial.wrench / np.array([1.0] * 3 + [radius_m] * 3)
    predicted = trial.predicted_limit * float(np.linalg.norm(scaled))
    found = trial.simulated_limit
    return predicted, None if found is None else predicted * found.share
