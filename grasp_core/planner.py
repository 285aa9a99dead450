"""Runs the methods over the face quadruples of an object and gathers their grasps.

The three constructions of the paper work on quadruples whose normals span (P3), in the order of
an upper bound on their radius; with a `limit`, a search ends when the bound falls below the worst
radius kept, so the grasps returned are the best ones and not merely some. The free method goes
through all quadruples of faces and proves for the others that they hold no grasp.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, zip_longest
from typing import TypeAlias, get_args

from grasp_core.arrays import UNIT_SLACK
from grasp_core.certified import Certified, to_grasp
from grasp_core.constructions import CONSTRUCTIONS, LEAST_RADIUS
from grasp_core.errors import InputError
from grasp_core.plans import Plan, PlanCounts
from grasp_core.ranking import Ranking, candidate_quadruples, pieces_by_face
from grasp_core.search import Search, search_construction, search_free
from grasp_core.values import FINGERS, LARGEST_FRICTION, Family, Grasp, Method, Polyhedron

FAMILIES: tuple[Family, ...] = get_args(Family)
"""The families of the paper, each with its construction."""
METHODS: tuple[Method, ...] = get_args(Method)
"""Everything that `families` may name: the three constructions and `free`."""
MAX_FACES = 200
"""65 million quadruples, some 6 million of which span: half a gigabyte."""
Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with quadruples done, quadruples in all, and grasps found so far."""


def plan(  # noqa: PLR0913 - the contract's keywords
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = FAMILIES,
    theta_deg: float | None = None,
    limit: int | None = None,
    seed: int = 0,
    cells: int = 1,
    progress: Progress | None = None,
) -> Plan:
    """Find the four-finger force-closure grasps of an object.

    Args:
        body: The object.
        friction: Coulomb coefficient at every contact.
        families: Which constructions to try; `free` is the method without a fixed type.
        theta_deg: Half-angle of the friction cones to plan with [deg]; atan(friction) when
            None, and never more than that.
        limit: Keep only this many grasps, the best of each family in turn: those with the
            largest discs. Reguli and free grasps have no discs; of these the first found count.
        seed: For the restarts of the free method.
        cells: Into how many parts the free method may cut the faces of one quadruple.
        progress: Called after each quadruple.

    Returns:
        The certified grasps, largest radius first, or the reason why there are none.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    searches = _Searches(body, friction, families, theta_deg, limit, seed, cells)
    for _ in searches.run(progress):
        pass
    return searches.plan()


def iter_grasps(
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = FAMILIES,
    theta_deg: float | None = None,
    seed: int = 0,
    cells: int = 1,
) -> Iterator[Grasp]:
    """Like `plan`, but yields each grasp as soon as it is certified, in no particular order.

    Raises:
        InputError: As `plan`.
        SolverError: As `plan`.
    """
    searches = _Searches(body, friction, families, theta_deg, None, seed, cells)
    return (to_grasp(body, friction, found) for found in searches.run(None))


class _Searches:
    """One search per method, run one after the other."""

    def __init__(  # noqa: PLR0913, PLR0917 - as `plan`
        self,
        body: Polyhedron,
        friction: float,
        families: Sequence[Method] | Method,
        theta_deg: float | None,
        limit: int | None,
        seed: int,
        cells: int,
    ) -> None:
        self.body, self.friction, self.seed, self.cells = body, friction, seed, cells
        self.theta = _planned_half_angle(friction, theta_deg)
        families = (families,) if isinstance(families, str) else families
        _check_request(body, families, limit, cells)
        self.pieces = pieces_by_face(body)
        self.candidates = candidate_quadruples(body, self.pieces, self.theta)
        self.quadruples = math.comb(len(body.faces), FINGERS)
        self.rankings: dict[Method, Ranking] = {}
        self.by_method: dict[Method, Search] = {}
        for family in FAMILIES:
            if family in families:
                self.rankings[family] = self.candidates.ranked(CONSTRUCTIONS[family])
                self.by_method[family] = Search(limit, len(self.rankings[family]))
        if "free" in families:
            self.by_method["free"] = Search(limit, self.quadruples)
        self.limit = limit

    def run(self, progress: Progress | None) -> Iterator[Certified]:
        """Yield each certified grasp, in the order of the search."""
        total = sum(search.total for search in self.by_method.values())
        before = found = 0
        for method, search in self.by_method.items():
            start = time.process_time()
            for done, grasps in enumerate(self._steps(method, search), start=1):
                found += len(grasps)
                search.seconds = time.process_time() - start
                if progress is not None:
                    progress(before + done, total, found)
                yield from grasps
            before += search.total

    def _steps(self, method: Method, search: Search) -> Iterator[list[Certified]]:
        if method == "free":
            return search_free(
                self.pieces, self.friction, self.theta, self.seed, self.cells, search
            )
        return search_construction(
            CONSTRUCTIONS[method], self.pieces, self.friction, self.rankings[method], search
        )

    def plan(self) -> Plan:
        """What was found so far."""
        kept = _best_of_each_in_turn([s.best for s in self.by_method.values()], self.limit)
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
            len(self.candidates),
            {method: search.counts for method, search in self.by_method.items()},
        )
        return Plan(
            grasps=tuple(grasps),
            friction=self.friction,
            theta=self.theta,
            seed=self.seed,
            counts=counts,
            absence=None if grasps else _absence(self.body.name, counts),
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


def _check_request(
    body: Polyhedron, families: Sequence[Method], limit: int | None, cells: int
) -> None:
    unknown = [family for family in families if family not in METHODS]
    if unknown or not families:
        raise InputError(f"families must be among {', '.join(METHODS)}; got {list(families)}")
    for name, value in (("limit", limit), ("cells", cells)):
        if value is not None and value < 1:
            raise InputError(f"{name} must be at least 1, got {value}")
    if len(body.faces) > MAX_FACES:
        raise InputError(
            f"{body.name} has {len(body.faces)} planar faces, over the limit of {MAX_FACES}; "
            "simplify the mesh so that flat parts become single faces"
        )


def _absence(name: str, counts: PlanCounts) -> str:
    free = counts.families.get("free")
    if free is not None:
        if not_proved := free.undecided + free.rejected:
            return (
                f"{name}: no grasp was found; {not_proved} of {free.tried} face quadruples are "
                "undecided, all others are proved to hold none; try more cells"
            )
        return f"{name}: each of {free.tried} face quadruples is proved to hold no grasp"
    if not counts.spanning:
        return (
            f"{name} has no four faces whose normals keep positively spanning space when each "
            "may tilt within a force cone (P3; no box or prism has), so the paper's "
            "constructions offer no grasp; the free method may (--family free)"
        )
    tried = " or ".join(counts.families)
    return (
        f"{name}: {counts.spanning} face quadruples span (P3), but no {tried} grasp was found on "
        f"them (discs below {LEAST_RADIUS:g} object radii do not count); the free method may find "
        "others (--family free)"
    )
