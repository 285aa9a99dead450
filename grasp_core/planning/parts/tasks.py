"""Names parts of a search that do not depend on one another, and searches one of them.

A search for all grasps has no threshold that one part could raise for another. Its parts are the
blocks of quadruples of each construction, the batches of the free method, and what `complete` adds.
They are the same for any number of processes.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

from grasp_core.families.constructions import CONSTRUCTIONS
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import Standard, clear_of_edges, standard, with_halves
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import Gathered, MethodSearch, found_in
from grasp_core.planning.free_search import found_on, found_with_more_parts
from grasp_core.planning.planned_cones import PlannedCones
from grasp_core.planning.quadruples import Blocks, all_blocks, kept, spanning_blocks
from grasp_core.planning.reach import Reach
from grasp_core.planning.request import PlanRequest
from grasp_core.values import FaceQuadruple, Family

KEPT_BLOCKS = 8
"""Number of blocks of face quadruples kept for all families: some hundred megabytes."""


@dataclass(frozen=True, slots=True)
class Block:
    """One block of quadruples, to be searched with one construction."""

    family: Family
    place: int


@dataclass(frozen=True, slots=True)
class Batch:
    """Quadruples to be decided together by the free method."""

    quadruples: tuple[FaceQuadruple, ...]


@dataclass(frozen=True, slots=True)
class Completion:
    """A quadruple to be decided once more by the free method, with more parts."""

    faces: FaceQuadruple


Part: TypeAlias = Block | Batch | Completion


@dataclass(slots=True, eq=False)
class Found:
    """What a part of a search holds."""

    gathered: Gathered
    """Proofs and counts, complete once all grasps were taken."""
    grasps: Iterable[list[Certified]]
    """Grasps on each quadruple, those that were not tried left out; for `Batch` in its order."""
    seconds: float = 0.0
    """Processor time of another process [s]; zero for parts found in this process."""


@dataclass(frozen=True, eq=False)
class Object:
    """An object as the planner works on it, with what is asked for, and its blocks."""

    on: Standard
    request: PlanRequest

    def found(self, part: Part) -> Found:
        """Search one part; it is gone through while its grasps are taken."""
        gathered = Gathered()
        return Found(gathered, self._steps(part, gathered))

    def found_at_once(self, part: Part) -> Found:
        """Search one part and take all its grasps."""
        found = self.found(part)
        return Found(found.gathered, list(found.grasps))

    def found_elsewhere(self, part: Part) -> Found:
        """Search one part and take all its grasps, in a process that tells its time."""
        begun, found = time.process_time(), self.found_at_once(part)
        return replace(found, seconds=time.process_time() - begun)

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
            case Batch(quadruples):
                for found in found_on(self.on, quadruples, self.request, gathered):
                    yield [found] if found else []
            case Completion(faces):
                found = found_with_more_parts(self.on, faces, self.request, gathered)
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
    if request.clearance:
        on = replace(on, body=clear_of_edges(on.body, request.clearance))
    if request.share_faces is not None:
        halved, owners = with_halves(on.body, request.share_faces)
        on = replace(on, body=halved, owners=owners)
    return on


def finder(body: Polyhedron, request: PlanRequest) -> Callable[[Part], Found]:
    """Return a function that searches one part of an object to its end, for another process."""
    return Object(in_standard_order(body, request), request).found_elsewhere
