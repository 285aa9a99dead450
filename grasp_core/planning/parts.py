"""Searches an object part by part, for all its grasps also in other processes.

A search for all grasps has no threshold that one part could raise for another. Its parts are the
blocks of quadruples of each construction, the batches of the free method, and what `complete` adds.
They are the same for any number of processes.
"""

import math
import pickle
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import chain, combinations, islice, tee
from typing import TypeAlias

from grasp_core.families.placing import CONSTRUCTIONS, chosen_shapes
from grasp_core.kinds import Family
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import Standard, clear_of_edges, standard, with_halves
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import Gathered, MethodSearch, found_in
from grasp_core.planning.free_search import found_on
from grasp_core.planning.planned_cones import PlannedCones
from grasp_core.planning.quadruples import Blocks, all_blocks, kept, spanning_blocks
from grasp_core.planning.reach import Reach
from grasp_core.planning.request import PlanRequest
from grasp_core.processes import local_processes
from grasp_core.values import FINGERS, FaceQuadruple, four

BATCH, LIMITED_BATCH = 1024, 64
"""Number of face quadruples that are decided together, and with a limit on the grasps."""
QUADRUPLES_PER_PROCESS = 5_000
"""Number of face quadruples for which one more process is worth starting: the start takes a second,
and so do a thousand to two thousand quadruples."""
KEPT_BLOCKS = 8
"""Number of blocks of face quadruples kept for all families: some hundred megabytes."""


@dataclass(frozen=True, slots=True)
class Block:
    """One block of quadruples, to be searched with one construction."""

    family: Family
    place: int


@dataclass(frozen=True, slots=True)
class Batch:
    """Quadruples to be decided together by the free method, or again with more parts."""

    quadruples: tuple[FaceQuadruple, ...]
    again: bool = False


Part: TypeAlias = Block | Batch


@dataclass(slots=True, eq=False)
class Found:
    """What a part of a search holds."""

    gathered: Gathered  # proofs and counts, complete once all grasps were taken
    grasps: Iterable[list[Certified]]
    """Grasps on each quadruple, those that were not tried left out; for `Batch` in its order."""
    seconds: float = 0.0
    """Processor time of another process [s]; zero for parts found in this process."""


Elsewhere: TypeAlias = Callable[[Iterable[Part], Callable[[Part], Found]], Iterator[Found]]
"""Yields what parts hold, found by other processes and by a function of this one."""


@dataclass(frozen=True, eq=False)
class Object:
    """An object as the planner works on it, with what is asked for, and its blocks."""

    on: Standard
    request: PlanRequest
    elsewhere: Elsewhere | None = None

    def each_found(self, parts: Iterable[Part]) -> Iterator[Found]:
        """Yield what each part holds, in order."""
        if self.elsewhere is None:
            return map(self.found, parts)
        return self.elsewhere(parts, self.found_at_once)

    def found(self, part: Part) -> Found:
        """Search one part; it is gone through while its grasps are taken."""
        gathered = Gathered()
        return Found(gathered, self._steps(part, gathered))

    def found_at_once(self, part: Part) -> Found:
        """Search one part and take all its grasps."""
        found = self.found(part)
        return Found(found.gathered, list(found.grasps))

    def _steps(self, part: Part, gathered: Gathered) -> Iterator[list[Certified]]:
        match part:
            case Block(family, place):
                construction, places = CONSTRUCTIONS[family], range(place, place + 1)
                # with no limit, no grasp raises the threshold: nothing is kept here
                search = MethodSearch(family, None, _unasked, gathered=gathered)
                yield from found_in(
                    construction, self.on.shapes, self.request.friction, self.blocks(family),
                    places, search,
                )  # fmt: skip
            case Batch(quadruples, again):
                for found in found_on(self.on, quadruples, self.request, gathered, again=again):
                    yield [found] if found else []

    def blocks(self, family: Family) -> Blocks:
        """Return the blocks for a construction; without bounds it uses cones around normals."""
        around_normals, every = self._blocks
        return around_normals if CONSTRUCTIONS[family].limits is None else every

    @cached_property
    def _blocks(self) -> tuple[Blocks, Blocks]:
        """Blocks with cones around the normals, and blocks with all cones that may be used."""
        on, request = self.on, self.request
        whole = len(on.faces)
        cones = PlannedCones(on.body, on.shapes, request.theta, tilted=False)
        around_normals = kept(spanning_blocks(cones, whole), KEPT_BLOCKS)
        if request.cones == "normal":
            return around_normals, around_normals
        cones = replace(cones, tilted=True)
        return around_normals, kept(all_blocks(cones, whole, on.shared), KEPT_BLOCKS)


def _unasked(_: Certified) -> Reach:
    raise AssertionError("parts of a search keep no grasps")


