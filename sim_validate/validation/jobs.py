"""Validates several grasps of one object, in one process or in several, with results in order."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.parallel.processes import each, processes
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.validation import validate


@dataclass(frozen=True, slots=True)
class Job:
    """One grasp to validate, as it is sent to a worker process."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    agenda: Agenda
    setup: Setup


def validated(jobs: Sequence[Job], processors: int) -> Iterator[Verdict]:
    """Yield one verdict per job, in order; the number of processors does not change the results.

    Args:
        jobs: The grasps to validate.
        processors: How many processors to use: as processes, and as threads of the simulator where
            there are too few grasps for that many processes.

    Raises:
        InputError: A grasp is refused.
        UnfaithfulError: The simulator fails its checks on cases with known answers.
    """
    return each(verdict_of, with_threads(jobs, processors), jobs=processors)


def with_threads(jobs: Sequence[Job], processors: int) -> list[Job]:
    """Give each job an equal share of the processors that remain when there are fewer jobs."""
    threads = max(1, processors // processes(len(jobs), processors))
    return [replace(job, setup=replace(job.setup, threads=threads)) for job in jobs]


def verdict_of(job: Job) -> Verdict:
    """Validate one grasp.

    Raises:
        InputError: The grasp is refused.
        UnfaithfulError: The simulator fails its checks on cases with known answers.
    """
    return validate(job.body, job.grasp, job.friction, agenda=job.agenda, setup=job.setup)
