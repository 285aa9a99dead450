"""Finds the largest regions around contacts that are proved to keep force closure.

*Discs.* Solved: for contacts on faces, a radius at which a cover of all twists is found, and a
larger radius at which some contacts in the discs are not force-closed. Parts of a disc outside its
face are left out. The radius is doubled from a small one and then bisected, first with few cones
for each attempt, then in smaller steps with as many cones as are allowed.

A cover is a list of cones that fill the space of twists, each with contact forces that together
have power on all its rays. Compiled code divides cones until such forces are found for each, or
stops when it finds a twist that contacts at some places do not resist; `regions_certificate`
derives why a cover is enough, and checks the answer, and `cover_kernel` describes how forces are
found.

*Polygons.* A cover proves more than the discs it was sought for. On a ray of one of its cones the
least powers of the forces sum to s > 0. Each of the m contacts with a force may lose s / m there
and no more, so its place x has to satisfy

    F.(a + b x x) >= its least power - s / m,                                               (1)

a half-plane. The part of a face in all half-planes of its finger is a convex polygon around the old
region. The cover proves these polygons too, as the losses on each ray sum to s at most. The power
that the polygons leave over is shared out again.

*Centres.* A cover has fixed contact forces for each cone. The power of a fixed force is linear in
the position of its contact. So the largest radius r that these forces allow, over all centres c_i
with the discs on their faces, is one linear program:

    maximise r  over c_i, r
    sum over i of F_i.(a + b x c_i) - r |T_i'(F_i x b)| >= 0   for each ray of each cone,   (2)
    E_i c_i + r <= b_i                                          for each face.              (3)

New centres allow other forces, so new covers are sought around them, again and again while the
radius grows. The paper's own program for concurrent grasps is of this kind, with one focus for all
twists.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.compiled import compiled
from grasp_core.errors import InputError, SolverError
from grasp_core.geometry.polygons import (
    ON_LINE,
    SAME_CORNER,
    clip,
    clip_to_disc,
    nearest_point,
    tidy,
)
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.regions.regions_certificate import (
    TWIST,
    UNDIVIDED,
    TwistCover,
    power_of,
    slack_of,
    summed,
)
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import GRID_DIGITS, coarse, first_best, nearest_optimum, on_grid

LEAST_POWER = 1e-8
"""Least power of a force that counts, relative to its size and the farthest place: more than
rounding sites to a grid can change it."""


class Sites(NamedTuple):
    """Where each of k contacts may be, as plain arrays for compiled loops."""

    points: Array  # points of the contacts about any origin, (k, 3)
    frames: Array  # frames as columns (inward normal, tangent, tangent), right-handed, (k, 3, 3)
    friction: Array  # Coulomb coefficients, (k,)
    corners: Array
    """Corners of convex polygons, along the tangents and relative to `points`, (k, c, 2); the last
    corner may be repeated."""
    radii: Array  # radii of the discs by which the polygons are widened, (k,)
    depths: Array  # largest distance of contacts from the planes of their polygons, (k,)

    def on_grid(self) -> "Sites":
        """Round to a grid, so that last digits do not matter to a search; friction never rises."""
        friction = -coarse(-self.friction, GRID_DIGITS)
        return Sites(*map(on_grid, self))._replace(friction=np.clip(friction, 0.0, self.friction))

    def clear(self) -> Array:
        """Return the power per unit of force and twist that rounding to the grid may take, (k,)."""
        aside = np.sqrt(np.einsum("kcj,kcj->kc", self.corners, self.corners)).max(axis=1)
        places = np.sqrt(np.einsum("kj,kj->k", self.points, self.points))
        farthest = 1.0 + float((places + aside + self.radii + self.depths).max())
        return LEAST_POWER * farthest * (1.0 + self.friction)

    def lowest(self, i: int, slopes: Array) -> Array:
        """Find the least values of functions with slopes (..., 2) over a contact's site, (...,)."""
        lengths = np.sqrt(np.einsum("...j,...j->...", slopes, slopes))
        return (slopes @ self.corners[i].T).min(axis=-1) - self.radii[i] * lengths


