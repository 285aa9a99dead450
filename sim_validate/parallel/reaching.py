"""Looks for poses of a hand in many grasps, in one process or in several."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, reach_with
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.parallel.processes import each


@dataclass(frozen=True, slots=True)
class ReachJob:
    """One grasp to reach, as it is sent to a worker process."""

    hand: Hand
    body: Polyhedron
    grasp: Grasp
    friction: float
    seed: int
    regions: bool
    table_down: tuple[float, float, float] | None
    clearance_m: float
    starts: int


def reached(jobs: Sequence[ReachJob], processes: int) -> Iterator[HandReach]:
    """Yield one result per job, in order; the number of processes does not change the results."""
    yield from each(reach_one, jobs, jobs=processes)


def reach_one(job: ReachJob) -> HandReach:
    """Look for a pose in one grasp."""
    return reach_with(
        job.hand, job.body, job.grasp, job.friction, seed=job.seed, regions=job.regions,
        table_down=job.table_down, clearance_m=job.clearance_m, starts=job.starts,
    )  # fmt: skip
