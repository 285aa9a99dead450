"""Constructs concurrent grasps: four lines of force that meet in one focus point.

Solved: for four convex faces and a force cone at each, the focus point x0 and four discs of
the largest common radius r, one inside each face, such that x0 lies in the force cone of
every point of every disc. When the four force cones positively span R^3 whatever direction
each contributes (P3), any four contacts in the discs are then in equilibrium.

Derivation. On face i the points are c_i + T_i y. Let g run over the inward unit normals of
the facets of a pyramid inscribed in force cone i. A contact at y can aim at x0 iff
g.(x0 - c_i - T_i y) >= 0 for all g. Over a disc of radius r around y_i the worst case is
g.(x0 - c_i - T_i y_i) - r |T_i'g|, and the disc lies inside the face iff e.y_i + r <= b for
its edges. All of it is linear in (x0, y_1..y_4, r):

    maximise r  subject to  g.x0 - (T_i'g).y_i - r |T_i'g| >= g.c_i    for all i, g      (1)
                            e.y_i + r <= b                             for all i, edges  (2)

A curved patch has its surface at c_i + T_i y + h n_i, |h| <= eps: the left side of (1) loses

    eps |g.n_i|.                                                                         (3)

The disc centres stay variables: eliminating them by shrinking the face over-estimates r as
soon as an edge of the shrunk face vanishes. In the code each disc has its own radius r_i, and
r is at most each of them.

The lines of force have to meet, not the forces: fingers may also push away from a focus behind
them, as from inside a hole. For such a finger side = -1, and the cone has to hold

    side (x0 - c_i - T_i y).                                                             (4)

As P3 makes the weights of the force directions positive, nothing else changes. The focus before
all fingers and behind all of them is tried first; mixed sides follow on faces that would have no
regions. With axis = normal, half-angle = theta and all sides +1 this is section 3.1 of the paper.

Before any program, discs are bounded by the distance s_i along the axis between the planes across
it through the focus and through the disc's centre. The two points of the disc's border across the
axis see the focus at no less than r, hence

    r <= s_i tan(half_angle).                                                            (5)

Source: Sudsang & Ponce 1995, section 3.1 and Proposition 5; the far side is this project's.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import product
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cones.pyramids import inscribed_facets
from grasp_core.cones.spanning import balancing_weights
from grasp_core.families.placements import NoPlacement, Placement, balanced_forces, largest_discs
from grasp_core.geometry.polygons import clip
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.ties import surpassing
from grasp_core.values import FINGERS, ForceCone, four

RADII, SMALLEST = slice(11, 15), 15
"""Indices of the four radii and of their lower bound r among the 16 variables."""


Sides: TypeAlias = tuple[float, float, float, float]
# values of `side` in (4), one per finger
BEFORE, BEHIND = (1.0, 1.0, 1.0, 1.0), (-1.0, -1.0, -1.0, -1.0)
MIXED_SIDES: tuple[Sides, ...] = tuple(
    four(sides) for sides in product((1.0, -1.0), repeat=FINGERS) if abs(sum(sides)) < FINGERS
)


def place_concurrent(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], least: float
) -> Placement | NoPlacement:
    """Place a focus before or behind all fingers, and the largest four equal discs."""
    widest = math.tan(max(cone.half_angle for cone in cones))
    limits = [reach * widest for reach in _reaches(pieces, cones)]
    return _best(pieces, cones, zip((BEFORE, BEHIND), limits, strict=True), least)


def place_on_mixed_sides(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], least: float
) -> Placement | NoPlacement:
    """Place a focus before some fingers and behind the others, with four discs.

    Fourteen patterns of sides are tried, each for discs larger than those found before. This is for
    faces on which nothing else was found; on convex objects it hardly ever finds anything.
    """
    return _best(pieces, cones, ((sides, math.inf) for sides in MIXED_SIDES), least)


def _best(
    pieces: Sequence[FacePiece],
    cones: Sequence[ForceCone],
    patterns: Iterable[tuple[Sides, float]],
    least: float,
) -> Placement | NoPlacement:
    """Place the largest discs over patterns of sides, each with an upper bound on its discs."""
    best: Placement | None = None
    bound = -math.inf
    for sides, limit in patterns:
        # (5): no program is needed to rule this pattern out
        if limit < least:
            bound = max(bound, limit)
            continue
        found = place_on_sides(pieces, cones, sides, least=least)
        if isinstance(found, Placement):
            best, least = found, surpassing(found.merit)
        else:
            bound = max(bound, found.bound)
    return best or NoPlacement(bound)


def _reaches(pieces: Sequence[FacePiece], cones: Sequence[ForceCone]) -> tuple[float, float]:
    """Bound the weighted mean of the s_i of (5) for a focus before and behind all fingers."""
    heights = [
        cone.axis @ (piece.origin[:, None] + piece.frame @ piece.corners.T)
        for piece, cone in zip(pieces, cones, strict=True)
    ]
    weights = balancing_weights(np.array([cone.axis for cone in cones]))
    lowest = weights @ np.array([float(each.min()) for each in heights])
    highest = weights @ np.array([float(each.max()) for each in heights])
    return -float(lowest), float(highest)


def place_on_sides(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], sides: Sides = BEFORE, *, least: float
) -> Placement | NoPlacement:
    """Place a focus point and four discs of the largest common radius."""
    A, b = _rows(pieces, cones, sides)
    discs = largest_discs(A, b, RADII, SMALLEST, least)
    if isinstance(discs, NoPlacement):
        return discs
    x, merit = discs
    y, focus = x[3:11].reshape(FINGERS, 2), x[:3]
    positions = np.array([piece.point(at) for piece, at in zip(pieces, y, strict=True)])
    forces = balanced_forces(pieces, np.array(sides)[:, None] * (focus - positions))
    return Placement(positions, forces, focus[None], x[RADII], merit)


def cone_footprint(piece: FacePiece, cone: ForceCone, focus: Array, contact: Array) -> Array:
    """Cut a piece to the inverted cone of section 3.1 on the contact's side of a focus, (k, 3)."""
    side = 1.0 if float(cone.axis @ (focus - contact)) > 0.0 else -1.0
    G = side * inscribed_facets(cone, piece.frame[:, 0])
    # (1) and (3) with r = 0 and x0 fixed bound the point y alone
    limits = G @ (focus - piece.origin) - piece.depth * np.abs(G @ piece.normal)
    flat = clip(piece.corners, G @ piece.frame, limits)
    return piece.origin + flat @ piece.frame.T


