"""Runs the methods over the face quadruples of an object and gathers their grasps.

The three constructions of the paper work on quadruples with force cones that positively span (P3),
around the normals or tilted, in the order of an upper bound on their radius; with a `limit`, a
search ends when the bound falls below the worst radius kept, so the grasps returned are the best
ones and not merely some. The free method goes through the quadruples that are left, and proves
for the others that they hold no grasp.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from typing import Literal, TypeAlias, get_args

from grasp_core.arrays import UNIT_SLACK
from grasp_core.certified import Certified, to_grasp
from grasp_core.constructions import CONSTRUCTIONS, LEAST_RADIUS
from grasp_core.errors import InputError
from grasp_core.face_pieces import face_shapes
from grasp_core.free_search import FreeRequest, search_free
from grasp_core.planar_faces import MAX_FACES
from grasp_core.plans import Outcomes, Plan, PlanCounts
from grasp_core.ranking import Candidates, candidate_blocks
from grasp_core.search import Search, search_construction
from grasp_core.values import (
    FINGERS,
    LARGEST_FRICTION,
    FaceQuadruple,
    Family,
    Grasp,
    Method,
    Polyhedron,
)

FAMILIES: tuple[Family, ...] = get_args(Family)
"""The families of the paper, each with its construction."""
METHODS: tuple[Method, ...] = get_args(Method)
"""Everything that `families` may name: the three constructions and `free`."""
ConeKind: TypeAlias = Literal["tilted", "normal"]
Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with quadruples done, quadruples in all, and grasps found so far."""


@dataclass(frozen=True, slots=True)
class _Request:
    """The keywords of `plan`."""

    families: tuple[Method, ...]
    theta_deg: float | None
    cones: ConeKind
    limit: int | None
    seed: int
    cells: int


