"""A plan: the grasps found on one object, what was tried, and what was proved absent."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from textwrap import shorten
from typing import Protocol

from grasp_core.planning.reach import Finger
from grasp_core.short_text import counted, summary
from grasp_core.values import FaceQuadruple, Grasp

LONGEST_REASON = 160
"""Characters of a reason in the `repr` of a plan, which is to be two lines at most."""


class Proof(Protocol):
    """A claim that can be re-checked without any solver."""

    def verify(self) -> bool:
        """Whether plain arithmetic confirms the claim."""
        ...


@dataclass(frozen=True, slots=True)
class MethodCounts:
    """What became of the candidates of one method.

    A candidate is a set of four faces; for pencils and reguli, with one of the three ways to pair
    them. Tried candidates end as one of the last six.
    """

    tried: int = 0
    """Candidates whose programs were set up."""
    pruned: int = 0
    """Candidates skipped because a bound showed that their discs are too small, their pairs are too
    far from symmetric for a regulus, the free method is not needed on them, or because they cannot
    enter the best `limit`."""
    solved: int = 0
    """Choices of one convex piece per face that were considered."""
    infeasible: int = 0
    """No placement with discs of the least radius at the planned angle, with a limit none that
    would enter the best, or none on the surface of curved patches; for the free method, proved to
    have no grasp at all."""
    undecided: int = 0
    """Free method: neither a grasp nor a proof of absence. Others: a program was not solved."""
    duplicates: int = 0
    """Found again at the same contacts, with another pairing."""
    found: int = 0
    """Grasps whose witness is of its family and which exact force closure certified."""
    unreachable: int = 0
    """Certified grasps that the fingers asked for do not reach."""
    rejected: int = 0
    """Placements that the witness or the exact closure test did not confirm: a bug if not 0."""


@dataclass(frozen=True, slots=True)
class Outcomes:
    """What is known of all sets of four faces."""

    held: int
    """A certified grasp exists."""
    absent: int
    """It is proved that there is none, or a face has no room for a contact."""
    open: int
    """Neither: undecided by the free method, or, as with a limit, not asked to the end."""
    out_of_reach: int = 0
    """Certified contacts exist, but no fingers as asked for reached those that were found."""


@dataclass(frozen=True, slots=True)
class PlanCounts:
    """What the planner tried on one object."""

    faces: int
    quadruples: int
    """All sets of four faces."""
    spanning: int | None
    """Those whose normals positively span at the least planned angle (P3); None above 200 faces,
    where they are too many to count."""
    families: Mapping[str, MethodCounts] = field(default_factory=dict[str, MethodCounts])
    """By method, the three families and perhaps `free`."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Plan:
    """The grasps found on one object, best radius first, and what was tried."""

    grasps: tuple[Grasp, ...]
    friction: float
    theta: float
    """Half-angle of the friction cones planned with, before each quadruple's own limit [rad]."""
    seed: int
    counts: PlanCounts
    outcomes: Outcomes
    absence: str | None = None
    """Why there is no grasp, as a sentence; None when there is one."""
    absences: Mapping[FaceQuadruple, tuple[Proof, ...]] = field(
        default_factory=dict[FaceQuadruple, tuple[Proof, ...]]
    )
    """Face quadruples that the free method proved to hold no grasp with friction tan(theta), with
    a proof for their convex hulls, or for each choice of one convex piece per face. Pieces too
    small for a contact, a millionth of the object, are left out."""
    finger: Finger | None = None
    """What was to get to the contacts, if anything."""
    undecided: Mapping[FaceQuadruple, float] = field(default_factory=dict[FaceQuadruple, float])
    """Face quadruples on which the free method found neither, and the share of the choices of
    contacts that is open, where each cut counts for half."""
    unreached: Mapping[FaceQuadruple, str] = field(default_factory=dict[FaceQuadruple, str])
    """Face quadruples with contacts that fingers do not reach, and why."""
    seconds: Mapping[str, float] = field(default_factory=dict[str, float])
    """Processor time of each method, from its first program to the last critical friction."""

    def __repr__(self) -> str:
        """How many grasps there are, the largest of them, and what is known of all quadruples."""
        of, known = self.counts.quadruples, self.outcomes
        sets = f"of {counted(of, 'face quadruple')} {known.held} held, {known.absent} absent"
        sets += f", {known.open} open, {known.out_of_reach} out of reach"
        parts = [counted(len(self.grasps), "grasp"), sets]
        if self.absence is not None:
            parts.append(repr(shorten(self.absence, LONGEST_REASON)))
        radius = max((grasp.radius for grasp in self.grasps), default=0.0)
        return summary("Plan", *parts, friction=self.friction, largest_radius=radius)
