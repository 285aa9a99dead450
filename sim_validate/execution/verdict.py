"""What an execution found: each trial with its outcome and prediction, and whether all survived."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from grasp_core.arrays import Array
from grasp_core.declared import ByValue
from grasp_core.errors import InputError
from grasp_core.kinds import OrInfinity
from grasp_core.solvers.ties import first_best
from scenes.mujoco.physics import PhysicsSettings
from sim_validate.execution.enough import Enough
from sim_validate.execution.settings import ExecutionSettings, TrialKind
from sim_validate.execution.trials import Skipped

Fate: TypeAlias = Literal["stuck", "slipped", "dropped", "diverged"]
"""What became of the object: no contact slipped, one did and it was kept, it was lost, or the
simulator could not follow it."""
LOST = ("dropped", "diverged")
"""Fates that no trial survives."""
CLEAR_OF_SLIP = 1.05
"""Predicted first slip from which on no contact slips, however processors round."""


@dataclass(frozen=True, slots=True)
class ExecutionTrial:
    """One trial of an execution, simulated and predicted."""

    kind: TrialKind
    """`weight`, `lift`, `shake`, `stop`, `knock` or `misplaced`."""
    name: str
    """The kind with its direction or number."""
    survived: bool
    """Whether the object was kept, and moved no farther than the settings allow."""
    fate: Fate
    """`stuck`, `slipped` (at a contact, but kept), `dropped`, or `diverged`."""
    slip_m: OrInfinity
    """Farthest that a point of contact slid on the object [m]; infinite where the simulator
    diverged, as the next two are."""
    displacement_m: OrInfinity
    """Largest displacement of the centre of mass against the palm [m]."""
    turn_rad: OrInfinity
    """Largest turn against the palm [rad]."""
    predicted_first_slip: OrInfinity
    """Multiple of the trial's load at which the first contact slips, predicted; for `misplaced`,
    that of the weight in the planned place."""
    predicted_loss: OrInfinity
    """Multiple of the trial's load at which the object is lost, predicted: it moves or turns
    farther than the settings allow, or nothing balances the load; for `misplaced`, that of the
    weight in the planned place."""
    simulated_first_slip: OrInfinity
    """Multiple of the trial's load at which the first contact slips, from the simulated contact
    forces: one or less if a contact slipped, else how far away slip stayed."""
    step_s: float
    """Length of the shortest steps that the simulator took: a loss with steps of the usual length
    counts only if short steps find it as well [s]."""

    def __post_init__(self) -> None:
        unknown = [math.isinf(each) for each in (self.slip_m, self.displacement_m, self.turn_rad)]
        if unknown != [self.fate == "diverged"] * 3:
            raise InputError(
                f"trial {self.name}: slip_m, displacement_m and turn_rad are infinite (null in "
                f"files) where the fate is diverged, and nowhere else; got the fate {self.fate} "
                f"with {self.slip_m}, {self.displacement_m} and {self.turn_rad}"
            )
        if self.survived and self.fate in LOST:
            raise InputError(f"trial {self.name}: survived is false where the fate is {self.fate}")

    @property
    def dropped(self) -> bool:
        """Whether no fingertip touched the object at the end."""
        return self.fate == "dropped"


@dataclass(frozen=True, slots=True)
class ExecutionControl:
    """A trial that must slip: the least load that does so, on a grip weaker than certified."""

    name: str
    """What is weaker than certified: friction, squeeze, or a finger that does not push."""
    let_go: bool
    first_slip: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Execution(ByValue):
    """The trials of one grasp, executed with one squeeze that was never replanned."""

    mass_kg: float
    squeeze: Array
    """Contact forces at rest, on the object, (k, 3) [N]."""
    load_multiple: float
    """Multiple of the object's weight, in any direction, that the squeeze is certified for."""
    trials: tuple[ExecutionTrial, ...]
    controls: tuple[ExecutionControl, ...]
    skipped: tuple[Skipped, ...]
    """Kinds of trials that were asked for and left out, with the reasons."""
    physics: PhysicsSettings | None = None
    """Settings of the simulator, where they are known."""
    tip_radius_m: Array | None = None
    """Radii of the fingertips that were used, (k,) [m], where they are known."""
    enough: Enough | None = None
    """The push, and stiffness, that would be enough for the trials; None where all were survived,
    or it was not asked for."""

    @property
    def survived(self) -> bool:
        """Whether the object survived every trial, of at least one."""
        return bool(self.trials) and all(trial.survived for trial in self.trials)

    @property
    def controls_let_go(self) -> bool:
        """Whether every control slipped, as it must."""
        return all(control.let_go for control in self.controls)

    @property
    def least_predicted_loss(self) -> float:
        """Least multiple of a trial's load at which the object is lost, predicted; 0 without one.

        It ranks grasps by survival better than any other number, but is blind to what the fingers
        meet when an object is misplaced: for those trials it is that of the weight where planned.
        """
        return min((trial.predicted_loss for trial in self.trials), default=0.0)

    @property
    def payload_kg(self) -> float:
        """Largest mass that the squeeze is certified to carry slowly, in any direction [kg]."""
        return self.load_multiple * self.mass_kg

    def of_kind(self, kind: str) -> tuple[ExecutionTrial, ...]:
        """Return the trials of a kind."""
        return tuple(trial for trial in self.trials if trial.kind == kind)

    def survival(self, kind: str) -> tuple[int, int]:
        """Return how many trials of a kind the object survived, and of how many."""
        own = self.of_kind(kind)
        return sum(trial.survived for trial in own), len(own)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ExecutedGrasp(ByValue):
    """A grasp with what its execution found, or with the reason why no squeeze holds the object."""

    id: str
    family: str
    """Construction of the contacts; empty where a hand executed them."""
    contacts_sha256: str
    """Hash of the contacts, which tells grasps of one id apart."""
    execution: Execution | None
    """Trials and negative controls; None where no squeeze carries the weight."""
    reason: str | None = None
    """Why there is no execution: no squeeze carries the weight, or the best one is unstable."""
    enough: Enough | None = None
    """The push, and stiffness, that would be enough for the trials, as in `Execution.enough`."""

    @property
    def survived(self) -> bool:
        """Whether the object survived every trial, of at least one."""
        return self.execution is not None and self.execution.survived

    @property
    def trials(self) -> tuple[ExecutionTrial, ...]:
        """The trials of the execution; empty where no squeeze holds the object."""
        return () if self.execution is None else self.execution.trials

    @property
    def least_predicted_loss(self) -> float:
        """Least multiple of a trial's load at which the object is lost, predicted.

        It is 0 where no squeeze holds the object, or no trial is possible.
        """
        return 0.0 if self.execution is None else self.execution.least_predicted_loss

    @property
    def controls_let_go(self) -> bool:
        """Whether every negative control slipped, as it must; True where there is none."""
        return self.execution is None or self.execution.controls_let_go


