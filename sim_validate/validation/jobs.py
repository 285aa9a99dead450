"""Validates several grasps of one object, in one process or in several, with results in order."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.parallel.processes import each, processes
from sim_validate.parallel.shared import Shared
from sim_validate.simulation.gate.gate import Gate, measured_gate, remember_gate
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
    gate: Gate | None = None
    """How the simulator did on the known cases, so that worker processes need not ask again."""

    def __reduce__(self) -> tuple[Callable[..., "Job"], tuple[object, ...]]:
        """Send the object so that all grasps of a worker process have the same one."""
        rest = (self.grasp, self.friction, self.agenda, self.setup, self.gate)
        return _arrived, (Shared(self.body), *rest)


def _arrived(body: Shared[Polyhedron], *rest: Any) -> Job:
    return Job(body.value, *rest)


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
    return each(verdict_of, prepared(jobs, processors), jobs=processors)


def prepared(jobs: Sequence[Job], processors: int) -> list[Job]:
    """Check the simulator for each job, and give each an equal share of processors that remain."""
    threads = max(1, processors // processes(len(jobs), processors))
    return [
        replace(
            job, setup=replace(job.setup, threads=threads),
            gate=measured_gate(job.setup, job.friction, job.body.radius),
        )
        for job in jobs
    ]  # fmt: skip


def verdict_of(job: Job) -> Verdict:
    """Validate one grasp.

    Raises:
        InputError: The grasp is refused.
        UnfaithfulError: The simulator fails its checks on cases with known answers.
    """
    if job.gate is not None:
        remember_gate(job.gate, job.setup, job.friction, job.body.radius)
    return validate(job.body, job.grasp, job.friction, agenda=job.agenda, setup=job.setup)