def stacked_corners(polygons: list[Array]) -> Array:
    """Put polygons (c, 2) into one array, with the last corners of shorter ones repeated."""
    if min(map(len, polygons)) == 0:
        raise InputError("the site of each contact must have at least one corner, got none")
    most = max(map(len, polygons))
    return np.array([
        np.vstack([polygon, np.repeat(polygon[-1:], most - len(polygon), axis=0)])
        for polygon in polygons
    ])  # fmt: skip


COVER_KERNEL = "grasp_core.regions.cover_kernel"
DIAGONAL = 1e-12
"""Number added to the diagonal of a product of motions, so that it has a triangular factor."""
FINENESS = 0.02  # relative precision to which the largest radius is found
FIRST_PROVED, LEAST_PROVED = 0.05, 1e-6
"""Radii at which the search begins and at which it gives up, relative to the levers of the
contacts."""
COARSE = 16  # factor by which the first attempts have fewer cones
FAST_GROWTH, SLOW_GROWTH = 2.0, 1.1
"""Factors by which the radius grows, in the first attempts and in the others."""
OPEN_NEAR = 0.04
"""Distance from the proved radius up to which an open choice is sought, relative to it."""
REFUTING = 4
"""Factor by which attempts to find contacts that are not closed have fewer cones."""
REACH_DIGITS = 10  # digits after the point to which the largest radius to try is rounded
DISC_SIDES = 16  # number of sides of the polygon around a disc that extends beyond its face


def search_cover(sites: Sites, axes: Array, cones: int) -> tuple[TwistCover | None, Array | None]:
    """Search for a cover that proves force closure for all contacts in given sites.

    Otherwise contacts, (k, 3), may be found that leave a twist unresisted except for rounding.
    """
    # the search sees sites on a grid, so that it ends alike on all machines
    kernel, told = compiled(COVER_KERNEL), sites.on_grid()
    k, most = len(sites.points), max(cones, 1 << TWIST)
    tree = kernel.CoverTree(np.zeros(most, np.int64), np.zeros((most, k, 3)), np.zeros((k, 3)))
    ended, count = kernel.search(told, axes, (most, told.clear()), tree)
    # (5), translated from shifts along the frames to places
    if ended == kernel.REFUTED:
        return None, sites.points + np.einsum("kij,kj->ki", sites.frames, tree.shifts)
    if ended != kernel.COVERED:
        return None, None
    codes = tree.codes[:count]
    forces = tree.forces[:count][codes == UNDIVIDED]
    return TwistCover(axes, codes, np.einsum("kij,mkj->mki", sites.frames, forces)), None


