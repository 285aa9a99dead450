"""What an execution found: each trial with its outcome and prediction, and whether all survived.

These are also what `executions.json` holds.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, computed_field

from grasp_core.allowed_values import FLAT, Number, OrInfinity, Quantity, path_of
from grasp_core.arrays import Array, Shape
from grasp_core.closure.contacts import LEAST_CONTACTS
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Compared, Shown, cell, figure, less, more
from grasp_core.files.file_kinds import EXECUTIONS
from grasp_core.files.records import UNRECORDED
from grasp_core.messages import MILLI, FieldError
from grasp_core.solvers.ties import first_best
from scenes.mujoco_options import PhysicsSettings
from sim_validate.files.result_files import AboutGrasps
from sim_validate.settings import ExecutionSettings, TrialKind

Fate: TypeAlias = Literal["stuck", "slipped", "dropped", "diverged"]
"""What became of the object: no contact slipped, one did and it was kept, it was lost, or the
simulator could not follow it."""
LOSING_FATES = ("dropped", "diverged")
"""Fates that no trial survives."""
CLEAR_OF_SLIP = 1.05
"""Predicted first slip from which on no contact slips, however processors round."""


MULTIPLE_FORM = ".2f"
DEGREES = math.degrees(1.0)
NO_MOTION = "-"
"""What stands for a motion that the simulator could not follow."""
LOSSES = Compared(items=("no longer survived", "survived now"))
MORE_HELD = Compared(more, "controls that did not slip")
LESS_PREDICTED, LESS_SIMULATED = Compared(less, analysed=True), Compared(less, close="slips")
FARTHER = Compared(more, close="slips")
REASON_GIVEN = Compared(lambda _, after: after is not None)


@declared
class ExecutionTrial(Declared):
    """One trial of an execution, simulated and predicted."""

    kind: TrialKind
    """`weight`, `lift`, `shake`, `stop`, `knock` or `misplaced`."""
    name: Annotated[str, Shown("trial")]
    """The kind with its direction or number."""
    survived: Annotated[bool, Shown("survived")]
    """Whether the object was kept, and moved no farther than the settings allow."""
    fate: Annotated[Fate, Shown("fate")]
    """What became of the object: `stuck`, `slipped`, `dropped` or `diverged`. If it was kept, and
    the trial was not survived, it moved or turned too far."""
    slip_m: Annotated[OrInfinity, Shown("mm slid", ".3g", MILLI, NO_MOTION)]
    """Farthest that a point of contact slid on the object [m]; infinite where the simulator
    diverged, as the next two are."""
    displacement_m: Annotated[OrInfinity, Shown("mm moved", ".3g", MILLI, NO_MOTION)]
    """Largest displacement of the centre of mass against the palm [m]."""
    turn_rad: Annotated[OrInfinity, Shown("deg turned", ".3g", DEGREES, NO_MOTION)]
    """Largest turn against the palm [rad]."""
    predicted_first_slip: Annotated[OrInfinity, Shown("slip predicted", MULTIPLE_FORM)]
    """Multiple of the trial's load at which the first contact slips, predicted: above one none
    does; for `misplaced`, that of the weight in the planned place."""
    predicted_loss: Annotated[OrInfinity, Shown("loss predicted", MULTIPLE_FORM)]
    """Multiple of the trial's load at which the object is lost, predicted: it moves or turns
    farther than the settings allow, or nothing balances the load; for `misplaced`, that of the
    weight in the planned place."""
    simulated_first_slip: Annotated[OrInfinity, Shown("slip simulated", MULTIPLE_FORM)]
    """Multiple of the trial's load at which the first contact slips, from the simulated contact
    forces: one or less if a contact slipped, which is the share of the weight that had come, else
    how far away slip stayed. A slip under a load that follows the whole weight shows as one."""
    step_s: Quantity
    """Length of the shortest steps that the simulator took: an object that slips and is lost, or
    moves by more than 0.3 of what is allowed, is simulated again with steps of half the length, and
    with steps of 1/8 ms where that does not settle it [s]."""
    starts_closed: bool | None = None
    """Whether fingers first meet a misplaced object in force closure, before they squeeze; null for
    other trials, and where it is too close to decide."""
    converged: bool = False
    """Whether shorter steps would find the same motion: no contact slips, or the object is kept and
    two runs agree about its motion, or one with steps of 1/8 ms found it. Elsewhere `slip_m`,
    `displacement_m` and `turn_rad` tell their order only, as those of every object that slips and
    is lost: that it is lost does not depend on the steps, but how far it goes then does."""

    def _check_together(self) -> None:
        unknown = [math.isinf(each) for each in (self.slip_m, self.displacement_m, self.turn_rad)]
        if unknown != [self.fate == "diverged"] * 3:
            raise InputError(
                f"trial {self.name}: slip_m, displacement_m and turn_rad are infinite (null in "
                f"files) where the fate is diverged, and nowhere else; got the fate {self.fate} "
                f"with {self.slip_m}, {self.displacement_m} and {self.turn_rad}"
            )
        if self.survived and self.fate in LOSING_FATES:
            raise InputError(f"trial {self.name}: survived is false where the fate is {self.fate}")

    @property
    def dropped(self) -> bool:
        """Whether no fingertip touched the object at the end."""
        return self.fate == "dropped"


@declared
class ExecutionControl(Declared):
    """A trial that must slip: the least load that does so, on a grip weaker than certified."""

    name: Annotated[str, Shown("control")]
    """What is weaker than certified: friction, squeeze, or a finger that does not push."""
    let_go: Annotated[bool, Shown("let go")]
    """Whether a contact slipped, as it must."""
    first_slip: Annotated[OrInfinity, Shown("first slip", MULTIPLE_FORM)]
    """Multiple of the load at which a contact slipped."""


@declared
class Skipped(Declared):
    """A kind of trial that was asked for and left out, and why."""

    kind: TrialKind
    reason: str


@declared
class Enough(Declared):
    """The least push that is proved to carry what the trials ask, or the reason why none is."""

    load_multiple: float
    """Multiple of the weight, in any direction, that the squeeze with this push is certified for;
    where there is none, the multiple that the trials ask."""
    push_n: Quantity | None = None
    """Largest normal force of a finger, `push_n` of the settings [N]; None where none is enough."""
    stiffness_n_per_m: Quantity | None = None
    """Stiffness of the fingertips for it: that which was used, or the least that is enough."""
    predicted_loss: OrInfinity | None = None
    """Least multiple of a trial's load at which the object is then lost, predicted."""
    reason: str | None = None
    """Why no push is found to be enough; None where one is."""

    def _check_together(self) -> None:
        if self.push_n is not None and self.predicted_loss is None:
            object.__setattr__(self, "predicted_loss", math.inf)  # null in files
        missing = (self.push_n, self.stiffness_n_per_m, self.predicted_loss).count(None)
        if missing != (0 if self.reason is None else 3):
            raise InputError(
                "expected a push with its stiffness and predicted loss, or a reason why there is "
                f"none, got {self!r}"
            )

    def __str__(self) -> str:
        carried = f"{self.load_multiple:.3g} times the weight in any direction"
        if self.push_n is None:
            return f"no push is found to be enough for {carried}: {self.reason}"
        return (
            f"pushes of {self.push_n:g} N with a stiffness of {self.stiffness_n_per_m:g} N/m are "
            f"proved to be enough for {carried}, and predicted to lose the object at "
            f"{self.predicted_loss:.3g} times the loads of the trials"
        )


