"""What a published test says about a grasp, beside our verdict and the predicted margin."""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.by_value import ByValue, summary
from sim_validate.protocols.bench import Motion
from sim_validate.protocols.our_verdict import OurVerdict
from sim_validate.protocols.published import Passing, PublishedProtocol
from sim_validate.protocols.timelines import Timeline
from sim_validate.simulation.traces import rotation_angles


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """How one run of a published test ended."""

    number: int
    """Number of the run in the test, from 0."""
    copy: int
    """Number of the copy, from 0; above 0 only where a test displaces the object by noise."""
    passed: bool
    reason: str
    """Why it did not pass; empty if it did."""
    displacement_m: float
    """Largest displacement at a look, up to the first that did not pass [m]."""
    turn_deg: float
    """Largest turn at a look, likewise [deg]."""
    fingers: int
    """Least number of fingers that touched the object at a look, likewise."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Judgement(ByValue):
    """A grasp judged by a published test, by our trials of the same loads, and by the analysis."""

    grasp: str
    """Id of the grasp; empty for contacts without one."""
    hand: str
    """Name of the hand that held the object; empty for fingertips."""
    protocol: PublishedProtocol
    friction: float
    """Coulomb coefficient of our verdict and of the prediction; the test has its own."""
    mass_kg: float
    """Mass of the object in the test [kg]."""
    push_n: float
    """Largest normal force with which a finger squeezes in the test [N]."""
    runs: tuple[RunVerdict, ...]
    ours: OurVerdict
    """Our verdict on the loads of the test, with the predicted margin."""

    @property
    def copies_passed(self) -> int:
        """Return how many copies pass the test."""
        wanted = self.protocol.passing.runs or len(self.protocol.runs)
        kept = [
            sum(each.passed for each in self.runs if each.copy == copy)
            for copy in range(self.protocol.copies)
        ]
        return sum(passed >= wanted for passed in kept)

    @property
    def theirs(self) -> bool:
        """Return whether the grasp passes the published test."""
        return self.copies_passed == self.protocol.copies

    @property
    def predicted(self) -> bool:
        """Return whether the analysis says that the grasp resists all loads of the test."""
        return self.ours.closed and self.ours.margin >= 1.0

    @property
    def good(self) -> bool:
        """Return whether the test and our trials both accept the grasp."""
        return self.theirs and self.ours.held

    def __repr__(self) -> str:
        theirs = f"theirs {'passed' if self.theirs else 'failed'}"
        ours = f"ours {'held' if self.ours.held else 'not held'}"
        told = (self.grasp or "contacts", self.protocol.label, theirs, ours)
        return summary("Judgement", *told, margin=self.ours.margin)


def judged_run(
    numbered: tuple[int, int], motion: Motion, run: Timeline, passing: Passing
) -> RunVerdict:
    """Judge one run at its looks, up to the first that does not pass."""
    number, copy = numbered
    moved, turned, counts, reason = 0.0, 0.0, [len(each) for each in motion.touching], motion.fault
    seen: list[int] = []
    for (sample, first), fingers in zip(run.looks, counts, strict=True):
        if reason:
            break
        begin = _begin(motion, run, first, passing)
        pose = motion.poses[sample]
        shift = float(np.linalg.norm(pose[:3] - begin[:3]))
        turn = float(np.degrees(rotation_angles(pose[None, 3:], begin[None, 3:])[0]))
        moved, turned = max(moved, shift), max(turned, turn)
        seen.append(fingers)
        reason = _why(shift, turn, fingers, passing)
    return RunVerdict(number, copy, not reason, reason, moved, turned, min(seen, default=0))


def _begin(motion: Motion, run: Timeline, first: int, passing: Passing) -> Array:
    if passing.since == "before closing" or (run.closed == 0 and passing.since == "after closing"):
        return motion.start
    sample = run.closed if passing.since == "after closing" else first
    return motion.poses[sample - 1] if sample else motion.start


def _why(shift_m: float, turn_deg: float, fingers: int, passing: Passing) -> str:
    if not shift_m < passing.most_m:
        return f"the object moved by {1e3 * shift_m:.3g} mm, and {1e3 * passing.most_m:g} is enough"
    if not turn_deg < passing.most_deg:
        return f"the object turned by {turn_deg:.3g} deg, and {passing.most_deg:g} is enough"
    if fingers < passing.fingers:
        return f"{fingers} fingers touched the object, and {passing.fingers} must"
    return ""
