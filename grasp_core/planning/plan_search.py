"""Runs the methods that are asked for on one object, part by part, also in other processes.

A search for all grasps has no threshold that one part could raise for another. Its parts are the
blocks of quadruples of each construction, the batches of the free method, and what `complete` adds.
They are the same for any number of processes. With a limit, each grasp that is kept raises the
threshold: then a construction searches all its blocks in one part, and no other process helps.
At the end it is selected which of the grasps found are returned, in which order.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain, combinations, islice, repeat, zip_longest
from typing import TypeAlias, TypeVar

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.errors import NoForcesError
from grasp_core.execution.best_squeeze import SQUEEZE_GAP, searched
from grasp_core.execution.grips import STIFFNESS_N_PER_M, Grip, springs
from grasp_core.execution.loads import any_direction
from grasp_core.families.placing import CONSTRUCTIONS, chosen_shapes
from grasp_core.names import METHODS, Family, Method
from grasp_core.objects.face_pieces import clear_of_edges, with_halves
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import Standard, standard
from grasp_core.planning.certify import Certified, LateFigures, to_grasp
from grasp_core.planning.method_search import FamilySearch, Gathered, MethodSearch, found_on
from grasp_core.planning.quadruples import Blocks, PlannedCones, all_blocks, kept, spanning_blocks
from grasp_core.planning.reach import Finger, reach
from grasp_core.planning.result import FAMILIES, Ended, Outcomes, PlanRequest
from grasp_core.processes import Processes
from grasp_core.small_objects import fitted
from grasp_core.solvers.ties import SAME_SHARE, first_best, ranks
from grasp_core.stopping import Stop, until
from grasp_core.time_spent import TIME_SPENT
from grasp_core.values import FINGERS, FaceQuadruple, four

Item = TypeVar("Item")
PlanProgress: TypeAlias = Callable[[int, int, int], None]
"""Called with (quadruples finished, all quadruples, grasps so far) after each quadruple tried."""
BATCH, LIMITED_BATCH = 1024, 64
"""Number of face quadruples that are decided together, and with a limit on the grasps."""
QUADRUPLES_PER_PROCESS = 5_000
"""Number of face quadruples that take a few times as long as the start of a process, a second."""
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


SearchPart: TypeAlias = Block | Batch


@dataclass(slots=True, eq=False)
class PartFound:
    """What a part of a search holds."""

    gathered: Gathered  # proofs and counts, complete once all grasps were taken
    grasps: Iterable[list[Certified]]  # grasps on each quadruple that was tried
    seconds: float = 0.0
    """Processor time of another process [s]; zero for parts found in this process."""


@dataclass(eq=False)
class PlanSearch:
    """The search for grasps of one object: what is asked for, and what each method has found."""

    body: Polyhedron  # the object as it was given
    on: Standard  # the object as the planner works on it
    request: PlanRequest
    methods: dict[Method, MethodSearch]
    """The search of each method that is asked for; the free method comes last."""
    workers: Processes | None = None
    """Other processes that search parts; None where this one is alone."""
    stop: Stop = field(default_factory=Stop)
    """Whether to end the search with what was found by then."""
    ended: Ended = "done"
    unranked: Counter[str] = field(default_factory=Counter[str])
    """Numbers of grasps without a figure to rank by, by the reason."""

    @classmethod
    def of(
        cls, body: Polyhedron, request: PlanRequest, workers: Processes | None = None,
        stop: Stop | None = None,
    ) -> "PlanSearch":  # fmt: skip
        """Put an object into standard order, with faces cut as requested, and set up its search."""
        on = in_standard_order(body, request)
        reached = partial(_reached, on.body, request.finger)
        methods: dict[Method, MethodSearch] = {
            method: MethodSearch(method, request.searched, reached)
            for method in METHODS
            if method in request.families
        }
        return cls(body, on, request, methods, workers, Stop() if stop is None else stop)

    def run(self, progress: PlanProgress | None = None) -> Iterator[Certified]:
        """Yield each certified grasp in the order of the methods, on the standard object."""
        total, found, done = len(self.methods) * self.on.quadruples, 0, 0
        for done, grasps in self._steps():
            found += len(grasps)
            if progress is not None:
                progress(done, total, found)
            yield from grasps
        if progress is not None:
            progress(done if self.stop() else total, total, found)

    def _steps(self) -> Iterator[tuple[int, list[Certified]]]:
        """Yield, for each quadruple tried, how many are finished at least, and its grasps."""
        limit, dealt_with, kept_so_far = self.request.searched, 0, list[int]()
        families: list[Family] = [method for method in self.methods if method != "free"]
        sizes = {family: self.blocks(family).sizes for family in families}
        blocks = (
            Block(family, place) for family in families for place in range(len(sizes[family]))
        )
        every = self.each_found(blocks) if limit is None else iter(())
        for method, search in self.methods.items():
            if limit is not None:
                left = max(limit - sum(kept_so_far), 0)
                search.limit = left if method == "free" else _share(limit, kept_so_far)
            if method == "free":
                size = BATCH if limit is None else LIMITED_BATCH
                found = zip(repeat(size), self.each_found(self._batches(size, self.held)))
            elif limit is None:
                found = zip(sizes[method], every, strict=False)
            else:
                steps = self._constructed(method, range(len(sizes[method])), search)
                found = iter([(self.on.quadruples, PartFound(Gathered(), steps))])
            for done, grasps in self._taken(found, search):
                yield dealt_with + min(done, self.on.quadruples), grasps
            if self.stop():
                return
            # each quadruple counts once per order of the fingers
            orders = 1 if method == "free" else len(CONSTRUCTIONS[method].orders)
            tally = search.gathered.tally
            tally["pruned"] = self.on.quadruples * orders - tally["tried"]
            kept_so_far.append(len(search.best))
            dealt_with += self.on.quadruples
        if self.request.complete:
            yield from ((dealt_with, grasps) for grasps in self._completed())

    def _completed(self) -> Iterator[list[Certified]]:
        """Decide the quadruples that are undecided, and yield the grasps on each."""
        search = self.methods["free"]
        undecided = search.gathered.undecided
        open_yet = dict(undecided)
        undecided.clear()
        found = self.each_found(Batch((faces,), again=True) for faces in open_yet)
        for _, grasps in self._taken(zip(repeat(0), found), search):
            yield grasps
        if self.stop():  # those that were not looked at again
            known = {*search.held, *search.gathered.absences, *undecided}
            undecided.update({faces: open_yet[faces] for faces in open_yet if faces not in known})

    def _taken(
        self, found: Iterable[tuple[int, PartFound]], search: MethodSearch
    ) -> Iterator[tuple[int, list[Certified]]]:
        """Keep the grasps that parts hold, each given with its size, until limit or stop.

        Yields how many quadruples are finished at least and the grasps kept; adds up the time.
        """
        start, done = time.process_time(), 0
        for size, each in found:
            if search.full or self.stop():
                break
            for tried, grasps in enumerate(each.grasps, 1):
                kept = search.keep_each(grasps)
                search.seconds += time.process_time() - start
                yield done + min(tried, size), kept
                start = time.process_time()
            search.take(each.gathered, each.seconds)
            done += size
            yield done, []  # also where bounds leave nothing to try
        search.seconds += time.process_time() - start

    def each_found(self, parts: Iterable[SearchPart]) -> Iterator[PartFound]:
        """Yield what each part holds, in order."""
        if self.workers is None:
            return map(self.found, parts)
        return self.workers.in_order(
            self.found_elsewhere, parts, here=self.found_at_once, stop=self.stop
        )

    def __reduce__(self) -> tuple[Callable[..., "PlanSearch"], tuple[Polyhedron, PlanRequest]]:
        """Have another process set up the search anew."""
        return PlanSearch.of, (self.body, self.request)

    @TIME_SPENT.on("planning")
    def found_elsewhere(self, part: SearchPart) -> PartFound:
        """Search one part to its end in another process, which tells its time."""
        begun, found = time.process_time(), self.found_at_once(part)
        return replace(found, seconds=time.process_time() - begun)

    def found(self, part: SearchPart) -> PartFound:
        """Search one part; it is gone through while its grasps are taken."""
        gathered = Gathered()
        if isinstance(part, Block):
            # with no limit, no grasp raises the threshold: nothing is kept here
            search = MethodSearch(part.family, gathered=gathered)
            places = range(part.place, part.place + 1)
            return PartFound(gathered, self._constructed(part.family, places, search))
        tried = found_on(self.on, part.quadruples, self.request, gathered, part.again, self.stop)
        return PartFound(gathered, ([one] if one else [] for one in tried))

    def found_at_once(self, part: SearchPart) -> PartFound:
        """Search one part and take all its grasps."""
        found = self.found(part)
        return PartFound(found.gathered, list(found.grasps))

    def _constructed(
        self, family: Family, places: range, search: MethodSearch
    ) -> Iterator[list[Certified]]:
        """Yield the grasps of a construction on each quadruple of some blocks, worth keeping."""
        shapes, friction = self.on.shapes, self.request.friction
        over = FamilySearch(CONSTRUCTIONS[family], shapes, friction, search, self.stop)
        return over.found_in(self.blocks(family), places)

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

    def _batches(self, size: int, held: AbstractSet[FaceQuadruple]) -> Iterator[Batch]:
        """Yield quadruples with room that hold no grasp yet, in batches; halves come last."""
        shapes = self.on.shapes
        whole = combinations(range(len(self.on.faces)), FINGERS)
        quadruples = chain(whole, map(four, self.on.shared.tolist()))
        while batch := list(islice(quadruples, size)):
            yield Batch(tuple(
                faces for faces in batch
                if faces not in held and len(chosen_shapes(shapes, faces)) == FINGERS
            ))  # fmt: skip

    @property
    def held(self) -> set[FaceQuadruple]:
        """Quadruples on which a grasp was found."""
        return set[FaceQuadruple]().union(*(search.held for search in self.methods.values()))

    @property
    def absent(self) -> set[FaceQuadruple]:
        """Quadruples that are proved to hold no grasp."""
        every = self.methods.values()
        return set[FaceQuadruple]().union(*(search.gathered.absences for search in every))

    @property
    def unreached(self) -> dict[FaceQuadruple, str]:
        """Quadruples with contacts, none of which fingers reach, and why not the last ones."""
        known = self.held | self.absent
        return {
            faces: why
            for search in self.methods.values()
            for faces, why in search.unreached.items()
            if faces not in known
        }

    @property
    def outcomes(self) -> Outcomes:
        """Counts of how the quadruples ended: held, absent, open or out of reach."""
        held, out_of_reach = len(self.held), len(self.unreached)
        # patches leave parts of the surface out, so a patch without room proves nothing
        absent = len(self.absent) + (0 if self.on.body.patches else _without_room(self.on))
        undecided = self.on.quadruples - held - absent - out_of_reach
        return Outcomes(held, absent, undecided, out_of_reach)


def in_standard_order(body: Polyhedron, request: PlanRequest) -> Standard:
    """Put an object into standard order, with faces cut as requested."""
    on = standard(body)
    if request.edge_clearance_m:
        on = replace(on, body=clear_of_edges(on.body, request.edge_clearance_m))
    if request.share_faces_m is not None:
        halved, owners = with_halves(on.body, request.share_faces_m)
        on = replace(on, body=halved, owners=owners)
    return on


def _reached(body: Polyhedron, finger: Finger | None, found: Certified) -> Certified | str:
    """Return a grasp with its fingers' ways out, if they are sought, or why it is out of reach."""
    if finger is None:
        return found
    positions = body.center_of_mass + body.radius * found.placement.positions
    ways = reach(body, found.faces, positions, found.normals, finger)
    return ways if isinstance(ways, str) else replace(found, ways_out=ways)


