"""Finds the best grasp of an object, up to a gap, and proves the gap.

*A bound by one twist alone* is where searches begin. The support of a cone is convex in the
contact's position, so that no contact on a polygon answers a twist with more than the largest
support at its corners; the largest of all polygons, over the twist's demand, is what no four
contacts exceed.

*Levels.* Good contacts are found (`ascent`), and then one threshold after another is refuted,
each by a tree of cuts (`search`). Each threshold is nearer to the best known quality q: the gap is
halved from level to level, to q / (1 - gap) at last. Contacts that are found on the way and reach a
threshold become the best known, and the level is tried again. A level costs more than all before
it, as a rule, so that little is lost by them; and the bound of the last level that was finished
holds whenever the search is stopped.

The result is a grasp with the proof of its gap, and how the search came there; `BestGrasp.verify`
checks it without any search.

*A ceiling* bounds contacts on four faces in the same way: each finger begins on the convex pieces
of its own face, and fingers are not interchangeable. Of a row of bounds, each below the one before
by the gap, the least that can be refuted is sought, in growing steps from above and then by
halving: a bound is not refuted if there are contacts that reach it. So what comes out does not
depend on the way of the search, unless the number of cases is spent before. It is for contacts that
keep clear of the edges as `better_contacts` keeps them; a grasp nearer to an edge may have a larger
quality. Faces that are not convex count as a whole, up to their borders.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Literal, TypeAlias

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike

from grasp_core.allowed_values import (
    LARGEST,
    Cases,
    Count,
    Friction,
    Gap,
    Seed,
    TimeLimit,
    function,
    number,
    several,
    value_of,
)
from grasp_core.arrays import Amount, Array, Indices, frozen_each
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import convex_polygon
from grasp_core.names import MeasureName
from grasp_core.objects.face_pieces import inset_piece, pieces_by_face
from grasp_core.objects.on_faces import check_planar
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.ascent import begin, climbed, piece_at
from grasp_core.optimizing.better_contacts import FINGER_RADIUS, certified
from grasp_core.optimizing.contact_places import (
    UNIT_SHAPE,
    Grounds,
    exact_maps,
    grounds_of,
    grounds_on,
)
from grasp_core.optimizing.search import EXACT_GAP, Searching
from grasp_core.optimizing.support_cuts import LEAST_THRESHOLD, CutTree
from grasp_core.planning.certify import named
from grasp_core.quality.ferrari_canny import FerrariCanny
from grasp_core.quality.measures import FERRARI_CANNY, Measure, ResistedLoads, measured_set
from grasp_core.solvers.ties import few_digits, surpassing
from grasp_core.stopping import Stop
from grasp_core.values import FINGERS, FaceQuadruple, Grasp, four

CONTACT_SLACK = 1e-7  # largest distance between equal points, and directions, in object radii
BestEnded: TypeAlias = Literal["gap", "time", "interrupt", "undivided"]
"""Why a search ended: the gap is reached, time is up, it was interrupted, or polygons became too
small, or too many, to be divided further."""


def are_contacts_of(grasp: Grasp, wrenches: WrenchSet, proof: CutTree) -> bool:
    """Return whether a grasp has a wrench set's contacts, in radii, on polygons of a proof."""
    if wrenches.norm != "l1" or len(wrenches.friction) != FINGERS:
        return False
    if (wrenches.friction != proof.friction).any() or wrenches.width != 3:  # noqa: PLR2004
        return False
    each = wrenches.G.reshape(2, 3, FINGERS, 3).transpose(0, 2, 1, 3)
    turns = each[1] @ each[0].transpose(0, 2, 1)
    normals = each[0, :, :, 0]
    arms = np.stack([turns[:, 2, 1], turns[:, 0, 2], turns[:, 1, 0]], axis=1)
    away, levers = grasp.positions - grasp.positions.mean(axis=0), arms - arms.mean(axis=0)
    size = float((away * levers).sum() / (levers * levers).sum())
    return bool(
        size > 0.0
        and np.abs(away - size * levers).max() <= CONTACT_SLACK * size
        and np.abs(grasp.normals - normals).max() <= CONTACT_SLACK
    ) and all(_is_on(proof, *contact) for contact in zip(arms, normals, strict=True))


