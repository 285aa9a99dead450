"""Executes several grasps of one object, in one process or in several, with results in order."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from grasp_core.by_value import ByValue
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import NoForcesError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import first_best
from grasp_core.values import Grasp
from scenes.physics import PhysicsSettings
from sim_validate.execution.enough import Enough, NoSqueezeError
from sim_validate.execution.execute import chosen_squeeze, execute, held_scene
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.execution.verdict import Execution, ExecutionTrial
from sim_validate.parallel.processes import each, processes


@dataclass(frozen=True, slots=True)
class ExecutionJob:
    """One grasp to execute, as it is sent to a worker process."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    settings: ExecutionSettings
    physics: Mapping[str, object] = field(default_factory=dict[str, object])
    """Settings of the simulator that differ from the usual ones, by name."""
    threads: int = 1
    enough: bool = True
    """Whether to find the push that would be enough where the object is lost."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ExecutedGrasp(ByValue):
    """A grasp with what its execution found, or with the reason why no squeeze holds the object."""

    id: str
    family: str
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


def executed(jobs: Sequence[ExecutionJob], processors: int) -> Iterator[ExecutedGrasp]:
    """Yield one result per job, in order; the number of processors does not change the results."""
    count = processes(len(jobs), processors)
    threads = max(1, processors // count)
    return each(executed_grasp, [replace(job, threads=threads) for job in jobs], jobs=count)


def executed_grasp(job: ExecutionJob) -> ExecutedGrasp:
    """Execute one grasp; a grasp without a squeeze is a result with a reason."""
    grasp = job.grasp
    about = grasp.id, grasp.family, contacts_sha256(grasp.contacts)
    try:
        found = execute(
            job.body,
            grasp,
            job.friction,
            job.settings,
            physics=physics_of(job),
            threads=job.threads,
            enough=job.enough,
        )
    except NoForcesError as error:
        answer = error.enough if isinstance(error, NoSqueezeError) else None
        return ExecutedGrasp(*about, None, str(error), answer)
    return ExecutedGrasp(*about, found, None, found.enough)


def physics_of(job: ExecutionJob) -> PhysicsSettings | None:
    """Return the usual settings for the grasp's springs and masses with the job's changes.

    Gives the settings; None where the job changes nothing, and the usual ones are taken, or where
    no squeeze carries the weight.
    """
    if not job.physics:
        return None
    try:
        best = chosen_squeeze(job.body, job.grasp, job.friction, job.settings)
    except NoForcesError:
        return None
    return replace(held_scene(job.body, best.grip, job.settings).physics, **job.physics)
