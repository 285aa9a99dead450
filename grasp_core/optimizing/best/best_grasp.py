"""Finds the best grasp of an object, up to a gap, and proves the gap.

Good contacts are found first (`incumbents`), and a bound by a single twist. Then one threshold
after another is refuted (`search`), each nearer to the best known quality q: the gap is halved from
level to level, to q / (1 - gap) at last. Contacts that are found on the way and reach a threshold
become the best known, and the level is tried again. A level costs more than all before it, as a
rule, so that little is lost by them; and the bound of the last level that was finished holds
whenever the search is stopped.
"""

import math
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.by_value import ByValue
from grasp_core.checked import coefficient, function, number, seed_of, whole
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.families.constructions import point_region, regions_of
from grasp_core.families.free_contacts import closed_at, of_general_type
from grasp_core.fields import is_a, is_number
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.contacts_of_proof import are_contacts_of
from grasp_core.optimizing.best.grounds import grounds_of
from grasp_core.optimizing.best.incumbents import begin, climbed, piece_at
from grasp_core.optimizing.best.same_places import exact_maps, first_nodes
from grasp_core.optimizing.best.search import EXACT_GAP, Found, Searching, Steps, Stop
from grasp_core.optimizing.best.support_cuts import CutTree, Slack
from grasp_core.optimizing.better_contacts import FINGER_RADIUS
from grasp_core.planning.certify import Candidate, certify, named, to_grasp
from grasp_core.quality.ferrari_canny import FerrariCanny, ferrari_canny
from grasp_core.quality.measures import Measure, MeasureName
from grasp_core.quality.resisted_loads import ResistedLoads, resisted_loads
from grasp_core.values import ForceCone, Grasp

Ended: TypeAlias = Literal["gap", "time", "interrupt", "undivided"]
"""Why a search ended: the gap is reached, time is up, it was interrupted, or polygons became too
small to be divided."""
WIDEST = 0.4
"""Gap of the first level at most."""
TWISTS = 384
"""Random twists to begin with, each moved to where the support of all faces is smaller."""
FIRST_STEPS = 60
SMALLEST_GAP, LARGEST_GAP = 1e-4, 0.9
AIMED = 0.999
"""Share of the gap that is aimed at, as the grasp's quality is measured anew in the end."""
SAME = 1e-9
"""Share of a bound that rounding may cost it."""
MOST_SECONDS = 1e7
MOST_JOBS = 256
CUTS = "grasp_core.optimizing.best.cuts_kernel"
DESCENTS = "grasp_core.optimizing.best.twists_kernel"


@dataclass(frozen=True, slots=True)
class GapAt:
    """How far a search had come at one moment."""

    seconds: float
    """Time since it began [s]."""
    quality: float
    """Quality of the best grasp known then [N], or the multiple of a task's loads."""
    bound: float
    """What no quality exceeds [N], or no multiple."""
    nodes: int
    """How many nodes had been visited."""

    @property
    def gap(self) -> float:
        """Return the share of the bound that is not reached."""
        return 1.0 - self.quality / self.bound


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BestGrasp(ByValue):
    """The best grasp found, with a proved bound of the quality of all others."""

    grasp: Grasp
    quality: FerrariCanny | ResistedLoads
    """Bounds of the grasp's quality (`l1`), with torques over the object's radius; or of the
    largest multiple of the loads of another measure that its contacts resist."""
    clearance: float
    """Distance that contacts keep from the edges of faces [m], or half the radius of the largest
    disc in a face where that is less."""
    proof: CutTree
    ended: Ended
    history: tuple[GapAt, ...]
    """How the gap closed; the times do not count when values are compared."""

    @property
    def bound(self) -> float:
        """Return the quality [N] that no four contacts on the faces exceed, clear of the edges.

        For a task it is a multiple of its wrenches, for normal forces of sum one newton.
        """
        return self.proof.bound

    @property
    def measure(self) -> MeasureName:
        """Return the name of the measure that is maximised."""
        return self.proof.measure.name

    @property
    def gap(self) -> float:
        """Return the share of the bound that the grasp's quality does not reach."""
        return 1.0 - self.quality.lower / self.bound

    def verify(self) -> bool:
        """Check the grasp's quality and replay the proof of the bound, without any search.

        The contacts must be those of the quality, and lie on polygons of the proof. Whether these
        are those of an object's faces, this far from edges, can only be checked with the object, by
        `grounds_of`.
        """
        return (
            is_a(self.proof, CutTree)
            and self._has_its_measure()
            and is_number(self.clearance, least=0.0)
            and self.quality.verify()
            and self.proof.verify()
            and self.quality.lower <= self.bound
            and are_contacts_of(self.grasp, self.quality.wrenches, self.proof)
        )

    def _has_its_measure(self) -> bool:
        """Return whether the quality is about the loads of the proof."""
        if isinstance(self.quality, ResistedLoads):
            return self.quality.measure == self.proof.measure
        usual = is_a(self.proof.measure, Measure) and self.proof.measure.is_usual
        return is_a(self.quality, FerrariCanny) and usual


