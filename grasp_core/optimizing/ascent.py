"""Moves contacts on four convex faces uphill: towards larger quality, or larger resisted loads.

Solved, locally: maximise over positions x_i on the faces a measure of the wrenches that contact
forces with normal parts of sum one resist.

*Ferrari-Canny quality*, the radius of the largest ball of wrenches. It is bounded from below by the
plane of an inner polytope that is nearest to zero (see `ferrari_canny`). A simplex of it has
corners w_c, made by contact forces F_ci at contacts i, a unit normal (a, alpha) and the distance b;
the foot of the perpendicular on its plane is sum_c l_c w_c. When contacts move by d_i and take
their forces along, w_c moves by (0, sum_i d_i x F_ci), and

    b changes by  sum_i d_i . (Phi_i x alpha),   Phi_i = sum_c l_c F_ci.                      (1)

*A task*, the least of the largest multiples m_j of loads w_j. The program for m_j has forces F_i
and a twist (v, omega) as its answer, which asks for one of w_j, see `resisted_loads`. When contacts
move by d_i and take the forces along, the wrench changes by (0, sum_i d_i x F_i), and the optimum
by its product with the twist,

    m_j changes by  sum_i d_i . (F_i x omega).                                              (2)

*The weight* is bounded by the radius of a ball as well, with torques over a length L that is small
(see `measures`). With it d_i x F_ci is over L, and (1) holds with alpha / L in place of alpha.

Each step is a linear program: raise the least of these linearised distances or multiples, with
positions inside the faces and no coordinate moved farther than a trust region allows. A step counts
when the proved lower bound rises by it; the region grows where the prediction was good and shrinks
where it was not.

*To begin with* there are random contacts. Their quality is at most what each of many twists allows:
their largest support over the twist's demand. They are ordered by the least of these bounds; the
first of them that are in force closure are measured, and the best of these climb.

The paper leaves open where on their faces the contacts of a grasp are best (section 5).
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, cast

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.closure.contacts import contact_frames
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.geometry.polygons import edge_rows
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.optimizing.contact_places import Grounds
from grasp_core.optimizing.search import RatedContacts, Searching
from grasp_core.quality.ferrari_canny import FerrariCanny, InnerPolytope, wrench_set_quality
from grasp_core.quality.measures import (
    CLOSED_GAP,
    FERRARI_CANNY,
    SMALL_LENGTH,
    Measure,
    task_limits,
    thin,
)
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import graded, largest_first, nearest_optimum, on_grid, surpassing
from grasp_core.stopping import never
from grasp_core.values import FINGERS

SEARCH_GAP = 1e-3
"""Largest relative gap between the two bounds of the quality during the climb."""
NEAR_SHARE = 0.2
"""Simplices up to this share farther from zero than the nearest one take part in a step."""
MOST_STEP_SIMPLICES, MOST_THIN_SIMPLICES = 100, 300
"""Simplices that take part at most; more where torques are over a small length, as many are alike.
"""
STEEPEST = 20.0
"""Largest weight of a corner in the foot of the perpendicular on a simplex: on flatter simplices
the weights do not tell where the foot moves."""
ZERO_WIDTH = 1e-9
"""Share of the largest singular value of a simplex below which a singular value counts as zero."""
STEP_DIGITS = 6  # digits after the point to which a step is rounded
STEP_INSIDE = 10.0**-STEP_DIGITS
"""Distance inside the limits at which a step ends, in object radii: rounding may move the end by
this much."""
FIRST_REACH, LEAST_REACH = 0.1, 1e-3
"""Size of the trust region at first, and the size at which the climb ends, in object radii."""
MOST_CLIMB_STEPS = 40
GOOD_SHARE, REACH_GROWTH = 0.5, 1.5
"""Share of the predicted gain above which the trust region grows, and the factor by which it grows.
"""
POOR_SHARE, REACH_SHRINKAGE = 0.2, 0.4
"""Share of the predicted gain below which the trust region shrinks, and the factor by which it
shrinks."""
WORTHWHILE = 1e-6  # predicted relative gain below which the climb ends
TASK_WORTHWHILE = 1e-4
"""Predicted relative gain below which a climb for a task ends: the smallest gap that may be asked
for, as each step takes a program for every load."""


class Height(NamedTuple):
    """How high contacts stand."""

    lower: float
    """Proved lower bound of what they climb for: of the quality, or of a multiple of loads."""
    planes: Callable[[], tuple[Array, Array]] | None
    """Gives the distances or multiples near the least, (m,), and their slopes, (m, 2k); None where
    the contacts are not in force closure."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactFaces:
    """Four convex pieces of faces, as far as contacts may be on them."""

    pieces: tuple[FacePiece, ...]
    friction: float

    @property
    def normals(self) -> Array:
        """Return the inward unit normals of the pieces, (k, 3)."""
        return np.array([piece.normal for piece in self.pieces])

    def positions(self, y: Array) -> Array:
        """Turn plane coordinates of contacts, (k, 2), into points in space, (k, 3)."""
        return np.array([piece.point(at) for piece, at in zip(self.pieces, y, strict=True)])

    def quality(self, y: Array, gap: float = SEARCH_GAP) -> FerrariCanny:
        """Compute the `l1` quality of contacts, with torques in units of the object's size."""
        return wrench_set_quality(self.wrenches(y), gap)

    def wrenches(self, y: Array) -> WrenchSet:
        """Return wrenches on a grid: polytopes often choose between several equally near planes."""
        friction = np.full(len(y), self.friction)
        return WrenchSet.at(self.positions(y), self.normals, friction).on_grid()

    def height(self, measure: Measure, y: Array) -> Height:
        """Bound what contacts reach of a measure, and say how it changes near them."""
        wrenches = self.wrenches(y)
        if measure.name == "task":
            if wrench_set_quality(wrenches, CLOSED_GAP).lower <= 0.0:
                return Height(0.0, None)
            of_loads = self.planes_of_loads(wrenches, measure)
            return Height(float(of_loads[0].min()), lambda: of_loads)
        length = 1.0 if measure.is_usual else SMALL_LENGTH
        found = wrench_set_quality(wrenches if measure.is_usual else thin(wrenches), SEARCH_GAP)
        closed = found.polytope is not None
        return Height(found.lower, partial(self.nearest_planes, found, length) if closed else None)

    def climb(
        self, y: Array, measure: Measure = FERRARI_CANNY, stop: Callable[[], bool] = never
    ) -> tuple[Array, Height]:
        """Move contacts uphill to a local optimum of the quality or of a task's loads, (k, 2).

        Steps are taken as long as they are predicted to be worthwhile, and until told to stop.
        """
        worthwhile = TASK_WORTHWHILE if measure.name == "task" else WORTHWHILE
        found, reach = self.height(measure, y), FIRST_REACH
        for _ in range(MOST_CLIMB_STEPS):
            if found.planes is None or reach < LEAST_REACH or stop():
                break
            step, predicted = self.step(y, found.lower, found.planes(), reach)
            if predicted <= worthwhile * found.lower:
                break
            trial = self.height(measure, y + step)
            gained = (trial.lower - found.lower) / predicted
            if trial.lower > surpassing(found.lower):
                y, found = y + step, trial
            reach *= (
                REACH_GROWTH
                if gained > GOOD_SHARE
                else REACH_SHRINKAGE
                if gained < POOR_SHARE
                else 1.0
            )
        return y, found

    def step(
        self, y: Array, lower: float, planes: tuple[Array, Array], reach: float
    ) -> tuple[Array, float]:
        """Find the best move within the trust region, and the gain that it predicts."""
        distances, slopes = planes
        n = y.size
        rows = [np.hstack([-slopes, np.ones((len(slopes), 1))])]
        room = [distances - lower]
        for i, piece in enumerate(self.pieces):
            inside = np.zeros((len(piece.b), n + 1))
            inside[:, 2 * i : 2 * i + 2] = piece.E
            rows.append(inside)
            room.append(piece.b - piece.E @ y[i] - STEP_INSIDE)
        rows += [np.eye(n + 1)[:n], -np.eye(n + 1)[:n]]
        room.append(np.full(2 * n, reach))
        program = LinearProgram(np.eye(n + 1)[n], np.vstack(rows), np.hstack(room) / reach)
        best = maximize(program)  # in units of the reach, so that data are of order one
        if not isinstance(best, Optimum):
            return np.zeros_like(y), 0.0
        x = reach * nearest_optimum(program, best)
        return on_grid(x[:n].reshape(y.shape), STEP_DIGITS), float(x[n])

    def nearest_planes(self, found: FerrariCanny, length: float = 1.0) -> tuple[Array, Array]:
        """Return distances (m,) and, by (1), slopes (m, 2k) of the planes nearest to zero.

        Torques of the quality are over a length, in object radii.
        """
        polytope = cast("InnerPolytope", found.polytope)
        points = polytope.forces @ found.wrenches.G.T
        height = np.einsum("mcj,mj->mc", points[polytope.corners], polytope.normals)
        heights: Array = height.min(axis=1)
        cells = graded(heights)
        most = MOST_STEP_SIMPLICES if length == 1.0 else MOST_THIN_SIMPLICES
        near = np.argsort(cells, kind="stable")[:most]
        near = near[cells[near] <= graded((1.0 + NEAR_SHARE) * float(heights.min()))]
        corners, normals, b = polytope.corners[near], polytope.normals[near], heights[near]
        columns = points[corners].transpose(0, 2, 1)
        feet = np.asarray(np.linalg.pinv(columns, rcond=ZERO_WIDTH), dtype=np.float64)
        shares = np.einsum("mcj,mj->mc", feet, b[:, None] * normals)
        sound = np.abs(shares).max(axis=1) < STEEPEST
        forces = self.in_space(polytope.forces)
        carried = np.einsum("mc,mcki->mki", shares[sound], forces[corners[sound]])
        return b[sound], self.slopes(carried, normals[sound, 3:] / length)

    def planes_of_loads(self, wrenches: WrenchSet, measure: Measure) -> tuple[Array, Array]:
        """Return the multiple of each load, (m,), and its slopes (2), (m, 2k)."""
        limits = task_limits(wrenches, measure)
        forces = self.in_space(np.array([limit.forces for limit in limits]))
        slopes = self.slopes(forces, np.array([limit.twist[3:] for limit in limits]))
        return np.array([limit.multiple for limit in limits]), slopes

    def in_space(self, local: Array) -> Array:
        """Turn local forces of all contacts, (n, 3k), into forces in space, (n, k, 3)."""
        frames = contact_frames(self.normals)
        return np.einsum("kij,nkj->nki", frames, local.reshape(len(local), -1, 3))

    def slopes(self, forces: Array, turning: Array) -> Array:
        """Return how fast contacts with forces (n, k, 3) gain while turning (n, 3), (n, 2k)."""
        turned = np.cross(forces, turning[:, None])
        planes = np.array([piece.frame for piece in self.pieces])
        return np.einsum("nki,kij->nkj", turned, planes).reshape(len(forces), -1)