def best_executed(grasps: Iterable[ExecutedGrasp]) -> ExecutedGrasp | None:
    """Return the grasp with the largest of the least predicted losses among those that survived.

    A grasp whose negative control held does not count. Of equal ones the first is taken; None if
    no grasp survived.
    """
    kept = [grasp for grasp in grasps if grasp.survived and grasp.controls_let_go]
    losses = [grasp.least_predicted_loss for grasp in kept]
    return kept[first_best(losses)] if kept else None


def ended(trial: ExecutionTrial, settings: ExecutionSettings | None = None) -> str:
    """Say what became of the object, and where it was kept and still failed, why."""
    if trial.survived or trial.fate in LOST:
        return trial.fate
    ways = list[str]()
    if settings is not None:
        ways += ["moved"] if trial.displacement_m > settings.most_m else []
        ways += ["turned"] if trial.turn_rad > settings.most_rad else []
    said = " and ".join(ways) or "moved or turned"
    return f"{said} too far {'after' if trial.fate == 'slipped' else 'without'} a slip"


def trial_in_words(trial: ExecutionTrial, settings: ExecutionSettings | None = None) -> str:
    """Say how a trial of an execution ended, and what was predicted."""
    if trial.fate == "diverged":
        return (
            f"{trial.name}: the simulator could not follow the motion, even in steps of "
            f"{1e3 * trial.step_s:.3g} ms, so the object counts as lost; the load may be too large "
            "for its mass"
        )
    return (
        f"{trial.name}: {ended(trial, settings)}, moved {1e3 * trial.displacement_m:.3g} mm and "
        f"turned {math.degrees(trial.turn_rad):.3g} degrees; first slip predicted at "
        f"{trial.predicted_first_slip:.3g} of the load, simulated at "
        f"{trial.simulated_first_slip:.3g}; loss predicted at {trial.predicted_loss:.3g}"
    )


def losses_in_words(found: Execution, settings: ExecutionSettings | None = None) -> list[str]:
    """Say which trials were not survived, or that there was none to survive."""
    if not found.trials:
        return ["no trial is possible, so nothing was survived"]
    said = [] if found.enough is None else [loss_in_words(found)]
    return said + [trial_in_words(each, settings) for each in found.trials if not each.survived]


def loss_in_words(found: Execution) -> str:
    """Say how many trials were lost, and which push would be enough, where that was asked for."""
    lost = sum(not trial.survived for trial in found.trials)
    said = f"lost in {lost} of {len(found.trials)} trials"
    if found.least_predicted_loss >= 1.0:
        said += ", none of which was predicted, so it may not be for want of push"
    return said if found.enough is None else f"{said}; {found.enough}"


def held_controls_in_words(found: Execution) -> list[str]:
    """Say which negative controls did not slip, and what follows."""
    return [
        f"control {control.name} did not slip, though it must: the simulator is not faithful, so "
        "its other outcomes do not count"
        for control in found.controls
        if not control.let_go
    ]


def may_slip(predicted_first_slip: float | None) -> bool:
    """Return whether a contact may slip by prediction; None stands for a slip that never comes."""
    return predicted_first_slip is not None and predicted_first_slip < CLEAR_OF_SLIP