def plan(  # noqa: PLR0913 - the contract's keywords
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = METHODS,
    theta_deg: float | None = None,
    cones: ConeKind = "tilted",
    limit: int | None = None,
    seed: int = 0,
    cells: int = 1,
    progress: Progress | None = None,
) -> Plan:
    """Find the four-finger force-closure grasps of an object.

    Args:
        body: The object.
        friction: Coulomb coefficient at every contact.
        families: What to try: constructions of the paper, and `free`, the method without a fixed
            type. Beside constructions it gets the quadruples that they leave over.
        theta_deg: Half-angle of the friction cones to plan with [deg]; atan(friction) when
            None, and never more than that.
        cones: `normal` keeps force cones around the normals, as in the paper; with `tilted` leaning
            ones are tried too.
        limit: Keep only this many grasps, the best of each family in turn: those with the
            largest discs. Reguli and free grasps have no discs; of these the first found count, and
            free ones only as far as the others do not suffice.
        seed: For the restarts of the free method.
        cells: Into how many parts the free method may cut the faces of one quadruple.
        progress: Called after each quadruple.

    Returns:
        The certified grasps, largest radius first, or the reason why there are none.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    request = _Request(_listed(families), theta_deg, cones, limit, seed, cells)
    searches = _Searches(body, friction, request)
    for _ in searches.run(progress):
        pass
    return searches.plan()


def iter_grasps(  # noqa: PLR0913 - as `plan`
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = METHODS,
    theta_deg: float | None = None,
    cones: ConeKind = "tilted",
    seed: int = 0,
    cells: int = 1,
) -> Iterator[Grasp]:
    """Like `plan`, but yields each grasp as soon as it is certified, in no particular order.

    Raises:
        InputError: As `plan`.
        SolverError: As `plan`.
    """
    request = _Request(_listed(families), theta_deg, cones, None, seed, cells)
    searches = _Searches(body, friction, request)
    return (to_grasp(body, friction, found) for found in searches.run(None))


def _listed(families: Sequence[Method] | Method) -> tuple[Method, ...]:
    return (families,) if isinstance(families, str) else tuple(families)


class _Searches:
    """One search per method over blocks of quadruples; the free method goes last."""

    def __init__(self, body: Polyhedron, friction: float, request: _Request) -> None:
        self.body, self.friction, self.request = body, friction, request
        self.theta = _planned_half_angle(friction, request.theta_deg)
        _check_request(body, request)
        self.shapes = face_shapes(body)
        self.quadruples = math.comb(len(body.faces), FINGERS)
        self.by_method: dict[Method, Search] = {
            method: Search(request.limit, self.quadruples)
            for method in METHODS
            if method in request.families
        }
        self.spanning = 0

    @property
    def constructions(self) -> dict[Family, Search]:
        """The searches of the paper's families."""
        return {family: self.by_method[family] for family in FAMILIES if family in self.by_method}

    @property
    def held(self) -> set[FaceQuadruple]:
        """Faces, ascending, on which some family has a grasp."""
        return set[FaceQuadruple]().union(*(search.held for search in self.constructions.values()))

    def run(self, progress: Progress | None) -> Iterator[Certified]:
        """Yield each certified grasp, in the order of the search."""
        total, found = len(self.by_method) * self.quadruples, 0
        for done, grasps in self._steps():
            found += len(grasps)
            if progress is not None:
                progress(done, total, found)
            yield from grasps
        if progress is not None:
            progress(total, total, found)

    def _steps(self) -> Iterator[tuple[int, list[Certified]]]:
        """What each quadruple gives, and how many have been dealt with."""
        dealt_with = 0
        for block in self._blocks():
            self.spanning += block.spanning
            for method, search in self.constructions.items():
                construction = CONSTRUCTIONS[method]
                ranking = block.ranked(construction)
                steps = search_construction(
                    construction, self.shapes, self.friction, ranking, search, self.held
                )
                yield from enumerate(_timed(steps, search), start=dealt_with + 1)
                dealt_with += len(block)
        if "free" in self.by_method:
            search = self.by_method["free"]
            if self.request.limit is not None:
                found = sum(len(search.best) for search in self.constructions.values())
                search.limit = max(self.request.limit - found, 0)
            dealt_with = len(self.constructions) * self.quadruples
            steps = search_free(self.shapes, self._free_request(), search, self.held)
            yield from enumerate(_timed(steps, search), start=dealt_with + 1)

    def _blocks(self) -> Iterator[Candidates]:
        """Blocks of quadruples, as long as one may hold a grasp that is worth keeping."""
        if not self.constructions:
            return
        tilted = self.request.cones == "tilted"
        for room, block in candidate_blocks(self.body, self.shapes, self.theta, tilted=tilted):
            if not any(
                search.may_gain(CONSTRUCTIONS[method], room)
                for method, search in self.constructions.items()
            ):
                return
            yield block()

    def _free_request(self) -> FreeRequest:
        structured = [CONSTRUCTIONS[method] for method in self.constructions]
        upgrades = [each for each in structured if each.bounds and self.request.cones == "tilted"]
        request = self.request
        return FreeRequest(self.friction, self.theta, request.seed, request.cells, upgrades)

    def plan(self) -> Plan:
        """What was found so far."""
        kept = _best_of_each_in_turn(
            [search.best for search in self.by_method.values()], self.request.limit
        )
        grasps: list[Grasp] = []
        for search in self.by_method.values():
            start = time.process_time()
            for found in search.best:
                if found.id in kept:
                    grasps.append(to_grasp(self.body, self.friction, found))
            search.seconds += time.process_time() - start
        grasps.sort(key=lambda grasp: -float(f"{grasp.radius:.6g}"))
        counts = PlanCounts(
            len(self.body.faces),
            self.quadruples,
            self.spanning,
            {method: search.counts for method, search in self.by_method.items()},
        )
        outcomes = self._outcomes()
        return Plan(
            grasps=tuple(grasps),
            friction=self.friction,
            theta=self.theta,
            seed=self.request.seed,
            counts=counts,
            outcomes=outcomes,
            absence=None
            if grasps
            else _absence(self.body.name, counts, outcomes, self.request.cones),
            absences={
                faces: proofs
                for search in self.by_method.values()
                for faces, proofs in search.absences.items()
            },
            undecided=tuple(
                faces for search in self.by_method.values() for faces in search.undecided
            ),
            seconds={method: search.seconds for method, search in self.by_method.items()},
        )

    def _outcomes(self) -> Outcomes:
        """What became of every four faces."""
        searches = list(self.by_method.values())
        held = set[FaceQuadruple]().union(*(search.held for search in searches))
        roomy = sum(shape is not None for shape in self.shapes)
        absent = sum(len(search.absences) for search in searches)
        absent += self.quadruples - math.comb(roomy, FINGERS)
        return Outcomes(len(held), absent, self.quadruples - len(held) - absent)