@declared
class Execution(Declared):
    """The trials of one grasp, executed with one squeeze that was never replanned."""

    mass_kg: Quantity
    """Mass of the object [kg]."""
    squeeze: Annotated[Array, Shape("k", 3), Field(alias="squeeze_n")]
    """Contact forces at rest, on the object, (k, 3) [N]."""
    load_multiple: Annotated[float, Shown("load", ".3g", compared=LESS_PREDICTED)]
    """Multiple of the object's weight, in any direction, that the squeeze is certified for; this
    less one is the acceleration [g] that the palm may slowly come to."""
    trials: Annotated[tuple[ExecutionTrial, ...], Compared(less)]
    """How each trial ended."""
    controls: tuple[ExecutionControl, ...]
    """How each negative control ended."""
    skipped: tuple[Skipped, ...]
    """Kinds of trials that were asked for and left out, with the reasons."""
    physics: PhysicsSettings | None = None
    """Settings of the simulator, where they are known."""
    tip_radius_m: Annotated[Array, Shape("k")] | None = None
    """Radii of the fingertips that were used, (k,) [m], where they are known."""
    over_edges: tuple[Number, ...] = ()
    """Contacts nearer to an edge of their face than the dent of their squeezed fingertip is wide:
    predictions, which know one face under each, do not hold there."""
    enough: Annotated[Enough | None, UNRECORDED] = None
    """The push, and stiffness, that would be enough for the trials; None where all were survived,
    or it was not asked for."""

    def _check_together(self) -> None:
        if len(self.squeeze) < LEAST_CONTACTS:
            raise FieldError("squeeze", "must have a force for each contact, at least two, got "
                             f"{len(self.squeeze)}")  # fmt: skip

    @computed_field
    @property
    def payload_kg(self) -> Annotated[float, Shown("payload kg", ".3g", compared=None)]:
        """Largest mass that the squeeze is certified to carry slowly, in any direction [kg]."""
        return self.load_multiple * self.mass_kg

    @computed_field
    @property
    def predicted_first_slip(
        self,
    ) -> Annotated[OrInfinity, Shown("slip", MULTIPLE_FORM, compared=LESS_PREDICTED)]:
        """Least multiple of a trial's load at which a contact slips, predicted."""
        return min((trial.predicted_first_slip for trial in self.trials), default=math.inf)

    @computed_field
    @property
    def simulated_first_slip(
        self,
    ) -> Annotated[OrInfinity, Shown("in sim", MULTIPLE_FORM, compared=LESS_SIMULATED)]:
        """Least multiple of a load that slips in simulation; one also stands for a later slip."""
        return min((trial.simulated_first_slip for trial in self.trials), default=math.inf)

    @computed_field
    @property
    def displacement_m(
        self,
    ) -> Annotated[OrInfinity, Shown("mm moved", ".3g", MILLI, NO_MOTION, compared=FARTHER)]:
        """Largest displacement of the centre of mass against the palm in any trial [m]."""
        return max((trial.displacement_m for trial in self.trials), default=0.0)

    @computed_field
    @property
    def lost(self) -> Annotated[tuple[str, ...], Shown("lost", compared=LOSSES)]:
        """Trials that the object did not survive, by name."""
        return tuple(trial.name for trial in self.trials if not trial.survived)

    @computed_field
    @property
    def controls_held(self) -> Annotated[tuple[str, ...], MORE_HELD]:
        """Negative controls that did not slip, as they must, by name."""
        return tuple(control.name for control in self.controls if not control.let_go)

    @figure
    def slips(self) -> Annotated[bool, Compared(None)]:
        """Whether a contact may slip by prediction: how far it then slides depends on rounding."""
        return self.predicted_first_slip < CLEAR_OF_SLIP

    @figure
    def slip_m(self) -> Annotated[OrInfinity, FARTHER]:
        """Farthest that a point of contact slid on the object in any trial [m]."""
        return max((trial.slip_m for trial in self.trials), default=0.0)

    @figure
    def turn_rad(self) -> Annotated[OrInfinity, FARTHER]:
        """Largest turn of the object against the palm in any trial [rad]."""
        return max((trial.turn_rad for trial in self.trials), default=0.0)

    @property
    def survived(self) -> bool:
        """Whether the object survived every trial, of at least one."""
        return bool(self.trials) and not self.lost

    @property
    def controls_let_go(self) -> bool:
        """Whether every control slipped, as it must."""
        return not self.controls_held

    @property
    def least_predicted_loss(self) -> float:
        """Least multiple of a trial's load at which the object is lost, predicted; 0 without one.

        It ranks grasps by survival better than any other number, but is blind to what the fingers
        meet when an object is misplaced: for those trials it is that of the weight where planned.
        """
        return min((trial.predicted_loss for trial in self.trials), default=0.0)

    def of_kind(self, kind: str) -> tuple[ExecutionTrial, ...]:
        """Return the trials of a kind."""
        return tuple(trial for trial in self.trials if trial.kind == kind)

    def survival(self, kind: str) -> tuple[int, int]:
        """Return how many trials of a kind the object survived, and of how many."""
        own = self.of_kind(kind)
        return sum(trial.survived for trial in own), len(own)


