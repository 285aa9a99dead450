"""Validates several grasps of one object, in one process or in several, with results in order."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

from grasp_core.checked import coefficient, function, instance, several, whole
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.parallel.processes import Shared, each, processes
from sim_validate.simulation.gate.gate import Gate, measured_gate, remember_gate
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.validation import asked_for, validate

Progress: TypeAlias = Callable[[int, int, Verdict], object]
"""Function that is told the number of grasps done, the number of all, and the last verdict."""


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
    """Yield one verdict per job, in order; the number of processors does not change the results."""
    count = processes(len(jobs), processors)
    return each(verdict_of, prepared(jobs, processors), jobs=count)


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
    """Validate one grasp."""
    if job.gate is not None:
        remember_gate(job.gate, job.setup, job.friction, job.body.radius)
    return validate(job.body, job.grasp, job.friction, agenda=job.agenda, setup=job.setup)


def validate_all(
    body: Polyhedron,
    grasps: Iterable[Grasp],
    friction: float = 0.5,
    *,
    agenda: Agenda | None = None,
    setup: Setup | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> tuple[Verdict, ...]:
    """Test many grasps of one object in simulation, each as `validate` does.

    Args:
        body: The object.
        grasps: Grasps in force closure at this friction, such as a plan.
        friction: Coulomb coefficient at every contact.
        agenda: Which trials to run; the default agenda if None.
        setup: How trials are simulated; the default setup if None.
        jobs: Largest number of processors to use; results do not depend on it. From 16 grasps on
            they are used as processes.
        progress: Called after each grasp, in order, with the number of grasps done, the number of
            all, and the verdict. What it raises ends the loop.

    Returns:
        One verdict per grasp, in order.

    Raises:
        InputError: A grasp is not on the body's faces, or not closed at this friction.
        UnfaithfulError: The simulator fails its checks with these settings.
    """
    check_body(body)
    coefficient(friction)
    kind = partial(instance, kind=Grasp, name="grasps")
    listed = several(grasps, kind, "grasps", "Grasp values")
    agenda, setup = asked_for(agenda, setup)
    whole(jobs, "jobs", least=1)
    if progress is not None:
        function(progress, "progress")
    tasks = [Job(body, grasp, friction, agenda, setup) for grasp in listed]
    verdicts: list[Verdict] = []
    for verdict in validated(tasks, jobs) if jobs > 1 else map(verdict_of, tasks):
        verdicts.append(verdict)
        if progress is not None:
            progress(len(verdicts), len(tasks), verdict)
    return tuple(verdicts)