def best_grasp(  # noqa: PLR0913 - each is a quantity of its own
    body: Polyhedron,
    friction: float = 0.5,
    *,
    gap: float = 0.05,
    time_limit_s: float | None = None,
    measure: MeasureName = "ferrari-canny",
    wrenches: ArrayLike | None = None,
    clearance: float | None = None,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[GapAt], None] | None = None,
) -> BestGrasp:
    """Find four contacts of the largest quality on an object, and bound the quality of all others.

    All sets of faces count, also with several contacts on one face. The same grasp and proof are
    found on any number of threads, unless the time limit or an interrupt ends the search.

    Args:
        body: The object, with planar faces.
        friction: Coulomb coefficient at every contact.
        gap: Share of the bound that the quality may be below it.
        time_limit_s: Time after which the search stops with the gap reached [s]; it may take some
            seconds more.
        measure: What is maximised, with normal forces that sum to one newton: the Ferrari-Canny
            quality `l1`, with torques about the centre of mass over the object's radius; the
            `weight` that is held in every orientation [N]; or the multiple of all wrenches of a
            `task` that is resisted.
        wrenches: The external (force, torque) of a task, torque about the centre of mass, (m, 6)
            [N, N m], m up to 100; None for other measures.
        clearance: How far contacts stay from the edges of faces [m], or half the radius of the
            largest disc in a face where that is less; a twentieth of the object's radius if None.
        seed: Seed of the random contacts and twists to begin with.
        jobs: How many threads search.
        progress: Called whenever the bound or the quality has improved.

    Returns:
        The grasp and the proof. An interrupt (Ctrl-C) once there is a grasp ends the search like
        the time limit.

    Raises:
        InputError: An argument is out of range, or no contacts in force closure are found.
        SolverError: A program's answer failed its check.
    """
    check_body(body)
    if body.patches is not None:
        raise InputError(
            f"best_grasp: expected an object with planar faces, got {body.name} with curved ones; "
            "take a mesh with fewer, planar faces"
        )
    friction, seed = coefficient(friction), seed_of(seed)
    number(gap, "gap", least=SMALLEST_GAP, most=LARGEST_GAP)
    loads = Measure.of(measure, wrenches, body.radius)
    whole(jobs, "jobs", least=1, most=MOST_JOBS)
    if progress is not None:
        function(progress, "progress")
    if time_limit_s is not None:
        number(time_limit_s, "time_limit_s", least=0.0, most=MOST_SECONDS)
    if clearance is None:
        clearance = FINGER_RADIUS * body.radius
    number(clearance, "clearance", least=0.0, most=body.radius, where=", the object's radius in m")
    with _stopping(time_limit_s) as stop:
        levels = _Levels(body, friction, loads, clearance, seed, jobs, stop, progress)
        return levels.result(levels.closed_to(gap))


def measured(
    body: Polyhedron, grasp: Grasp, friction: float, measure: Measure, gap: float = EXACT_GAP
) -> FerrariCanny | ResistedLoads:
    """Bound what a grasp of an object resists of the loads of a measure, with proofs."""
    center, scale = body.center_of_mass, body.radius
    if measure.is_usual:
        return ferrari_canny(grasp, friction=friction, center=center, torque_scale=scale, gap=gap)
    wrenches = WrenchSet.of(grasp, None, friction, center=center, torque_scale=scale)
    return resisted_loads(wrenches, measure, gap)


@contextmanager
def _stopping(seconds: float | None) -> Generator[Stop]:
    """Yield what stops a search after a time."""
    stop = Stop()
    timer = None if seconds is None else threading.Timer(seconds, stop.now)
    if timer is not None:
        timer.daemon = True
        timer.start()
    try:
        yield stop
    finally:
        if timer is not None:
            timer.cancel()