def _timed(steps: Iterator[list[Certified]], search: Search) -> Iterator[list[Certified]]:
    """The same steps, their processor time added to the search."""
    while True:
        start = time.process_time()
        step = next(steps, None)
        search.seconds += time.process_time() - start
        if step is None:
            return
        yield step


def _best_of_each_in_turn(lists: Sequence[Sequence[Certified]], limit: int | None) -> set[str]:
    """The ids of at most `limit` of all, the first of each list, then the second, and so on."""
    turns = chain.from_iterable(zip_longest(*lists))
    return {found.id for found in [one for one in turns if one is not None][:limit]}


def _planned_half_angle(friction: float, theta_deg: float | None) -> float:
    if not 0.0 < friction <= LARGEST_FRICTION:
        raise InputError(
            f"friction must be a positive number up to {LARGEST_FRICTION:g}, got {friction}"
        )
    theta = math.atan(friction)
    if theta_deg is None:
        return theta
    if not 0.0 < theta_deg <= math.degrees(theta) * (1.0 + UNIT_SLACK):
        raise InputError(
            f"theta_deg must be in (0, {math.degrees(theta):.6g}], up to the friction angle of "
            f"friction {friction}; got {theta_deg}. Raise the friction or lower theta"
        )
    return min(math.radians(theta_deg), theta)


def _check_request(body: Polyhedron, request: _Request) -> None:
    families = request.families
    unknown = [family for family in families if family not in METHODS]
    if unknown or not families:
        raise InputError(f"families must be among {', '.join(METHODS)}; got {list(families)}")
    for name, value in (("limit", request.limit), ("cells", request.cells)):
        if value is not None and value < 1:
            raise InputError(f"{name} must be at least 1, got {value}")
    if request.cones not in get_args(ConeKind):
        raise InputError(f"cones must be one of {get_args(ConeKind)}, got {request.cones!r}")
    if len(body.faces) > MAX_FACES:
        raise InputError(
            f"{body.name} has {len(body.faces)} planar faces, over the limit of {MAX_FACES}; "
            "simplify the mesh so that flat parts become single faces"
        )


def _absence(name: str, counts: PlanCounts, outcomes: Outcomes, cones: ConeKind) -> str:
    if "free" in counts.families:
        if outcomes.open:
            return (
                f"{name}: no grasp was found; {outcomes.open} of {counts.quadruples} face "
                "quadruples are undecided, all others are proved to hold none; try more cells"
            )
        return f"{name}: each of {counts.quadruples} face quadruples is proved to hold no grasp"
    if cones == "normal" and not counts.spanning:
        return (
            f"{name} has no four faces whose normals keep positively spanning space when each "
            "may tilt within a force cone (P3; no box or prism has), so the paper's "
            "constructions offer no grasp; tilted cones or the free method may"
        )
    spanning = f"{counts.spanning} face quadruples span (P3), but " if cones == "normal" else ""
    return (
        f"{name}: {spanning}no {' or '.join(counts.families)} grasp was found (discs below "
        f"{LEAST_RADIUS:g} object radii do not count); the free method may find others "
        "(--family free)"
    )
