"""Finds the largest equal discs around contacts that are proved to keep force closure.

Solved: for contacts on faces, a radius at which a cover of all twists is found,
and a larger radius at which some contacts in the discs are not force-closed. Parts of a disc
outside its face are left out. The radius is doubled from a small one and then bisected, first with
few cones for each attempt, then in smaller steps with as many cones as are allowed.

A cover is a list of cones that fill the space of twists, each with contact forces that together
have power on all its rays. Compiled code divides cones until such forces are found for each, or
stops when it finds a twist that contacts at some places do not resist; `proof` derives why a cover
is enough, and checks the answer, and `cover_kernel` describes how forces are found.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import SAME_CORNER, clip_to_disc
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.regions.proof import LEAF, TWIST, TwistCover
from grasp_core.solvers.ties import GRID_DIGITS, coarse, on_grid

AHEAD = 1e-8
"""Least power of a force that counts, relative to its size and the farthest place: more than
rounding sites to a grid can change it."""


class Sites(NamedTuple):
    """Where each of k contacts may be, as plain arrays for compiled loops."""

    points: Array
    """Points of the contacts about any origin, (k, 3)."""
    frames: Array
    """Frames as columns (inward normal, tangent, tangent), right-handed, (k, 3, 3)."""
    friction: Array
    """Coulomb coefficients, (k,)."""
    corners: Array
    """Corners of convex polygons, along the tangents and relative to `points`, (k, c, 2); the last
    corner may be repeated."""
    radii: Array
    """Radii of the discs by which the polygons are widened, (k,)."""
    depths: Array
    """Largest distance of contacts from the planes of their polygons, (k,)."""

    def on_grid(self) -> "Sites":
        """Round to a grid, so that last digits do not matter to a search; friction never rises."""
        friction = -coarse(-self.friction, GRID_DIGITS)
        return Sites(*map(on_grid, self))._replace(friction=np.clip(friction, 0.0, self.friction))

    def clear(self) -> Array:
        """Return the power per unit of force and twist that rounding to the grid may take, (k,)."""
        aside = np.sqrt(np.einsum("kcj,kcj->kc", self.corners, self.corners)).max(axis=1)
        places = np.sqrt(np.einsum("kj,kj->k", self.points, self.points))
        farthest = 1.0 + float((places + aside + self.radii + self.depths).max())
        return AHEAD * farthest * (1.0 + self.friction)

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


KERNEL = "grasp_core.regions.cover_kernel"
DIAGONAL = 1e-12
"""Number added to the diagonal of a product of motions, so that it has a triangular factor."""
FINENESS = 0.02
"""Relative precision to which the largest radius is found."""
FIRST_RADIUS, LEAST_RADIUS = 0.05, 1e-6
"""Radii at which the search begins and at which it gives up, relative to the levers of the
contacts."""
COARSE = 16
"""Factor by which the first attempts have fewer cones."""
FAST, SLOW = 2.0, 1.1
"""Factors by which the radius grows, in the first attempts and in the others."""
OPEN_NEAR = 0.04
"""Distance from the proved radius up to which an open choice is sought, relative to it."""
REFUTING = 4
"""Factor by which attempts to find contacts that are not closed have fewer cones."""
REACH_DIGITS = 10
"""Digits after the point to which the largest radius to try is rounded."""
SIDES = 16
"""Number of sides of the polygon around a disc that extends beyond its face."""


def search_cover(sites: Sites, axes: Array, cones: int) -> tuple[TwistCover | None, Array | None]:
    """Search for a cover that proves force closure for all contacts in given sites.

    Otherwise contacts, (k, 3), may be found that leave a twist unresisted except for rounding.
    """
    # the search sees sites on a grid, so that it ends alike on all machines
    kernel, told = compiled(KERNEL), sites.on_grid()
    k, most = len(sites.points), max(cones, 1 << TWIST)
    tree = kernel.Tree(np.zeros(most, np.int64), np.zeros((most, k, 3)), np.zeros((k, 3)))
    ended, count = kernel.search(told, axes, (most, told.clear()), tree)
    # (5), translated from shifts along the frames to places
    if ended == kernel.REFUTED:
        return None, sites.points + np.einsum("kij,kj->ki", sites.frames, tree.shifts)
    if ended != kernel.COVERED:
        return None, None
    codes = tree.codes[:count]
    forces = tree.forces[:count][codes == LEAF]
    return TwistCover(axes, codes, np.einsum("kij,mkj->mki", sites.frames, forces)), None


@dataclass(frozen=True, slots=True, eq=False)
class Grounds:
    """The pieces that contacts may stand on, at unit size, with friction and the effort allowed."""

    pieces: tuple[FacePiece, ...]
    friction: Array
    cones: int
    """Largest number of cones in one proof."""

    @property
    def frames(self) -> Array:
        """Return the frames of the pieces as columns (normal, tangent, tangent), (k, 3, 3)."""
        return np.array([np.column_stack([p.normal, p.frame]) for p in self.pieces])

    def points(self, ys: Array) -> Array:
        """Return the points in space, (k, 3), with plane coordinates (k, 2)."""
        return np.array([piece.point(y) for piece, y in zip(self.pieces, ys, strict=True)])

    def places(self, i: int) -> Array:
        """Return the corners of a piece in space, (c, 3)."""
        piece = self.pieces[i]
        return piece.origin + piece.corners @ piece.frame.T

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
                polygons.append(clip_to_disc(piece.corners, y, radius, SIDES))
        return self.around(ys, polygons, radii)

    def axes(self, ys: Array) -> Array:
        """Choose six twists as rows that move contacts at similar speeds, tangential ones times mu.

        With these, long objects need no more cones than round ones.
        """
        motions = list[Array]()
        for (x, y, z), F, mu in zip(self.points(ys), self.frames, self.friction, strict=True):
            turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
            weights = np.array([1.0, mu, mu])
            motions.append(weights[:, None] * (F.T @ np.hstack([np.eye(3), turning])))
        J = np.vstack(motions)
        # a triangular factor is the same on all machines, unlike eigenvectors of symmetric contacts
        factor = np.linalg.cholesky(J.T @ J + DIAGONAL * np.eye(J.shape[1]))
        return to_digits(np.asarray(np.linalg.inv(factor), dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class Proved:
    """Discs around `ys` proved to keep force closure, and larger ones with a counterexample."""

    ys: Array
    radius: float
    cover: TwistCover
    choice: Array | None
    """Contacts that are not force-closed, in slightly larger discs, (k, 3); None if not found."""


def largest_discs(grounds: Grounds, ys: Array, first: float = FIRST_RADIUS) -> Proved | None:
    """Find the largest equal discs, up to whole faces, that a cover proves, or None."""
    search = _Search(grounds, ys)
    search.widen(grounds.cones // COARSE, first, FAST, SLOW - 1.0)
    search.widen(grounds.cones, SLOW * search.lower or first, SLOW, FINENESS)
    if search.cover is None:
        return None
    search.refute(grounds.cones // REFUTING)
    return Proved(ys, search.lower, search.cover, search.choice)


class _Search:
    """Radii proved so far, and radii refuted, in a search for the largest discs."""

    def __init__(self, grounds: Grounds, ys: Array) -> None:
        self.grounds, self.ys, self.axes = grounds, ys, grounds.axes(ys)
        holding = max(
            float(np.linalg.norm(piece.corners - y, axis=1).max())
            for piece, y in zip(grounds.pieces, ys, strict=True)
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
        while radius >= LEAST_RADIUS and upper - self.lower > fineness * self.lower:
            radius = min(radius, self.reach)
            if radius <= self.lower:
                break
            cover, choice = search_cover(self.grounds.discs(self.ys, radius), self.axes, cones)
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
            _, choice = search_cover(self.grounds.discs(self.ys, radius), self.axes, cones)
            if choice is not None:
                self.limit, self.choice = radius, choice
            else:
                below = radius
            ahead = below + 2.0 * max(below - self.lower, OPEN_NEAR * self.lower)
            radius = min(0.5 * (below + self.limit), ahead)