def _is_on(proof: CutTree, point: Array, normal: Array) -> bool:
    grounds = proof.grounds
    away = point - grounds.origins
    off = np.abs(np.einsum("pi,pi->p", away, grounds.normals))
    aside = np.abs(normal - grounds.normals).max(axis=1)
    for piece in np.flatnonzero((off <= CONTACT_SLACK) & (aside <= CONTACT_SLACK)):
        polygon = convex_polygon(grounds.polygons()[piece], UNIT_SHAPE)
        at = grounds.frames[piece].T @ away[piece]
        if polygon is not None and polygon.holds(at[None], CONTACT_SLACK):
            return True
    return False


@declared
class GapAt(Declared):
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


@declared
class BestGrasp(Declared):
    """The best grasp found, with a proved bound of the quality of all others."""

    grasp: Grasp
    quality: FerrariCanny | ResistedLoads
    """Bounds of the grasp's quality (`l1`), with torques over the object's radius; or of the
    largest multiple of the loads of another measure that its contacts resist."""
    clearance: Amount
    """Distance that contacts keep from the edges of faces [m], or half the radius of the largest
    disc in a face where that is less."""
    proof: CutTree
    ended: BestEnded
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
            self.is_sound()
            and self.proof.owners is None  # all contacts, not those on four given faces
            and self.proof.measure
            == (self.quality.measure if isinstance(self.quality, ResistedLoads) else FERRARI_CANNY)
            and self.quality.verify()
            and self.proof.verify()
            and self.quality.lower <= self.bound
            and are_contacts_of(self.grasp, self.quality.wrenches, self.proof)
        )


def measured(
    body: Polyhedron, grasp: Grasp, friction: float, measure: Measure, gap: float = EXACT_GAP
) -> FerrariCanny | ResistedLoads:
    """Bound what a grasp of an object resists of the loads of a measure, with proofs."""
    center, scale = body.center_of_mass, body.radius
    wrenches = WrenchSet.of(grasp, None, friction, center=center, torque_scale=scale)
    return measured_set(wrenches, measure, gap)


FIRST_GAP = 0.4
"""Gap of the first level at most: a level is cheap down to it, as the search is for one twist."""
AIMED = 0.999
"""Share of the gap that is aimed at: the grasp's quality is measured anew in the end, and multiples
of round numbers would be where digits are cut."""
STEPS_IN_GAP = 64.0
"""How much finer than the gap the steps are in which qualities and bounds count."""
BOUND_ROUNDING = 1e-9  # share of a bound that rounding may cost it
MOST_JOBS = 256  # most threads: no machine that is known has more use for them


