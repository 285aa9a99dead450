"""Searches one object's face quadruples with one construction, keeping its best grasps."""

import math
from bisect import bisect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, islice, takewhile
from typing import TypeAlias

import numpy as np

from grasp_core.cones.spanning import each_cones_positively_span
from grasp_core.families.constructions import Construction
from grasp_core.families.disc_bounds import AttemptBounds
from grasp_core.families.free import Absence
from grasp_core.families.placing import Attempt, Settling
from grasp_core.objects.face_pieces import Shapes
from grasp_core.planning.best_first import BestFirst
from grasp_core.planning.blocks import Blocks
from grasp_core.planning.certify import Candidate, Certified, certify_each, named
from grasp_core.planning.reach import Reach
from grasp_core.planning.result import MethodCounts, Tally
from grasp_core.solvers.ties import graded
from grasp_core.values import FaceQuadruple, Method, four

TOGETHER = 32
"""Number of blocks of quadruples searched at once: a million take some hundred megabytes."""
MOST_ATTEMPTS = 512
"""Number of attempts that are made together at most."""
SAME_MERIT = 1e-5
"""Share by which a new grasp must beat the worst one kept: symmetric objects hold thousands of
equal grasps."""
SAME_CONTACTS = 1e-6
"""Distance between contacts below which two grasps count as one, in object radii."""


SortKey: TypeAlias = tuple[float, FaceQuadruple, FaceQuadruple]
"""Minus the graded merit of a grasp, its faces in rising order, and its faces by finger."""


@dataclass(slots=True, eq=False)
class Gathered:
    """The proofs and counts of a search, or of a part of one."""

    tally: Tally = field(default_factory=Tally)
    absences: dict[FaceQuadruple, tuple[Absence, ...]] = field(
        default_factory=dict[FaceQuadruple, tuple[Absence, ...]]
    )
    undecided: dict[FaceQuadruple, float] = field(default_factory=dict[FaceQuadruple, float])

    def add(self, other: "Gathered") -> None:
        """Add what the next part of the search gathered."""
        self.tally.add(other.tally)
        self.absences.update(other.absences)
        self.undecided.update(other.undecided)


@dataclass(slots=True, eq=False)
class MethodSearch:
    """The grasps, proofs and counts that one method has gathered so far."""

    method: Method
    limit: int | None
    reach: Callable[[Certified], Reach]
    """Function that returns how fingers reach the contacts of a grasp, or why they cannot."""
    best: list[Certified] = field(default_factory=list[Certified])
    """At most `limit` grasps, best first."""
    _keys: list[SortKey] = field(default_factory=list[SortKey])
    """What the grasps of `best` are sorted by."""
    held: set[FaceQuadruple] = field(default_factory=set[FaceQuadruple])
    """Ascending faces on which a grasp was found, whether it was kept or not."""
    gathered: Gathered = field(default_factory=Gathered)
    unreached: dict[FaceQuadruple, str] = field(default_factory=dict[FaceQuadruple, str])
    seconds: float = 0.0

    @property
    def counts(self) -> MethodCounts:
        """Return the counts so far, with the quadruples that are still undecided."""
        counts = self.gathered.tally.counts
        return replace(counts, undecided=counts.undecided + len(self.gathered.undecided))

    @property
    def full(self) -> bool:
        """Return whether `limit` grasps are kept, so that another one would replace one."""
        return self.limit is not None and len(self.best) == self.limit

    def least(self, construction: Construction) -> float:
        """Return the merit (disc radius) that a grasp must exceed to enter the best ones."""
        if self.full and (construction.limits is None or not self.best):
            return math.inf
        worst = self.best[-1].placement.merit if self.full else -math.inf
        return max(worst * (1.0 + SAME_MERIT), construction.least)

    def may_gain(self, construction: Construction, room: float) -> bool:
        """Return whether a grasp with discs of radius `room` could enter the best ones."""
        return room > self.least(construction)

    def take(self, gathered: Gathered, seconds: float) -> None:
        """Add the proofs and counts of a part, and the time that another process took [s]."""
        self.gathered.add(gathered)
        self.seconds += seconds

    def keep_each(self, found: Sequence[Certified]) -> list[Certified]:
        """Keep grasps on one quadruple; return the ones that fingers reach."""
        return [one for each in found for one in self.keep(each)]

    def keep(self, found: Certified) -> list[Certified]:
        """Count a grasp and keep it if fingers reach it; return it in a list, or an empty list."""
        faces = four(sorted(found.faces))
        way = self.reach(found)
        if way.reason:
            self.gathered.tally.count("unreachable")
            self.unreached[faces] = way.reason
            return []
        if found.method != self.method or way.directions is not None:
            found = replace(found, method=self.method, ways_out=way.directions)
        self.gathered.tally.count("found")
        self.held.add(faces)
        key = best_first(found)
        place = bisect(self._keys, key)
        self._keys.insert(place, key)
        self.best.insert(place, found)
        if self.limit is not None:
            del self.best[self.limit :], self._keys[self.limit :]
        return [found]


def best_first(found: Certified) -> SortKey:
    """Return a sort key: largest merit first, equal merits by faces, then by finger order."""
    return -graded(found.placement.merit), four(sorted(found.faces)), found.faces