POINTS = 3000  # random contacts
SETS = 40_000  # random sets of four of them
SETS_AT_ONCE = 4000
RATED, MOST_RATED = 200, 4000
"""Sets whose quality is measured, and how many more are looked at while few are in force closure,
as at low friction."""
ORDERING_GAP = 0.1  # gap of these qualities, by which sets are ordered
CLIMBED, ALIKE = 16, 3
"""Sets that climb, and how many of them on the same pieces: climbs from several starts on the same
pieces end in several local optima."""


def begin(searching: Searching, twists: Array, rng: np.random.Generator) -> RatedContacts | None:
    """Return good contacts, or None if no random ones are in force closure."""
    alike, climbs = Counter[tuple[int, ...]](), 0
    best: RatedContacts | None = None
    for on, at in _closed_sets(searching, twists, rng):
        key = tuple(sorted(on.tolist()))
        alike[key] += 1
        if alike[key] > ALIKE:
            continue
        found = climbed(searching, on, at)
        if best is None or found.quality.lower > surpassing(best.quality.lower):
            best = found
        climbs += 1
        if climbs == CLIMBED or searching.stop():
            break
    return best if best is not None and best.quality.lower > 0.0 else None


def _closed_sets(
    searching: Searching, twists: Array, rng: np.random.Generator
) -> list[tuple[Indices, Array]]:
    """Return random contacts in force closure, on (4,) at (4, 2), the most promising first."""
    grounds, measure = searching.grounds, searching.measure
    on = rng.integers(len(grounds.counts), size=POINTS)
    polygons = grounds.polygons()
    weights = [rng.dirichlet(np.ones(len(polygons[int(p)]))) for p in on]
    inside = [w @ polygons[int(p)] for w, p in zip(weights, on, strict=True)]
    at = on_grid(np.array(inside))
    supports = grounds.supports(on, at, searching.friction, twists)
    sets = np.sort(rng.integers(POINTS, size=(SETS, FINGERS)), axis=1)
    demands = measure.demands(twists)
    bounds = np.concatenate(
        [
            measure.multiples(supports[sets[k : k + SETS_AT_ONCE]].max(axis=1), demands).min(axis=1)
            for k in range(0, SETS, SETS_AT_ONCE)
        ]
    )
    closed: list[tuple[Indices, Array]] = []
    rated: list[float] = []
    for place, k in enumerate(np.argsort(-bounds, kind="stable")[:MOST_RATED]):
        if (place >= RATED and len(closed) >= CLIMBED) or (closed and searching.stop()):
            break
        chosen = sets[k]
        wrenches = searching.wrenches(on[chosen], at[chosen])
        lower = wrench_set_quality(wrenches, ORDERING_GAP).lower
        if lower > 0.0:
            closed.append((on[chosen], at[chosen]))
            rated.append(lower)
    # the Ferrari-Canny quality says little about other loads: these keep the order of their bounds
    order = largest_first(rated) if measure.is_usual else range(len(closed))
    return [closed[k] for k in order]


def climbed(searching: Searching, on: Sequence[int] | Indices, at: Array) -> RatedContacts:
    """Move contacts uphill on their pieces."""
    pieces = tuple(piece_at(searching.grounds, int(p)) for p in on)
    best = searching.measured(np.array(on), at)
    if best.quality.lower <= 0.0:
        return best
    faces = ContactFaces(pieces, searching.friction)
    moved, _ = faces.climb(at, searching.measure, searching.stop)
    there = searching.measured(np.array(on), moved)
    inside = all(
        float((piece.E @ y - piece.b).max()) <= 0.0 for piece, y in zip(pieces, moved, strict=True)
    )
    return there if inside and there.quality.lower > surpassing(best.quality.lower) else best


def piece_at(grounds: Grounds, place: int) -> FacePiece:
    """Return a polygon as a `FacePiece`."""
    corners = grounds.polygons()[place]
    E, b = edge_rows(corners)
    return FacePiece(
        face=int(grounds.faces[place]), normal=grounds.normals[place],
        origin=grounds.origins[place], frame=grounds.frames[place], corners=corners, E=E, b=b,
        inradius=0.0,
    )  # fmt: skip