def in_standard_order(body: Polyhedron, request: PlanRequest) -> Standard:
    """Put an object into standard order, with faces cut as requested."""
    on = standard(body)
    if request.edge_clearance_m:
        on = replace(on, body=clear_of_edges(on.body, request.edge_clearance_m))
    if request.share_faces_m is not None:
        halved, owners = with_halves(on.body, request.share_faces_m)
        on = replace(on, body=halved, owners=owners)
    return on


def found_elsewhere(given: bytes, part: Part) -> Found:
    """Search one part to its end in another process, which tells its time.

    Takes `given`, the pickled object and request, which are the same for all parts.
    """
    begun, found = time.process_time(), _object_of(given).found_at_once(part)
    return replace(found, seconds=time.process_time() - begun)


@lru_cache(maxsize=1)
def _object_of(given: bytes) -> Object:
    body, request = pickle.loads(given)  # noqa: S301 - the process that started this one packed it
    return Object(in_standard_order(body, request), request)


def worth_starting(body: Polyhedron, request: PlanRequest, jobs: int) -> int:
    """Return how many processes are worth starting beside this one.

    A search with a limit needs the grasps of each block before the next, so it has one process.
    """
    if jobs < 2 or request.searched is not None:  # noqa: PLR2004 - nobody beside this one
        return 0
    worth = math.comb(len(body.faces), FINGERS) // QUADRUPLES_PER_PROCESS
    return min(jobs - 1, worth)


@contextmanager
def finding_elsewhere(
    body: Polyhedron, request: PlanRequest, jobs: int
) -> Generator[Elsewhere | None]:
    """Have other processes search parts of an object during a `with` block, if that is worth it."""
    count = worth_starting(body, request, jobs)
    if count == 0:
        yield None
        return
    find = partial(found_elsewhere, pickle.dumps((body, request)))
    with local_processes(count) as workers:
        yield lambda parts, here: workers.in_order(find, parts, here=here)


def search_family(work: Object, family: Family, search: MethodSearch) -> Iterator[list[Certified]]:
    """Search all blocks until no upper bound exceeds the worst grasp kept; yield those kept.

    A construction without bounds ends as soon as the limit is reached.
    """
    blocks = work.blocks(family)
    for found in found_in(
        CONSTRUCTIONS[family], work.on.shapes, work.request.friction, blocks,
        range(len(blocks[0])), search,
    ):  # fmt: skip
        yield search.keep_each(found)


def search_blocks(found: Iterable[Found], search: MethodSearch) -> Iterator[list[Certified]]:
    """Keep the grasps that parts hold; yield those of each quadruple."""
    for each in found:
        for grasps in each.grasps:
            yield search.keep_each(grasps)
        search.take(each.gathered, each.seconds)


def search_batches(
    work: Object, search: MethodSearch, held: AbstractSet[FaceQuadruple]
) -> Iterator[list[Certified]]:
    """Go through the quadruples that no family holds, until the limit; yield the grasps on each."""
    size = BATCH if search.limit is None else LIMITED_BATCH
    split = ((batch, without_grasp(work.on, batch, held)) for batch in batches(work.on, size))
    every, ahead = tee(split)
    parts = (Batch(to_try) for _, to_try in ahead)
    for (batch, to_try), each in zip(every, work.each_found(parts), strict=True):
        if search.full:
            return
        tried, grasps = set(to_try), iter(each.grasps)
        for faces in batch:
            yield search.keep_each(next(grasps)) if faces in tried else []
        next(grasps, None)  # runs the search to its end, where its counts are complete
        search.take(each.gathered, each.seconds)


def search_undecided(work: Object, search: MethodSearch) -> Iterator[list[Certified]]:
    """Go once more, with more parts, through the quadruples that were left undecided."""
    open_yet = tuple(search.gathered.undecided)
    found = work.each_found(Batch((faces,), again=True) for faces in open_yet)
    for faces, each in zip(open_yet, found, strict=True):
        del search.gathered.undecided[faces]
        yield from search_blocks([each], search)


def batches(on: Standard, size: int) -> Iterator[Sequence[FaceQuadruple]]:
    """Yield all quadruples of faces in batches; the ones with two halves of a face come last."""
    whole = combinations(range(len(on.faces)), FINGERS)
    quadruples = chain(whole, map(four, on.shared.tolist()))
    while batch := list(islice(quadruples, size)):
        yield batch


def without_grasp(
    on: Standard, batch: Sequence[FaceQuadruple], held: AbstractSet[FaceQuadruple]
) -> tuple[FaceQuadruple, ...]:
    """Select the quadruples on which no grasp was found and whose faces have room for contacts."""
    return tuple(
        faces
        for faces in batch
        if faces not in held and len(chosen_shapes(on.shapes, faces)) == FINGERS
    )