def search_construction(
    construction: Construction,
    shapes: Shapes,
    friction: float,
    blocks: Blocks,
    search: MethodSearch,
) -> Iterator[list[Certified]]:
    """Try a construction on blocks of quadruples; yield the grasps kept from each quadruple.

    With a limit the search ends when no upper bound exceeds the worst grasp kept. A construction
    without bounds ends as soon as the limit is reached.
    """
    places = range(len(blocks[0]))
    for found in found_in(construction, shapes, friction, blocks, places, search):
        yield search.keep_each(found)


def found_in(
    construction: Construction,
    shapes: Shapes,
    friction: float,
    blocks: Blocks,
    places: range,
    search: MethodSearch,
) -> Iterator[list[Certified]]:
    """Try a construction on some of the blocks; yield the grasps found on each quadruple.

    Whoever keeps them in `search` does so before asking for the next: that raises the threshold.
    """
    tries, tally = Tries(construction, shapes, friction), search.gathered.tally
    quadruples = _in_order(construction, AttemptBounds(shapes), blocks, places, search)
    while group := _next_few(quadruples, search):
        # grasps kept meanwhile may have raised the threshold
        worth = [
            [each for each in attempts if search.may_gain(construction, each.bounds[0])]
            for attempts in group
        ]
        every = list(chain.from_iterable(worth))
        found = iter(tries.certified(every, search.least(construction), tally))
        for attempts in worth:
            here = [one for one in islice(found, len(attempts)) if one is not None]
            kept = _without_duplicates(here)
            tally.count("duplicates", len(here) - len(kept))
            yield kept


def _next_few(
    quadruples: Iterator[tuple[Attempt, ...]], search: MethodSearch
) -> list[tuple[Attempt, ...]]:
    """Take the next quadruples, as many as cannot raise the threshold before the last of them."""
    left = MOST_ATTEMPTS
    if search.limit is not None:
        left = min(left, search.limit - len(search.best))
    group: list[tuple[Attempt, ...]] = []
    for attempts in quadruples:
        group.append(attempts)
        left -= len(attempts)
        if left <= 0:
            break
    return group


def _in_order(
    construction: Construction,
    bounded: AttemptBounds,
    blocks: Blocks,
    places: range,
    search: MethodSearch,
) -> Iterator[tuple[Attempt, ...]]:
    """Yield the attempts on each quadruple: over many blocks with a limit, else block by block."""
    best_first = BestFirst(construction, bounded, search.gathered.tally)
    rooms, make = blocks
    if construction.limits is not None:
        size = 1 if search.limit is None else TOGETHER
        for start in range(0, len(places), size):
            some = places[start : start + size]
            if search.may_gain(construction, float(rooms[some].max())):
                yield from best_first.over(blocks, some, search.least)
        return
    for place in places:
        if search.full:
            return
        wide, _ = make(place).ranked(construction, construction.least)
        some = best_first.in_rows(wide, construction.least)
        yield from takewhile(lambda _: not search.full, some)


@dataclass(frozen=True, eq=False)
class Tries:
    """Tries one construction on many quadruples of faces together."""

    construction: Construction
    shapes: Shapes
    friction: float
    """Coulomb coefficient at every contact."""

    def certified(
        self, attempts: Sequence[Attempt], least: float, tally: Tally
    ) -> list[Certified | None]:
        """Construct and certify a grasp for each attempt; None where there is none."""
        ends = self._settling.of(attempts, least)
        tally.count("tried", len(attempts))
        tally.count("solved", sum(end.solved for end in ends))
        tally.count("undecided", sum(end.failed for end in ends))
        tally.count("infeasible", sum(not (end.settled or end.failed) for end in ends))
        family = self.construction.family
        candidates = [
            Candidate(named(family[0], attempt.faces), attempt.faces, family, *end.settled)
            for attempt, end in zip(attempts, ends, strict=True)
            if end.settled is not None
        ]
        certified = iter(self._spanning(certify_each(candidates, self.friction), candidates))
        found = [None if end.settled is None else next(certified) for end in ends]
        tally.count("rejected", len(candidates) - sum(one is not None for one in found))
        return found

    @cached_property
    def _settling(self) -> Settling:
        return Settling(self.construction, self.shapes)

    @staticmethod
    def _spanning(
        certified: Sequence[Certified | None], candidates: Sequence[Candidate]
    ) -> list[Certified | None]:
        """Replace grasps whose force cones do not positively span by None."""
        if not candidates:
            return []
        axes = np.array([[cone.axis for cone in each.cones] for each in candidates])
        angles = np.array([[cone.half_angle for cone in each.cones] for each in candidates])
        spans = each_cones_positively_span(axes, angles).tolist()
        return [one if span else None for one, span in zip(certified, spans, strict=True)]


def _without_duplicates(found: list[Certified]) -> list[Certified]:
    """Drop each grasp whose contacts are those of a better one; all are on the same faces."""
    if len(found) < 2:  # noqa: PLR2004 - nothing to compare
        return found
    kept: list[Certified] = []
    for one in sorted(found, key=best_first):
        here = one.placement.positions[np.argsort(one.faces)]
        if all(
            np.abs(here - other.placement.positions[np.argsort(other.faces)]).max() >= SAME_CONTACTS
            for other in kept
        ):
            kept.append(one)
    return kept
