"""Judges many grasps by published tests, in one process or in several."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.parallel.processes import each
from sim_validate.protocols.judgement import Judgement
from sim_validate.protocols.judging import judge_by, judge_hand_by
from sim_validate.simulation.setup import Setup


@dataclass(frozen=True, slots=True)
class GraspCase:
    """A grasp to judge by a test, as it is sent to a worker process."""

    protocol: str
    body: Polyhedron
    grasp: Grasp
    friction: float
    setup: Setup
    seed: int


@dataclass(frozen=True, slots=True)
class HandCase:
    """A hand in a grasp to judge by a test, as it is sent to a worker process."""

    protocol: str
    hand: Hand
    body: Polyhedron
    reach: HandReach
    friction: float
    seed: int


def judged(cases: Sequence[GraspCase | HandCase], processes: int) -> Iterator[Judgement]:
    """Yield one judgement per case, in order; the number of processes does not change them."""
    yield from each(judged_case, cases, jobs=processes)


def judged_case(case: GraspCase | HandCase) -> Judgement:
    """Judge one case."""
    if isinstance(case, HandCase):
        return judge_hand_by(
            case.protocol, case.hand, case.body, case.reach, case.friction, seed=case.seed
        )
    return judge_by(
        case.protocol, case.body, case.grasp, case.friction, setup=case.setup, seed=case.seed
    )
