"""What a baseline keeps of verdicts, to compare later ones: a header, and one entry per grasp."""

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
"""Number of digits that are kept of a number."""
NUMBERS = (
    "critical_friction", "simulated_critical_friction", "limit_n", "simulated_limit_n",
    "displacement_m", "rotation_rad",
)  # fmt: skip
"""Names of the fields that are measured."""
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
Count = Annotated[int, Field(ge=0)]
Size = Annotated[float, Field(ge=0.0)]


@dataclass(frozen=True, slots=True, config=STRICT)
class Entry:
    """What a baseline keeps of the verdict on one grasp; None for what was not measurable."""

    id: str
    contacts_sha256: str
    """Hash of positions and normals, in finger order."""
    outcome: Outcome
    """`held`, or how the first wrench that was not held ended."""
    wrenches: Count
    """Number of wrenches."""
    not_held: tuple[str, ...]
    """Names of the wrenches that were not held, in order."""
    controls: Count
    """Number of negative controls."""
    controls_let_go: Count
    """Number of negative controls that were let go, as they must be."""
    mismatches: Count
    """Number of ways in which simulation contradicts the analysis."""
    critical_friction: Size
    simulated_critical_friction: Size | None
    limit_n: Size
    """Size of the largest resisted wrench along the weakest one, by analysis [N]; torques are
    divided by the object's radius."""
    simulated_limit_n: Size | None
    """Size of the largest resisted wrench along the weakest one, in simulation [N]."""
    displacement_m: Size | None
    """Largest motion of the object in any trial [m]."""
    rotation_rad: Size | None
    noisy_trials: Count
    """Number of repeats with noise."""
    noisy_not_held: tuple[Count, ...]
    """Numbers of the repeats that were not held."""
    noisy_close: tuple[Count, ...]
    """Numbers of the repeats with a load very close to the largest that can be resisted."""

    def __post_init__(self) -> None:
        """Refuse an entry that contradicts itself."""
        if self.held == bool(self.not_held):
            raise ValueError(
                f"outcome is {self.outcome.value}, but wrenches not held are {self.not_held}"
            )
        if self.controls_let_go > self.controls or len(self.not_held) > self.wrenches:
            raise ValueError("more wrenches or controls ended in some way than were tried")
        if any(number >= self.noisy_trials for number in (*self.noisy_not_held, *self.noisy_close)):
            raise ValueError("a number is not below the number of repeats with noise")

    @property
    def held(self) -> bool:
        """Whether every wrench held."""
        return self.outcome is Outcome.HELD

    @property
    def noisy_held(self) -> int:
        """Number of repeats with noise that held."""
        return self.noisy_trials - len(self.noisy_not_held)


@dataclass(frozen=True, slots=True, config=STRICT)
class Baseline:
    """Verdicts on the grasps of one object, and all that they depend on."""

    grasps_file: str
    """Path of the grasps from the baseline's folder."""
    limit: Annotated[int, Field(ge=1)] | None
    """Number of grasps, the first ones of the file; None for all."""
    object: str
    content_sha256: str
    """Hash of the object's mesh."""
    friction: Size
    planned_radius_m: Size | None
    """Radius of the fingertips that the grasps were planned for, if any [m]."""
    settings: Mapping[str, Any]
    """How trials were simulated, and which ones."""
    versions: Mapping[str, str]
    arithmetic: str
    """Hash of how the processor rounds that measured them."""
    entries: tuple[Entry, ...]
    """Entries sorted by id."""

    def __post_init__(self) -> None:
        """Refuse two entries of one grasp."""
        if len({entry.id for entry in self.entries}) < len(self.entries):
            raise ValueError("two grasps have the same id")


def plain(entry: Entry | None) -> dict[str, Any] | None:
    """An entry as plain values, which can be sent between processes and written into any file."""
    return None if entry is None else json.loads(json.dumps(asdict(entry), allow_nan=False))


def entry_of(grasp: Grasp, verdict: Verdict, radius_m: float) -> Entry:
    """Make the entry of a verdict.

    Args:
        grasp: The grasp.
        verdict: What simulation says about it.
        radius_m: Radius of the object [m].
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
        controls_let_go=sum(control.let_go for control in verdict.controls),
        mismatches=len(verdict.mismatches),
        noisy_trials=len(noisy),
        noisy_not_held=tuple(t.number for t in noisy if t.outcome is not Outcome.HELD),
        noisy_close=tuple(trial.number for trial in noisy if trial.close),
        **{name: _rounded(value) for name, value in measured.items()},  # pyright: ignore
    )


def _rounded(value: float | None) -> float | None:
    """Round a number to the digits that are kept; None for what no file can hold."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}")


def _limits(trial: WrenchVerdict, radius_m: float) -> tuple[float, float | None]:
    """Size of the largest wrench along a trial's, by analysis and in simulation [N]."""
    scaled = trial.wrench / np.array([1.0] * 3 + [radius_m] * 3)
    predicted = trial.predicted_limit * float(np.linalg.norm(scaled))
    found = trial.simulated_limit
    return predicted, None if found is None else predicted * found.share