def worth_starting(body: Polyhedron, request: PlanRequest, jobs: int) -> int:
    """Return how many more processes are worth starting; none with a limit, which needs order."""
    if jobs < 2 or request.searched is not None:  # noqa: PLR2004 - nobody beside this one
        return 0
    worth = math.comb(len(body.faces), FINGERS) // QUADRUPLES_PER_PROCESS
    return min(jobs - 1, worth)


def _share(limit: int, before: Sequence[int]) -> int:
    """Most grasps that a construction can keep, given how many the constructions before it found.

    Families take turns. If all earlier ones but k run out, with n_1, n_2, .. grasps, this one
    gets at most every (k + 1)-th grasp of what they leave.
    """
    found = sorted(before)
    left = [limit - sum(found[:short]) for short in range(len(found) + 1)]
    return max(each // (len(found) - short + 1) for short, each in enumerate(left))


def _without_room(on: Standard) -> int:
    """Number of quadruples with a face that has no room for a contact."""
    whole = len(on.faces)
    roomy = sum(shape is not None for shape in on.shapes[:whole])
    shared = sum(any(on.shapes[face] is None for face in faces) for faces in on.shared.tolist())
    return math.comb(whole, FINGERS) - math.comb(roomy, FINGERS) + shared


PAYLOAD_PUSH_N = 10.0
"""Largest push of a finger under which payloads are compared [N]; less for small objects."""
TIP_RADIUS = 0.1
"""Radius of fingertips whose size is not given, in object radii: that of scenes."""


def chosen(
    search: PlanSearch, stop: Stop, progress: Callable[[int, int], None] | None = None
) -> list[Certified]:
    """Select the grasps to return, the best first; by radius, families take turns.

    Where there is no time to rank a grasp by what is asked for, it comes after those that are
    ranked. `progress` is called with (ranked, to be ranked).
    """
    request = search.request
    every = _largest_first(chain.from_iterable(each.best for each in search.methods.values()))
    if request.rank_by == "radius":
        families = [[one for one in every if one.family == family] for family in FAMILIES]
        turns = [one for one in chain.from_iterable(zip_longest(*families)) if one is not None]
        return _largest_first(turns[: request.limit])
    if request.rank_by == "diverse":
        wanted = min(len(every), request.limit or len(every))
        order = list(_told(until(stop, islice(_far_apart(every), wanted)), wanted, progress))
        order += sorted(set(range(len(every))) - set(order))
        best = [every[place] for place in order[:wanted]]
    else:
        measure, same = _measure(search)
        figures = list(_told(map(measure, until(stop, every)), len(every), progress))
        ranked = _in_order(every[: len(figures)], figures, same)
        best = [*ranked, *every[len(figures) :]][: request.limit]
    if search.ended == "done" and stop():
        search.ended = stop.why
    return best


def _told(
    items: Iterable[Item], total: int, progress: Callable[[int, int], None] | None
) -> Iterator[Item]:
    """Yield items, and tell how many of all are done."""
    for done, item in enumerate(items, 1):
        yield item
        if progress is not None:
            progress(done, total)


def _measure(search: PlanSearch) -> tuple[Callable[[Certified], float], float]:
    """Return what makes grasps better the smaller it is, and the share of it that is none."""
    body, request = search.body, search.request
    if request.rank_by == "friction-margin":
        return lambda found: critical_friction(found.placement.positions, found.normals), SAME_SHARE
    if request.rank_by == "ferrari-canny":

        def quality(found: Certified) -> float:
            positions, normals = found.placement.positions, found.normals
            return -LateFigures(positions, normals, request.friction).ferrari_canny()[0]

        return quality, SAME_SHARE

    if request.rank_by == "placement":
        # slow to import, and other rankings have no use for it
        from grasp_core.regions.certify_placement import usual_bound

        def risk(found: Certified) -> float:
            grasp = to_grasp(body, request.friction, found, search.on)
            bounded = usual_bound(body, grasp, request.friction)
            if isinstance(bounded, str):
                search.unranked[bounded] += 1
                return math.inf
            return 1.0 - bounded.lower

        return risk, SAME_SHARE

    def lightness(found: Certified) -> float:
        points = body.radius * found.placement.positions
        return -carried(body, points, found.normals, request.friction, request.finger)

    # the best squeeze is searched to a gap, so equal grasps may come out as far apart
    return lightness, 2.0 * SQUEEZE_GAP


def carried(
    body: Polyhedron, points: Array, normals: Array, friction: float, finger: Finger | None
) -> float:
    """Return the mass that the best squeeze of points proves to hold, or 0 [kg]."""
    count, tip = len(points), TIP_RADIUS * body.radius if finger is None else finger.radius_m
    start = Grip(
        points, normals, np.full(count, friction), np.zeros((count, 3)),
        springs(fitted(STIFFNESS_N_PER_M, body.radius), count), np.full(count, tip),
    )  # fmt: skip
    try:
        return searched(start, any_direction(1.0), fitted(PAYLOAD_PUSH_N, body.radius, 2)).scale
    except NoForcesError:
        return 0.0


def _largest_first(found: Iterable[Certified]) -> list[Certified]:
    """Order grasps by their smallest discs, the largest first; those without discs come last."""
    listed = list(found)
    # the merit of a grasp with discs is that radius, as reproducible as a program's optimum
    return _in_order(
        listed, [-one.placement.merit if one.placement.radii.min() > 0.0 else 0.0 for one in listed]
    )


def _in_order(
    found: Sequence[Certified], figures: Sequence[float], same: float = SAME_SHARE
) -> list[Certified]:
    """Order grasps by a figure, the smallest first; equal ones stay in the order given."""
    return [found[place] for place in np.argsort(ranks(figures, same), kind="stable")]


def _far_apart(every: Sequence[Certified]) -> Iterator[int]:
    """Yield places, each next one the farthest from those before, by its farthest contact."""
    places = np.array([found.placement.positions for found in every])
    nearest, last = np.full(len(every), np.inf), 0
    for _ in every:
        yield last
        gaps = np.linalg.norm(places[:, :, None] - places[last][None, None], axis=-1)
        there = np.maximum(gaps.min(axis=1).max(axis=1), gaps.min(axis=2).max(axis=1))
        nearest = np.minimum(nearest, there)
        nearest[last] = -np.inf
        last = first_best(nearest)