class Levels:
    """The levels of a search, with the best contacts so far."""

    def __init__(
        self, body: Polyhedron, friction: float, measure: Measure, clearance: float, seed: int,
        jobs: int, stop: Stop, progress: Callable[[GapAt], None] | None,
    ) -> None:  # fmt: skip
        self.body, self.clearance, self.progress = body, clearance, progress
        self.started = time.perf_counter()
        self.rng = np.random.default_rng([seed])
        grounds = grounds_of(body, clearance)
        maps = exact_maps(body, grounds, measure)
        self.searching = Searching(grounds, friction, jobs, stop, measure, maps)
        self.history: list[GapAt] = []
        found = begin(self.searching, self.searching.begin(self.rng), self.rng)
        if found is None:
            raise InputError(
                f"best_grasp: expected contacts in force closure at friction {friction:g}, found "
                f"none of {body.name}; raise the friction, or lower the clearance"
            )
        self.best = found
        self._tell()

    def closed_to(self, gap: float) -> BestEnded:
        """Refute threshold after threshold, until the gap is reached or the search is stopped."""
        grain = gap / STEPS_IN_GAP
        steps = max(0, math.ceil(math.log2(FIRST_GAP / gap)))
        try:
            for k in range(steps, -1, -1):
                share = 1.0 - AIMED * gap * 2.0**k
                # each turn lowers the bound to `wanted`, or raises the quality, or is the last
                while (
                    self.best.quality.lower
                    < share * (1.0 - BOUND_ROUNDING) * self.searching.proof.bound
                ):
                    wanted = few_digits(self.best.quality.lower / share, grain)
                    if not self._refuted(wanted, grain):
                        stop = self.searching.stop
                        return stop.why if stop() else "undivided"
        except KeyboardInterrupt:
            return "interrupt"
        return "gap"

    def _refuted(self, bound: float, grain: float) -> bool:
        """Lower the bound, or find contacts better by a grain; return whether either came about."""
        known = self.best.quality.lower
        refuted, better = self.searching.refute(bound, (1.0 + grain) * known)
        for found in better:
            if found.quality.lower > surpassing(self.best.quality.lower):
                self.best = found
        if better:
            self.best = climbed(self.searching, self.best.pieces, self.best.at)
        self._tell()
        return refuted or self.best.quality.lower > known

    def _tell(self) -> None:
        searching, seconds = self.searching, time.perf_counter() - self.started
        now = GapAt(seconds, self.best.quality.lower, searching.proof.bound, searching.nodes)
        self.history.append(now)
        if self.progress is not None:
            self.progress(now)

    def result(self, ended: BestEnded) -> BestGrasp:
        """Return the best contacts as a grasp, with the proof."""
        searching = self.searching
        pieces = tuple(piece_at(searching.grounds, p) for p in self.best.pieces)
        points = searching.grounds.places(np.array(self.best.pieces), self.best.at)
        faces = four(piece.face for piece in pieces)
        name = named("b", faces)
        grasp = certified(self.body, name, pieces, points, searching.friction, self.rng)
        if grasp is None:
            raise InputError(
                f"best_grasp: expected that the best contacts found, on faces {list(faces)}, can "
                "be certified, and they cannot; try another seed"
            )
        quality = measured(self.body, grasp, searching.friction, searching.measure)
        return BestGrasp(
            grasp, quality, self.clearance, searching.proof, ended, tuple(self.history)
        )


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
            seconds more, until contacts in force closure are found.
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
    if time_limit_s is not None:
        value_of(TimeLimit, time_limit_s, "time_limit_s")
    return best_until(
        Stop(seconds=time_limit_s), body, friction, gap=gap, measure=measure, wrenches=wrenches,
        clearance=clearance, seed=seed, jobs=jobs, progress=progress,
    )  # fmt: skip


def best_until(  # noqa: PLR0913 - as `best_grasp`
    stop: Stop, body: Polyhedron, friction: float, *, gap: float, measure: MeasureName,
    wrenches: ArrayLike | None, clearance: float | None, seed: int, jobs: int,
    progress: Callable[[GapAt], None] | None,
) -> BestGrasp:  # fmt: skip
    """Do what `best_grasp` does until told to stop."""
    clearance = checked_clearance(body, clearance)
    friction, seed = value_of(Friction, friction, "friction"), value_of(Seed, seed, "seed")
    value_of(Gap, gap, "gap")
    loads = Measure.of(measure, wrenches, body.radius)
    jobs = min(value_of(Count, jobs, "jobs"), MOST_JOBS)
    if progress is not None:
        function(progress, "progress")
    levels = Levels(body, friction, loads, clearance, seed, jobs, stop, progress)
    return levels.result(levels.closed_to(gap))


def checked_clearance(body: Polyhedron, clearance: float | None) -> float:
    """Return how far contacts stay from edges [m]; refuse curved objects, and false distances."""
    check_planar(body, "best_grasp")
    if clearance is None:
        clearance = FINGER_RADIUS * body.radius
    return number(
        clearance, "clearance", ge=0.0, le=body.radius, where=", the object's radius in m"
    )


SMALLEST_CEILING_GAP, LARGEST_CEILING_GAP = 1e-3, 0.9
SMALLEST_BOUND = 1e-5  # bound that is not lowered any more [N]
SEED = 0


@declared
class QualityCeiling(Declared):
    """A proved bound on the quality of all contacts on four faces, clear of the edges."""

    proof: CutTree
    """The proof, in which each finger has the pieces of its own face."""

    @property
    def upper(self) -> float:
        """Return the quality that no contacts exceed [N]."""
        return self.proof.bound

    def verify(self) -> bool:
        """Replay the proof without the search, in plain arithmetic.

        Whether its polygons are those of an object's faces can only be checked with the object.
        """
        return (
            self.is_sound()
            and self.proof.owners is not None
            and self.proof.measure.is_usual
            and self.proof.verify()
        )