def twist_axes(points: Array, frames: Array, friction: Array) -> Array:
    """Choose six twists as rows that move contacts at similar speeds, tangential ones times mu.

    With these, long objects need no more cones than round ones.
    """
    motions = list[Array]()
    for (x, y, z), F, mu in zip(points, frames, friction, strict=True):
        turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        weights = np.array([1.0, mu, mu])
        motions.append(weights[:, None] * (F.T @ np.hstack([np.eye(3), turning])))
    J = np.vstack(motions)
    # a triangular factor is the same on all machines, unlike eigenvectors of symmetric contacts
    factor = np.linalg.cholesky(J.T @ J + DIAGONAL * np.eye(J.shape[1]))
    return to_digits(np.asarray(np.linalg.inv(factor), dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class RegionTask:
    """The pieces that contacts may stand on, at unit size, with friction and the effort allowed."""

    pieces: tuple[FacePiece, ...]
    friction: Array
    cones: int  # largest number of cones in one proof

    @property
    def frames(self) -> Array:
        """Return the frames of the pieces as columns (normal, tangent, tangent), (k, 3, 3)."""
        return np.array([np.column_stack([p.normal, p.frame]) for p in self.pieces])

    def points(self, ys: Array) -> Array:
        """Return the points in space, (k, 3), with plane coordinates (k, 2)."""
        return np.array([piece.point(y) for piece, y in zip(self.pieces, ys, strict=True)])

    def places(self, i: int) -> Array:
        """Return the corners of a piece in space, (c, 3)."""
        return self.pieces[i].places(self.pieces[i].corners)

    def around(self, ys: Array, polygons: Sequence[Array], radii: Array) -> Sites:
        """Make sites of polygons (c, 2), in the planes, widened by radii."""
        return Sites(
            self.points(ys),
            self.frames,
            self.friction,
            stacked_corners([polygon - y for polygon, y in zip(polygons, ys, strict=True)]),
            radii,
            np.array([piece.depth for piece in self.pieces]),
        )

    def discs(self, ys: Array, radius: float) -> Sites:
        """Return the sites within discs around points, cut to the pieces."""
        radii, polygons = np.zeros(len(ys)), list[Array]()
        for i, (piece, y) in enumerate(zip(self.pieces, ys, strict=True)):
            if (piece.E @ y + radius <= piece.b - SAME_CORNER).all():  # not if it touches an edge
                radii[i] = radius
                polygons.append(y[None])
            else:
                polygons.append(clip_to_disc(piece.corners, y, radius, DISC_SIDES))
        return self.around(ys, polygons, radii)


@dataclass(frozen=True, slots=True, eq=False)
class Proved:
    """Discs around `ys` proved to keep force closure, and larger ones with a counterexample."""

    ys: Array
    radius: float
    cover: TwistCover
    choice: Array | None
    """Contacts that are not force-closed, in slightly larger discs, (k, 3); None if not found."""


def largest_discs(task: RegionTask, ys: Array, first: float = FIRST_PROVED) -> Proved | None:
    """Find the largest equal discs, up to whole faces, that a cover proves, or None."""
    search = _Search(task, ys)
    search.widen(task.cones // COARSE, first, FAST_GROWTH, SLOW_GROWTH - 1.0)
    search.widen(task.cones, SLOW_GROWTH * search.lower or first, SLOW_GROWTH, FINENESS)
    if search.cover is None:
        return None
    search.refute(task.cones // REFUTING)
    return Proved(ys, search.lower, search.cover, search.choice)


class _Search:
    """Radii proved so far, and radii refuted, in a search for the largest discs."""

    def __init__(self, task: RegionTask, ys: Array) -> None:
        self.task, self.ys = task, ys
        self.axes = twist_axes(task.points(ys), task.frames, task.friction)
        holding = max(
            float(np.linalg.norm(piece.corners - y, axis=1).max())
            for piece, y in zip(task.pieces, ys, strict=True)
        )
        self.reach = coarse(holding, REACH_DIGITS)  # discs hold the whole pieces, or slightly more
        self.lower = 0.0
        self.limit: float = math.inf
        self.cover: TwistCover | None = None
        self.choice: Array | None = None

    def widen(self, cones: int, radius: float, growth: float, fineness: float) -> None:
        """Try a radius, then radii growing by a factor, then bisect."""
        upper, radius = self.limit, min(radius, 0.5 * (self.lower + self.limit))
        # radii grow by a factor up to the reach, or the interval is halved or quartered
        while radius >= LEAST_PROVED and upper - self.lower > fineness * self.lower:
            radius = min(radius, self.reach)
            if radius <= self.lower:
                break
            cover, choice = search_cover(self.task.discs(self.ys, radius), self.axes, cones)
            if cover is not None:
                self.lower, self.cover = radius, cover
            else:
                upper = radius
                if choice is not None:
                    self.limit, self.choice = radius, choice
            if math.isinf(upper):
                radius = growth * self.lower
            else:
                radius = 0.5 * (self.lower + upper) if self.lower > 0.0 else 0.25 * upper

    def refute(self, cones: int) -> None:
        """Search larger discs for contacts not in force closure, then bisect the radius."""
        below, radius = self.lower, (1.0 + OPEN_NEAR) * self.lower
        # each turn halves the interval, or doubles what is searched of it, up to the reach
        while self.limit - below > OPEN_NEAR * self.lower and min(radius, self.reach) > below:
            radius = min(radius, self.reach)
            _, choice = search_cover(self.task.discs(self.ys, radius), self.axes, cones)
            if choice is not None:
                self.limit, self.choice = radius, choice
            else:
                below = radius
            ahead = below + 2.0 * max(below - self.lower, OPEN_NEAR * self.lower)
            radius = min(0.5 * (below + self.limit), ahead)


SHARINGS = 2  # number of times that spare power is shared out among the contacts
POWER_LEFT = 4.0
"""Power that polygons leave over, as a multiple of the slack with which the proof is checked."""
MOST_CENTRE_MOVES = 12  # of all centres, at most
MOVING = 8
"""Factor by which covers have fewer cones while centres move than are allowed in the end."""
WORTH = 1.005
"""Least growth of the radius, as a factor, at which centres are moved once more."""
LONGEST_MOVE = 1.0  # largest distance that a centre moves at once, in radii
MOVED_DIGITS = 6  # digits after the point that moved centres keep
STOPPING = 3.0
"""Rays count in the program if they would stop a radius up to this factor of the present one."""


def shared_out(task: RegionTask, proved: Proved) -> list[Array]:
    """Grow polygons around discs as far as their proof allows, in the planes, (c, 2) each."""
    polygons, ys = list[Array](), proved.ys
    sites = task.discs(ys, proved.radius)
    for _ in range(SHARINGS):
        polygons = _given_away(task, ys, sites, proved.cover)
        if min(map(len, polygons)) == 0:
            break  # thinner than the slack of the check
        sites = task.around(ys, polygons, np.zeros(len(ys)))
    return polygons


def _given_away(task: RegionTask, ys: Array, sites: Sites, cover: TwistCover) -> list[Array]:
    """Cut the pieces by all half-planes (1), after sharing out the spare power once."""
    each = range(len(ys))
    rows, limits = [list[Array]() for _ in each], [list[Array]() for _ in each]
    for where, rays in cover.leaves():
        twists, lengths = rays @ cover.axes, summed(rays, cover.axes)
        spare, slopes, lowest = np.zeros(lengths.shape), list[Array](), list[Array]()
        forces = cover.forces[where].swapaxes(0, 1)
        for i, (piece, point, F) in enumerate(zip(task.pieces, sites.points, forces, strict=True)):
            slope, at_origin = power_of(F, twists)
            slopes.append(slope @ piece.frame)
            lowest.append(sites.lowest(i, slopes[i]))
            spare += at_origin + slope @ point + lowest[i]
            spare -= piece.depth * np.abs(slope @ piece.normal)
            spare -= POWER_LEFT * lengths * slack_of(F, task.places(i))[:, None]
        sharing = np.maximum((forces != 0.0).any(axis=2).sum(axis=0), 1)[:, None]
        for i in each:
            sizes = np.linalg.norm(slopes[i], axis=2)
            # (1), per length of its slope
            used = sizes > 0.0
            kept = (lowest[i] - np.maximum(spare, 0.0) / sharing)[used] / sizes[used]
            rows[i].append(-slopes[i][used] / sizes[used][:, None])
            limits[i].append(-kept)
    return [
        y + tidy(_inside(piece.corners - y, np.concatenate(r), np.concatenate(b)))
        for piece, y, r, b in zip(task.pieces, ys, rows, limits, strict=True)
    ]


def _inside(polygon: Array, rows: Array, limits: Array) -> Array:
    """Cut a convex polygon (c, 2) by half-planes rows @ y <= limits, few of which matter."""
    while len(rows) and len(polygon):
        beyond = (rows @ polygon.T).max(axis=1) - limits
        worst = first_best(beyond, ON_LINE)
        if beyond[worst] <= 0.0:
            break
        polygon = clip(polygon, rows[worst : worst + 1], limits[worst : worst + 1])
        beyond[worst] = 0.0  # whatever rounding leaves of it: each turn drops this row
        rows, limits = rows[beyond > 0.0], limits[beyond > 0.0]
    return polygon


def better_centers(task: RegionTask, ys: Array) -> Array:
    """Find centres with larger discs, or return the same where no radius is proved around them."""
    coarse = replace(task, cones=task.cones // MOVING)
    best = largest_discs(coarse, ys)
    if best is None:
        return ys
    for _ in range(MOST_CENTRE_MOVES):
        moved = _best_for_forces(coarse, best)
        found = None if moved is None else largest_discs(coarse, moved, best.radius)
        if found is None or inside_faces(coarse, found) < WORTH * inside_faces(coarse, best):
            break
        best = found
    return best.ys


def larger_inside(task: RegionTask, one: Proved | None, other: Proved | None) -> Proved | None:
    """Return whichever of two sets of discs has the larger discs inside the faces."""
    if one is None or other is None:
        return other if one is None else one
    return (one, other)[first_best([inside_faces(task, each) for each in (one, other)])]


def inside_faces(task: RegionTask, proved: Proved) -> float:
    """Return the largest radius of discs that are proved and lie inside the faces."""
    depths = [(p.b - p.E @ y).min() for p, y in zip(task.pieces, proved.ys, strict=True)]
    return min(proved.radius, *map(float, depths))


def _best_for_forces(task: RegionTask, proved: Proved) -> Array | None:
    """Find the best centres near the present ones for a cover's forces, or None."""
    k = len(proved.ys)
    rows, limits = list[Array](), list[Array]()
    points = task.points(proved.ys)
    for where, rays in proved.cover.leaves():
        twists = rays @ proved.cover.axes
        twists = (twists / np.linalg.norm(twists, axis=2, keepdims=True)).reshape(-1, 6)
        powers, falls, moves = np.zeros(len(twists)), np.zeros(len(twists)), list[Array]()
        forces = proved.cover.forces[where]
        sizes = np.sqrt(np.einsum("mki,mki->m", forces, forces))[:, None]
        for piece, point, F in zip(task.pieces, points, forces.swapaxes(0, 1), strict=True):
            each = np.repeat(F / sizes, rays.shape[1], axis=0)
            slope, at_origin = power_of(each, twists[:, None])
            slope, across = slope[:, 0], slope[:, 0] @ piece.frame
            powers += at_origin[:, 0] + slope @ point - piece.depth * np.abs(slope @ piece.normal)
            falls += np.linalg.norm(across, axis=1)
            moves.append(across)
        # (2), for moves from the present centres
        near = powers < STOPPING * proved.radius * falls
        rows.append(np.column_stack([-np.hstack(moves), falls])[near])
        limits.append(powers[near])
    # (3), for the same moves
    for i, (piece, y) in enumerate(zip(task.pieces, proved.ys, strict=True)):
        edges = np.zeros((len(piece.E), 2 * k + 1))
        edges[:, 2 * i : 2 * i + 2], edges[:, -1] = piece.E, 1.0
        rows.append(edges)
        limits.append(piece.b - piece.E @ y)
    box = np.eye(2 * k, 2 * k + 1)
    rows += [box, -box]
    limits += [np.full(2 * k, LONGEST_MOVE * proved.radius)] * 2
    c = np.zeros(2 * k + 1)
    c[-1] = 1.0
    program = LinearProgram(c, np.vstack(rows), np.concatenate(limits))
    try:
        best = maximize(program)
    except SolverError:
        return None
    if not isinstance(best, Optimum):
        return None
    moved = on_grid(proved.ys + nearest_optimum(program, best)[:-1].reshape(k, 2), MOVED_DIGITS)
    return np.array([
        nearest_point(piece.corners, y) for piece, y in zip(task.pieces, moved, strict=True)
    ])  # fmt: skip