def _rows(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], sides: Sides
) -> tuple[Array, Array]:
    """Build rows A x <= b over x = (x0 (3), y (4 x 2), radii r_i (4), r)."""
    rows: list[Array] = []
    limits: list[Array] = []
    for i, (piece, cone, side) in enumerate(zip(pieces, cones, sides, strict=True)):
        # (4): the sign of the facets is the side
        G = side * inscribed_facets(cone, piece.frame[:, 0])
        flat = G @ piece.frame
        # (1), with the radius r_i of this disc
        aim = np.zeros((len(G), 16))
        aim[:, :3], aim[:, 3 + 2 * i : 5 + 2 * i] = -G, flat
        aim[:, 11 + i] = np.linalg.norm(flat, axis=1)
        # (2): the disc stays inside the face
        inside = np.zeros((len(piece.E), 16))
        inside[:, 3 + 2 * i : 5 + 2 * i], inside[:, 11 + i] = piece.E, 1.0
        # r <= r_i: the program maximises the smallest radius
        smallest = np.zeros((1, 16))
        smallest[0, 15], smallest[0, 11 + i] = 1.0, -1.0
        rows += [aim, inside, smallest]
        # (3) takes eps |g.n_i| from the limit of (1)
        limits += [-G @ piece.origin - piece.depth * np.abs(G @ piece.normal), piece.b, np.zeros(1)]
    return np.vstack(rows), np.concatenate(limits)