@declared
class ExecutedGrasp(Declared):
    """A grasp with what its execution found, or with the reason why no squeeze holds the object."""

    id: Annotated[str, Shown("grasp", compared=None)]
    family: str
    """Construction of the contacts; empty where a hand executed them."""
    contacts_sha256: str
    """Hash of the contacts, which tells grasps of one id apart."""
    execution: Annotated[Execution | None, FLAT]
    """Trials and negative controls; None where no squeeze carries the weight."""
    reason: Annotated[str | None, REASON_GIVEN] = None
    """Why there is no execution: no squeeze carries the weight, the best one is unstable, or what
    else is wrong with the grasp."""
    enough: Enough | None = None
    """The push, and stiffness, that would be enough for the trials, as in `Execution.enough`."""

    def _check_together(self) -> None:
        if (self.execution is None) == (self.reason is None):
            raise InputError(
                f"grasp {self.id}: expected an execution, or a reason why there is none, got "
                f"{'neither' if self.reason is None else 'both'}"
            )
        if self.execution is not None:  # it says the same, though a file says it once
            known = self.execution.enough or self.enough
            object.__setattr__(self, "enough", known)
            if self.execution.enough != known:
                object.__setattr__(self, "execution", replace(self.execution, enough=known))
        if self.survived and self.enough is not None:
            raise FieldError("enough", "must be None (null), as every trial was survived")

    @computed_field
    @property
    def survived(self) -> Annotated[bool, Shown("survived", compared=Compared(less))]:
        """Whether the object survived every trial, of at least one."""
        return self.execution is not None and self.execution.survived

    @computed_field
    @property
    def controls_let_go(self) -> bool:
        """Whether every negative control slipped, as it must; True where there is none."""
        return self.execution is None or self.execution.controls_let_go

    @computed_field
    @property
    def least_predicted_loss(
        self,
    ) -> Annotated[OrInfinity, Shown("least loss", MULTIPLE_FORM, compared=None)]:
        """Least multiple of a trial's load at which the object is lost, predicted.

        It is the number to choose by, but does not see where fingers meet a misplaced object. It is
        0 where no squeeze holds the object, or no trial is possible.
        """
        return 0.0 if self.execution is None else self.execution.least_predicted_loss

    @property
    def trials(self) -> tuple[ExecutionTrial, ...]:
        """The trials of the execution; empty where no squeeze holds the object."""
        return () if self.execution is None else self.execution.trials


