"""Searches an object for all its grasps, part by part, in this process and in others."""

import math
from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from itertools import tee

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import MethodSearch
from grasp_core.planning.parts.batches import BATCH, batches, kept_on, without_grasp
from grasp_core.planning.parts.tasks import Batch, Block, Completion, Found, Object, Part
from grasp_core.planning.request import PlanRequest
from grasp_core.processes.workers import Workers
from grasp_core.values import FINGERS, FaceQuadruple, Family

QUADRUPLES_PER_PROCESS = 5_000
"""Number of face quadruples for which one more process is worth starting: the start takes a second,
and so do a thousand to two thousand quadruples."""


def worth_starting(body: Polyhedron, request: PlanRequest, jobs: int) -> int:
    """Return how many processes are worth starting beside this one.

    A search with a limit needs the grasps of each block before the next, so it has one process.
    """
    if jobs < 2 or request.searched is not None:  # noqa: PLR2004 - nobody beside this one
        return 0
    worth = math.comb(len(body.faces), FINGERS) // QUADRUPLES_PER_PROCESS
    return min(jobs - 1, worth)


def each_found(work: Object, parts: Iterable[Part], workers: Workers | None) -> Iterator[Found]:
    """Yield what each part holds, in order."""
    if workers is None:
        return map(work.found, parts)
    return workers.in_order(parts, work.found_at_once)


def blocks_of(work: Object, family: Family) -> list[Block]:
    """List the parts of the search with one construction."""
    return [Block(family, place) for place in range(len(work.blocks(family)[0]))]


def search_blocks(found: Iterator[Found], search: MethodSearch) -> Iterator[list[Certified]]:
    """Keep the grasps that blocks hold; yield those of each quadruple."""
    for each in found:
        for grasps in each.grasps:
            yield search.keep_each(grasps)
        search.take(each.gathered, each.seconds)


def search_batches(
    work: Object, search: MethodSearch, held: AbstractSet[FaceQuadruple], workers: Workers | None
) -> Iterator[list[Certified]]:
    """Go through the quadruples that no family holds; yield the grasps kept on each."""
    split = ((batch, without_grasp(work.on, batch, held)) for batch in batches(work.on, BATCH))
    every, ahead = tee(split)
    parts = (Batch(to_try) for _, to_try in ahead)
    for (batch, to_try), each in zip(every, each_found(work, parts, workers), strict=True):
        yield from kept_on(batch, to_try, each.grasps, search)
        search.take(each.gathered, each.seconds)


def search_undecided(
    work: Object, search: MethodSearch, workers: Workers | None
) -> Iterator[list[Certified]]:
    """Go once more, with more parts, through the quadruples that were left undecided."""
    open_yet = tuple(search.gathered.undecided)
    for faces, each in zip(
        open_yet, each_found(work, map(Completion, open_yet), workers), strict=True
    ):
        del search.gathered.undecided[faces]
        for grasps in each.grasps:
            yield search.keep_each(grasps)
        search.take(each.gathered, each.seconds)
