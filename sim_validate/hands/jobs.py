"""Tests a hand in many grasps, or executes them with it, in one process or in several."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from grasp_core.errors import InputError, NoForcesError
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.execution.enough import Enough, NoSqueezeError
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.execution.verdict import Execution
from sim_validate.hands.execute_hand import execute_hand
from sim_validate.hands.hand_verdict import HandVerdict
from sim_validate.hands.validate_hand import validate_hand
from sim_validate.parallel.processes import each
from sim_validate.simulation.setup import Agenda


@dataclass(frozen=True, slots=True)
class HandJob:
    """One pose to test, as it is sent to a worker process."""

    hand: Hand
    body: Polyhedron
    reach: HandReach
    friction: float
    settings: ExecutionSettings | None = None
    """How to execute the grasp; None where it is only to hold test wrenches."""


@dataclass(frozen=True, slots=True, eq=False)
class ExecutedHand:
    """What came of executing one grasp with a hand."""

    grasp: str
    execution: Execution | None
    """The trials; None where the grasp cannot be executed."""
    refused: str = ""
    """Why the grasp cannot be executed; empty if it was."""
    enough: Enough | None = None
    """The push, and stiffness, that would be enough for the trials, as in `Execution.enough`."""

    @property
    def survived(self) -> bool:
        """Return whether the object survived every trial."""
        return self.execution is not None and self.execution.survived

    @property
    def least_predicted_loss(self) -> float:
        """Return the least multiple of a trial's load at which the object is predicted to be lost.

        It is zero where the grasp cannot be executed.
        """
        return 0.0 if self.execution is None else self.execution.least_predicted_loss

    @property
    def good(self) -> bool:
        """Return whether the object survived every trial, and every control slipped."""
        return self.survived and self.execution is not None and self.execution.controls_let_go


def held_by_hands(jobs: Sequence[HandJob], processes: int) -> Iterator[HandVerdict]:
    """Yield one verdict per job, in order; the number of processes does not change the results."""
    yield from each(held_by_hand, jobs, jobs=processes)


def held_by_hand(job: HandJob) -> HandVerdict:
    """Test one pose with the usual wrenches and controls."""
    agenda = Agenda(critical_friction=False)
    return validate_hand(job.hand, job.body, job.reach, job.friction, agenda=agenda)


def executed_by_hands(jobs: Sequence[HandJob], processes: int) -> Iterator[ExecutedHand]:
    """Yield one result per job, in order; the number of processes does not change the results."""
    yield from each(executed_by_hand, jobs, jobs=processes)


def executed_by_hand(job: HandJob) -> ExecutedHand:
    """Execute one grasp with the settings of its job."""
    try:
        found = execute_hand(job.hand, job.body, job.reach, job.friction, job.settings)
    except (InputError, NoForcesError) as error:
        answer = error.enough if isinstance(error, NoSqueezeError) else None
        return ExecutedHand(job.reach.grasp, None, str(error), answer)
    return ExecutedHand(job.reach.grasp, found, enough=found.enough)