def quality_ceiling(
    body: Polyhedron,
    faces: FaceQuadruple,
    friction: float = 0.5,
    *,
    known: float = 0.0,
    finger_radius: ArrayLike | None = None,
    gap: float = 0.05,
    parts: int = 100_000,
) -> QualityCeiling:
    """Find an upper bound on the `l1` quality of all contacts on four faces.

    Torques are taken about the centre of mass and divided by the object's radius, as in
    `optimize_contacts`.

    Args:
        body: The object.
        faces: Indices of four faces, one for each finger.
        friction: Coulomb coefficient at every contact.
        known: A quality that is attained [N], near which bounding may stop.
        finger_radius: How far contacts stay from the edges of their faces [m], one for all faces
            or one each, such as an improvement's `clearances`; contacts nearer to an edge are not
            bounded. A twentieth of the object's radius if None.
        gap: Share of the bound by which it may exceed the best that is attained, unless `parts`
            ends the search before.
        parts: How many cases to look at at most, some thousands more or less. Where this ends the
            search, the bound is larger, and may differ by some gaps between processors.

    Raises:
        InputError: An argument is out of range.
        SolverError: A program's answer failed its check.
    """
    check_planar(body, "quality_ceiling")
    friction = value_of(Friction, friction, "friction")
    number(known, "known", ge=0.0, le=LARGEST)
    number(gap, "gap", ge=SMALLEST_CEILING_GAP, le=LARGEST_CEILING_GAP)
    value_of(Cases, parts, "parts")
    given = FINGER_RADIUS * body.radius if finger_radius is None else finger_radius
    radii = frozen_each(given, FINGERS, "finger_radius")
    if (radii < 0.0).any() or (radii > body.radius).any():
        raise InputError(
            f"finger_radius must be from 0 to the object's radius of {body.radius:.4g} m, got "
            f"{radii.tolist()}"
        )
    grounds, owners = _grounds(body, faces, radii / body.radius)
    searching = Searching(grounds, friction, 1, Stop(parts), owners=owners)
    _lower(searching, known, gap)
    return QualityCeiling(searching.proof)


def _grounds(body: Polyhedron, faces: Sequence[int], insets: Array) -> tuple[Grounds, Indices]:
    each = partial(value_of, Annotated[int, Interval(ge=0, le=len(body.faces) - 1)], name="faces")
    given: tuple[int, ...] = several(faces, each, "faces", "indices")
    if len(given) != FINGERS:
        raise InputError(f"faces must be {FINGERS} indices of faces, got {len(given)}")
    by_face = pieces_by_face(body)
    rooms = [by_face[face] for face in given]
    if not all(rooms):
        raise InputError(
            f"faces {tuple(faces)}: one of them is too narrow for a contact; choose others"
        )
    # edges between the pieces of a face are no borders: contacts may lie on them
    own = [
        (finger, piece)
        for finger, (room, inset) in enumerate(zip(rooms, insets.tolist(), strict=True))
        for piece in ((inset_piece(room[0], inset),) if len(room) == 1 else room)
    ]
    grounds, places = grounds_on([piece for _, piece in own])
    return grounds, np.array([finger for finger, _ in own])[places]


def _lower(searching: Searching, known: float, gap: float) -> None:
    """Lower the bound of a search as far as the head of this module says."""
    searching.begin(np.random.default_rng(SEED))
    # where the faces hold nothing a twist may refute less; a larger threshold it refutes as well
    least = max(searching.proof.threshold, LEAST_THRESHOLD)
    searching.proof = replace(searching.proof, threshold=least)
    bounds = _bounds(searching.proof.bound, known, gap)
    done, last, stride = -1, len(bounds), 1  # those up to `done` are refuted, `last` is not
    while last - done > 1 and not searching.stop():
        place = min(done + stride, (done + last) // 2)
        refuted, _ = searching.refute(bounds[place])
        if refuted:
            done, stride = place, 2 * stride
        else:
            last = place


def _bounds(first: float, known: float, gap: float) -> list[float]:
    """Return the bounds below a first one to try, falling, each by the gap.

    They are multiples of what is known, or of the smallest bound where next to nothing is:
    nothing that is found on the way moves them.
    """
    least, share = max(known, SMALLEST_BOUND), 1.0 - AIMED * gap
    rising = [least / share if known >= SMALLEST_BOUND else least]
    while (
        rising[-1] < first * share
    ):  # each is larger by `AIMED` of `SMALLEST_CEILING_GAP` at least
        rising.append(rising[-1] / share)
    return [few_digits(bound, gap / STEPS_IN_GAP) for bound in rising[::-1] if bound < first]