@declared
class Executions(AboutGrasps[ExecutedGrasp]):
    """The executions of an object's grasps, as `executions.json` holds them."""

    FILE = EXECUTIONS
    SCHEMA = 2

    settings: ExecutionSettings
    """How they were executed, with the impulse of a knock that was used."""
    grasps: Annotated[tuple[ExecutedGrasp, ...], Field(alias="executions")]
    """What the execution of each grasp found."""

    def _check_together(self) -> None:
        object.__setattr__(self, "settings", self.settings.used)

    @computed_field
    @property
    def summary(self) -> Mapping[str, int]:
        """Numbers of grasps, trials and negative controls, and how they ended."""
        found = [grasp.execution for grasp in self.grasps if grasp.execution is not None]
        trials = sum(len(each.trials) for each in found)
        controls = sum(len(each.controls) for each in found)
        return {
            "grasps": len(self.grasps),
            "grasps_survived": sum(grasp.survived for grasp in self.grasps),
            "grasps_without_squeeze": len(self.grasps) - len(found),
            "trials": trials,
            "trials_survived": trials - sum(len(each.lost) for each in found),
            "controls": controls,
            "controls_let_go": controls - sum(len(each.controls_held) for each in found),
        }


def load_executions(path: str | Path) -> Executions:
    """Read executions, as `graspproof execute` and `graspproof run --execute` write them.

    Args:
        path: An `executions.json`.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    return Executions.read(path_of(path, "path"))


def best_executed(grasps: Iterable[ExecutedGrasp]) -> ExecutedGrasp | None:
    """Return the grasp with the largest least predicted loss of those that survived, if any."""
    kept = [grasp for grasp in grasps if grasp.survived and grasp.controls_let_go]
    losses = [grasp.least_predicted_loss for grasp in kept]
    return kept[first_best(losses)] if kept else None


def ended(trial: ExecutionTrial, settings: ExecutionSettings | None = None) -> str:
    """Say what became of the object, and where it was kept and still failed, why."""
    if trial.survived or trial.fate in LOSING_FATES:
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
    said = f"lost in {len(found.lost)} of {len(found.trials)} trials"
    if found.least_predicted_loss >= 1.0:
        said += ", none of which was predicted, so it may not be for want of push"
    return said if found.enough is None else f"{said}; {found.enough}"


def edges_in_words(found: Execution) -> list[str]:
    """Say for which contacts the predictions do not hold, if for any."""
    return [
        f"contact {finger} is nearer to an edge of its face than the dent of its fingertip is wide,"
        " so what is predicted does not hold; plan with a larger --edge-clearance-m"
        for finger in found.over_edges
    ]


def held_controls_in_words(found: Execution) -> list[str]:
    """Say which negative controls did not slip, and what follows."""
    return [
        f"control {name} did not slip, though it must: the simulator is not faithful, so its other "
        "outcomes do not count"
        for name in found.controls_held
    ]


def totals_in_words(found: Executions) -> list[str]:
    """Say how many grasps survived, and which of them is best."""
    counts, mass_kg = found.summary, found.settings.mass_kg
    none = counts["grasps_without_squeeze"]
    said = [
        f"{counts['grasps_survived']} of {counts['grasps']} grasps survived every trial with "
        f"{mass_kg:.4g} kg at friction {found.friction:g}; {counts['trials_survived']} of "
        f"{counts['trials']} trials were survived; {counts['controls_let_go']} of "
        f"{counts['controls']} negative controls let go (all should)"
        + (f"; no squeeze holds the object in {none} of them" if none else "")
    ]
    if (best := best_executed(found)) is not None and best.execution is not None:
        said.append(
            f"best for this: {best.id}, predicted to be lost at "
            f"{multiple_in_words(best.least_predicted_loss)} times the loads of its hardest trial; "
            f"its squeeze carries {best.execution.payload_kg:.3g} kg in any direction"
        )
    return said


def multiple_in_words(multiple: float) -> str:
    """Write the multiple of a load at which something happens."""
    return cell(multiple, Shown("", MULTIPLE_FORM))


def may_slip(predicted_first_slip: float | None) -> bool:
    """Return whether a contact may slip by prediction; None stands for a slip that never comes."""
    return predicted_first_slip is not None and predicted_first_slip < CLEAR_OF_SLIP