class _Levels:
    """The levels of a search, with the best contacts and the best bound so far."""

    def __init__(  # noqa: PLR0913, PLR0917 - each is a quantity of its own
        self, body: Polyhedron, friction: float, measure: Measure, clearance: float, seed: int,
        jobs: int, stop: Stop, progress: Callable[[GapAt], None] | None,
    ) -> None:  # fmt: skip
        self.body, self.friction, self.clearance, self.progress = (
            body, friction, clearance, progress,
        )  # fmt: skip
        self.started = time.perf_counter()
        self.rng = np.random.default_rng([seed])
        self.grounds = grounds_of(body, clearance)
        self.measure = measure
        self.maps = exact_maps(body, self.grounds, measure)
        self.nodes = first_nodes(self.grounds, self.maps)
        self.slack = Slack(friction, len(self.maps), measure.is_usual)
        spare = self.slack.searched_below
        self.searching = Searching(self.grounds, friction, jobs, stop, measure, spare)
        self.history: list[GapAt] = []
        twists = self._twists()
        self.steps, self.threshold = self._one_twist(twists)
        found = begin(self.searching, twists, self.rng)
        if found is None:
            raise InputError(
                f"best_grasp: expected contacts in force closure at friction {friction:g}, found "
                f"none of {body.name}; raise the friction, or lower the clearance"
            )
        self.best = found
        self._tell()

    @property
    def bound(self) -> float:
        return self.slack.bound(self.threshold)

    def closed_to(self, gap: float) -> Ended:
        """Refute threshold after threshold, until the gap is reached or the search is stopped."""
        steps = max(0, math.ceil(math.log2(WIDEST / gap)))
        try:
            for k in range(steps, -1, -1):
                share = 1.0 - AIMED * gap * 2.0**k
                while self.best.quality.lower < share * (1.0 - SAME) * self.bound:
                    wanted = self.best.quality.lower / share
                    if not self._refuted(wanted):
                        return "time" if self.searching.stop() else "undivided"
        except KeyboardInterrupt:
            return "interrupt"
        return "gap"

    def _refuted(self, bound: float) -> bool:
        """Lower the bound, or find better contacts; return whether one of them came about."""
        threshold = self.slack.searched(bound)
        known = self.best.quality.lower
        steps, better = self.searching.refute(self.nodes, threshold, known, lambda _: None)
        if steps is not None:
            self.steps = steps
            self.threshold = self.slack.threshold(bound)
        for found in better:
            if found.quality.lower > self.best.quality.lower:
                self.best = found
        if better:
            moved = climbed(self.searching, self.best.pieces, self.best.at)
            self.best = max(self.best, moved, key=lambda found: found.quality.lower)
        self._tell()
        return steps is not None or self.best.quality.lower > known

    def _tell(self) -> None:
        seconds = time.perf_counter() - self.started
        now = GapAt(seconds, self.best.quality.lower, self.bound, self.searching.nodes)
        self.history.append(now)
        if self.progress is not None:
            self.progress(now)

    def _twists(self) -> Array:
        """Return twists in which all faces resist little, and let the search know them."""
        descend = compiled(DESCENTS).descend
        points = [self.grounds.places(p, at) for p, at in enumerate(self.grounds.polygons())]
        on = np.repeat(np.arange(len(points)), [len(each) for each in points])
        corners, pieces = np.vstack(points), self.searching.pieces
        found = self.rng.normal(size=(TWISTS, 6))
        # a task's loads themselves, the other way, ask for most
        found = np.vstack([-self.measure.loads, found])
        found /= np.linalg.norm(found, axis=1, keepdims=True)
        low = len(self.measure.loads) + TWISTS // 4
        lowered = found[:low].copy()
        for y in lowered:
            descend(pieces, self.searching.demand, corners, on, len(on), y, FIRST_STEPS)
        found = np.vstack([lowered, found[low:]])
        self.searching.learn(found)
        return np.array(self.searching.pool.twists[: len(found)])

    def _one_twist(self, twists: Array) -> tuple[Steps, float]:
        """Return the tree that asks a single twist, and the least threshold that it refutes."""
        grounds, support = self.grounds, compiled(CUTS).support
        slopes, pieces, at = compiled(CUTS).slopes, self.searching.pieces, np.empty(6)
        reached = np.full(len(twists), -math.inf)
        for k, y in enumerate(twists):
            for p, polygon in enumerate(grounds.polygons()):
                slopes(pieces, p, y, at)
                highest = max(support(at, a, b, self.friction) for a, b in polygon)
                reached[k] = max(reached[k], highest)
        thresholds = self.slack.refuted(reached, self.measure.demands(twists))
        best = int(thresholds.argmin())
        count = len(self.nodes[0])
        steps = Steps(
            np.zeros(count, np.int64), np.zeros(count, np.int64), twists[best : best + 1],
            np.empty((0, 3)),
        )  # fmt: skip
        return steps, float(thresholds[best])

    def result(self, ended: Ended) -> BestGrasp:
        """Return the best contacts as a grasp, with the proof."""
        proof = CutTree(
            self.grounds, self.friction, self.maps, self.threshold, self.steps.deeds,
            self.steps.asked, self.steps.twists, self.steps.lines, self.measure,
        )  # fmt: skip
        grasp = self._grasp(self.best)
        quality = measured(self.body, grasp, self.friction, self.measure)
        return BestGrasp(grasp, quality, self.clearance, proof, ended, tuple(self.history))

    def _grasp(self, best: Found) -> Grasp:
        pieces = tuple(piece_at(self.grounds, p) for p in best.pieces)
        points = np.array([piece.point(y) for piece, y in zip(pieces, best.at, strict=True)])
        plain = closed_at(pieces, points, self.friction, 0.0)
        placement = plain and of_general_type(pieces, plain, self.friction, self.rng)
        if placement is not None:
            a, b, c, d = (piece.face for piece in pieces)
            faces = (a, b, c, d)
            cones = tuple(ForceCone(piece.normal, math.atan(self.friction)) for piece in pieces)
            regions = regions_of(point_region, pieces, cones, placement)
            candidate = Candidate(
                named("b", faces), faces, "regulus", pieces, cones, placement, regions
            )
            found = certify(candidate, self.friction)
            if found is not None:
                return to_grasp(self.body, self.friction, found)
        raise InputError(
            f"best_grasp: expected that the best contacts found, on faces "
            f"{[piece.face for piece in pieces]}, can be certified, and they cannot; try another "
            "seed"
        )
