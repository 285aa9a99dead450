"""Tests a hand in many grasps, in one process or in several."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
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


def held_by_hands(jobs: Sequence[HandJob], processes: int) -> Iterator[HandVerdict]:
    """Yield one verdict per job, in order; the number of processes does not change the results."""
    yield from each(held_by_hand, jobs, jobs=processes)


def held_by_hand(job: HandJob) -> HandVerdict:
    """Test one pose with the usual wrenches and controls."""
    agenda = Agenda(critical_friction=False)
    return validate_hand(job.hand, job.body, job.reach, job.friction, agenda=agenda)
