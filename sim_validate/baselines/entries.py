"""The contents of a baseline: a header, and one entry that summarises the verdict on each grasp."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.values import Grasp
from sim_validate.baselines.executions import (
    STRICT,
    Count,
    ExecutionEntry,
    Size,
    execution_entry,
    rounded,
)
from sim_validate.baselines.parts.recorded_part import RecordedPart, RecordedShape
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.simulation.setup import WEAKEST
from sim_validate.simulation.traces import Outcome
from sim_validate.validation.verdict import Verdict, WrenchVerdict

NUMBERS = (
    "critical_friction", "simulated_critical_friction", "limit_n", "simulated_limit_n",
    "displacement_m", "rotation_rad",
)  # fmt: skip
"""Names of the fields that hold measured numbers."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Entry:
    """Summary of the verdict on one grasp; None stands for what could not be measured."""

    id: str
    contacts_sha256: str
    """Hash of the contact positions and normals, in finger order."""
    outcome: Outcome
    """`held`, or the outcome of the first wrench that was not held."""
    wrenches: Count
    """Number of wrenches that were tested."""
    not_held: tuple[str, ...]
    """Names of the wrenches that were not held, in order."""
    controls: Count
    """Number of negative controls: contacts that must fail."""
    controls_let_go: Count
    """Number of negative controls that were let go, as they must be."""
    mismatches: Count
    """Number of ways in which simulation contradicts the analysis."""
    critical_friction: Size
    simulated_critical_friction: Size | None
    limit_n: Size
    """Size of the largest wrench that is resisted in the weakest direction, by analysis [N];
    torques are divided by the object's radius."""
    simulated_limit_n: Size | None
    """Size of the largest wrench that is resisted in the weakest direction, in simulation [N]."""
    displacement_m: Size | None
    """Largest motion of the object in any trial [m]."""
    rotation_rad: Size | None
    noisy_trials: Count
    """Number of repeats with noise."""
    noisy_not_held: tuple[Count, ...]
    """Indices of the repeats with noise in which the grasp did not hold."""
    noisy_close: tuple[Count, ...]
    """Indices of the repeats with noise whose load is very close to the largest that can be
    resisted."""
    execution: ExecutionEntry | None = None
    """How the grasp was executed; None if that is not asked for, and then no file mentions it."""

    def __post_init__(self) -> None:
        """Refuse an entry whose numbers contradict each other."""
        if self.held == bool(self.not_held):
            raise ValueError(
                f"`outcome` {self.outcome.value} contradicts `not_held`, which is {self.not_held}"
            )
        if self.controls_let_go > self.controls or len(self.not_held) > self.wrenches:
            raise ValueError(
                "`not_held` or `controls_let_go` counts more than `wrenches` or `controls`"
            )
        if any(number >= self.noisy_trials for number in (*self.noisy_not_held, *self.noisy_close)):
            raise ValueError(
                "`noisy_not_held` and `noisy_close` must hold numbers below `noisy_trials`"
            )

    @property
    def held(self) -> bool:
        """Whether the grasp held every wrench."""
        return self.outcome is Outcome.HELD

    @property
    def noisy_held(self) -> int:
        """Number of repeats with noise in which the grasp held."""
        return self.noisy_trials - len(self.noisy_not_held)


@dataclass(frozen=True, slots=True, config=STRICT)
class Baseline:
    """Verdicts on the grasps of one object, and all settings and versions that they depend on."""

    grasps_file: str
    """Path of the file of grasps, relative to the baseline's folder."""
    limit: Annotated[int, Field(ge=1)] | None
    """Number of grasps that are kept, the first ones of the file; None for all."""
    object: str
    content_sha256: str
    """Hash of the object's mesh."""
    friction: Size
    planned_radius_m: Size | None
    """Radius of the fingertips that the grasps were planned for, if any [m]."""
    settings: Mapping[str, Any]
    """Settings of the simulation, and which trials were run."""
    versions: Mapping[str, str]
    arithmetic: str
    """Hash that tells how the processor rounds."""
    entries: tuple[Entry, ...]
    """Entries of the grasps, sorted by id."""
    unit: str | None = None
    """Unit of length of the mesh file; None where there is none, or it was not known, and then no
    file mentions it."""
    scale: Size | None = None
    """Factor on the coordinates of the mesh file, besides its unit; None where there is none, and
    then no file mentions it."""
    part: RecordedPart | None = None
    """The part that it was written on; None where that is the one that the grasps were planned on,
    and then no file mentions it."""

    def __post_init__(self) -> None:
        """Refuse a baseline with two entries for one grasp."""
        if len({entry.id for entry in self.entries}) < len(self.entries):
            raise ValueError("two grasps of the baseline have the same id")

    @property
    def shape(self) -> RecordedShape:
        """Return what is recorded of the part."""
        return RecordedShape(self.content_sha256, self.unit, self.part)


def plain(entry: Entry | None) -> dict[str, Any] | None:
    """Turn an entry into plain values, which processes can send and any file can hold."""
    return None if entry is None else json.loads(json.dumps(fields_of(entry), allow_nan=False))


def fields_of(entry: Entry) -> dict[str, Any]:
    """Return the fields of an entry by name, without its execution if there is none."""
    found = asdict(entry)
    if entry.execution is None:
        del found["execution"]
    return found


def properties_of(listed: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of an entry by name, those of its execution beside the others."""
    found = {name: value for name, value in listed.items() if name != "execution"}
    executed: Mapping[str, Any] = listed.get("execution") or {}
    return {**found, **{f"execution.{name}": value for name, value in executed.items()}}


def entry_of(
    grasp: Grasp, verdict: Verdict, radius_m: float, executed: ExecutedGrasp | None = None
) -> Entry:
    """Summarise a verdict as an entry of a baseline.

    Takes `radius_m` [m].
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
        execution=None if executed is None else execution_entry(executed),
        **{name: rounded(value) for name, value in measured.items()},  # pyright: ignore
    )


def _limits(trial: WrenchVerdict, radius_m: float) -> tuple[float, float | None]:
    """Compute the size of a trial's wrench at its limits, predicted and simulated [N]."""
    scaled = trial.wrench / np.array([1.0] * 3 + [radius_m] * 3)
    predicted = trial.predicted_limit * float(np.linalg.norm(scaled))
    found = trial.simulated_limit
    return predicted, None if found is None else predicted * found.share
