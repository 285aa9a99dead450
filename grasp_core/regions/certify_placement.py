"""Finds a proved lower bound of the chance that a grasp is closed when it is not placed exactly.

`placement_certificate` derives what is proved. The search tries prisms of several lengths, and for
each the least friction with which a cover is found: little friction leaves more to turns, long
prisms leave more to translations, and both make a cover harder.

Fingers must meet their own faces first. Where other parts of the object are in front of a face, no
higher than fingers come from, a finger that is turned by up to T against the face passes beside a
point at height h within h tan T. For a direction u in the plane, no finger that lands where
u.y <= min over corners of (u.c - h tan T) meets a polygon with corners c at heights h; nor does
one where u.y <= min u.c - H tan T, if fingers come from height H. The landings are faces, cut by
such a half-plane for each triangle in front of them. What is behind the plane is met later than the
face, so only the part of a triangle in front of it counts: where rounding lifted a corner that a
neighbour shares with the face, that is a strip beside their edge and not the whole neighbour.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, Friction, MaxCones, number, value_of
from grasp_core.arrays import Array, Shape, frozen, frozen_each
from grasp_core.geometry.polygons import clip, tidy
from grasp_core.objects.face_pieces import LEAST_INRADIUS, FacePiece
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.planar_faces import planar_slack
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.regions.certify_regions import RegionUnit, room_under
from grasp_core.regions.growth import Sites, search_cover, twist_axes
from grasp_core.regions.placement_certificate import (
    DISC_SIDES,
    Misplacement,
    PlacementProbability,
    bound,
    chance_of_turning,
)
from grasp_core.regions.regions_certificate import TwistCover
from grasp_core.small_objects import fitted
from grasp_core.solvers.ties import first_best
from grasp_core.values import FINGERS, Grasp, four

OFF_M, OFF_RAD = 2e-3, math.radians(2.0)
"""Standard deviations of place and turn that rankings and datasets count on; that of the place is
less for small objects."""
PLACEMENT_CONES = 4000
PRISMS = ((4.5, 4.0), (4.0, 3.2), (3.5, 2.6))
"""Half-widths E and half-lengths S of the prisms that are tried, in deviations of fingers beside
their lines and of slides along them."""
APPROACH_LENGTH = 3.0
"""Distance from which fingers come, in half-lengths of the longest prism."""
ANGLE_HALVINGS = 5
SMALL_CHANCE = 0.005
"""Chance of too large turns below which a smaller one is not sought."""
IN_FRONT = 1e-9
"""Height above a face from which the surface is in the way of fingers, in object radii."""
EDGE_MOVED = 1e-4
"""Distance by which an edge is moved inwards rather than that another edge is added, in levers of
the contacts, since each edge costs chance."""
IN_FRONT_ROW = np.array([[0.0, 0.0, -1.0]])
CHANCE_ROUNDING = 1e-9
"""Chance by which the bound is lowered, since other processors round it otherwise."""

Deviations = Annotated[Array, Shape(3, least=0.0)]
"""Standard deviations along or about each axis."""


def placement_probability(
    body: Polyhedron,
    grasp: Grasp,
    friction: float | tuple[float, float],
    *,
    pose_sigma_m: float | Sequence[float] = 0.0,
    pose_sigma_rad: float | Sequence[float] = 0.0,
    pose_covariance: ArrayLike | None = None,
    contact_sigma_m: float = 0.0,
    max_cones: int = PLACEMENT_CONES,
) -> PlacementProbability | None:
    """Prove a lower bound of the chance that a grasp is closed when it is not placed exactly.

    Args:
        body: The object.
        grasp: A grasp on faces of the object.
        friction: Coulomb coefficient, or the mean and the standard deviation of a Gaussian one.
        pose_sigma_m: Standard deviation of the object's translation, one or along each axis [m].
        pose_sigma_rad: Standard deviation of its turn about its centre of mass, one or about each
            axis [rad].
        pose_covariance: Covariance of translation and turn, (6, 6) [m, rad], in place of both.
        contact_sigma_m: Standard deviation of each finger in each direction across its own [m].
        max_cones: Most cones of one attempt at a proof, at least 64.

    Returns:
        The bound with its proof; None where other parts of the object hide a contact from its
        finger, where the surface is curved, or where no proof is found. `placement_bound` returns
        the reason.

    Raises:
        InputError: The contacts are not on the faces, or a number is out of its range.
    """
    off = misplacement(friction, pose_sigma_m, pose_sigma_rad, pose_covariance, contact_sigma_m)
    found = placement_bound(body, grasp, off, value_of(MaxCones, max_cones, "max_cones"))
    return None if isinstance(found, str) else found


def misplacement(
    friction: float | tuple[float, float],
    pose_sigma_m: float | Sequence[float] = 0.0,
    pose_sigma_rad: float | Sequence[float] = 0.0,
    pose_covariance: ArrayLike | None = None,
    contact_sigma_m: float = 0.0,
) -> Misplacement:
    """Gather errors that are given as `placement_probability` takes them."""
    axes = [
        value_of(Deviations, frozen_each(each, 3, name), name)
        for name, each in (("pose_sigma_m", pose_sigma_m), ("pose_sigma_rad", pose_sigma_rad))
    ]
    covariance = np.diag(np.concatenate(axes) ** 2)
    if pose_covariance is not None:
        covariance = frozen(pose_covariance, (6, 6), "pose_covariance")
    mean, sigma = friction if isinstance(friction, tuple) else (friction, 0.0)
    value_of(Friction, mean, "friction")
    shift = number(contact_sigma_m, "contact_sigma_m", ge=0.0, le=LARGEST)
    return Misplacement(covariance, shift, mean, sigma)


def placement_bound(
    body: Polyhedron, grasp: Grasp, off: Misplacement, cones: int = PLACEMENT_CONES
) -> PlacementProbability | str:
    """Return the best bound of all prisms and frictions that are tried, or why there is none.

    Raises:
        InputError: The contacts are not on the faces.
    """
    check_on_faces(body, grasp)
    if body.patches is not None:
        return "the surface is curved, where nothing is proved of misplaced contacts"
    unit = RegionUnit(body, grasp.positions)
    pieces = room_under(body, grasp, unit, 0.0)
    if pieces is None:
        return "a contact is on a part of its face that is too narrow"
    # contacts may be off their faces by rounding
    feet = [piece.in_plane(x) for piece, x in zip(pieces, unit.at(grasp.positions), strict=True)]
    feet = [p.origin + p.frame @ y for p, y in zip(pieces, feet, strict=True)]
    positions, normals = unit.back(np.array(feet)), np.array([p.normal for p in pieces])
    d = positions - body.center_of_mass
    slides = np.linalg.norm(np.hstack([normals, -np.cross(normals, d)]) @ off.root, axis=1)
    turned = float(np.linalg.norm(off.root[3:], 2))
    slides = np.hypot(slides, turned**2 * np.linalg.norm(d, axis=1))  # of second order too
    height = APPROACH_LENGTH * PRISMS[0][1] * float(slides.max()) / unit.scale
    surface = unit.at(body.vertices)[body.triangles]
    slack = planar_slack(float(np.ptp(body.vertices, axis=0).max()), body.surface.flatness_m)
    slack /= unit.scale
    seen = [
        _seen(piece, x, surface, slack, height, math.tan(off.turn))
        for piece, x in zip(pieces, feet, strict=True)
    ]
    if hidden := [str(finger) for finger, corners in enumerate(seen) if not len(corners)]:
        return f"other parts of the object may hide a contact from finger {' and '.join(hidden)}"
    landings = [
        unit.back(piece.places(corners)) for piece, corners in zip(pieces, seen, strict=True)
    ]
    lean, depth = max(p.spread for p in pieces), max(p.depth for p in pieces) + slack
    made = partial(
        PlacementProbability, off=off, center=body.center_of_mass, positions=positions,
        normals=normals, landings=four(landings), lean=lean, depth=unit.scale * depth,
        origin=unit.origin, scale=unit.scale,
    )  # fmt: skip
    best: PlacementProbability | None = None
    for wide, long in PRISMS:
        shift, slide = wide * off.contact_sigma, long * slides
        sites = Sites(
            unit.at(positions),
            np.array([np.column_stack([p.normal, p.frame]) for p in pieces]),
            np.full(FINGERS, off.friction),
            np.zeros((FINGERS, 1, 2)),
            np.full(FINGERS, shift / math.cos(math.pi / DISC_SIDES) / unit.scale),
            slide / unit.scale + depth / math.cos(off.turn),
        )
        for least, cover in _covers(sites, math.atan(off.friction) - lean, cones):
            found = made(lower=0.0, slides=slide, shift=shift, least_friction=least, cover=cover)
            found = replace(found, lower=max(0.0, bound(found) - CHANCE_ROUNDING))
            if best is None or found.lower > best.lower:
                best = found
            if chance_of_turning(found) <= SMALL_CHANCE:
                return best
    return best or f"no proof of closure around the contacts was found with {cones} cones"


def usual_bound(body: Polyhedron, grasp: Grasp, friction: float) -> PlacementProbability | str:
    """Bound the chance of closure if the object is off as rankings assume, or say why not.

    Raises:
        InputError: The contacts are not on the faces.
    """
    off = misplacement(friction, fitted(OFF_M, body.radius), OFF_RAD)
    return placement_bound(body, grasp, off)


def _covers(sites: Sites, angle: float, cones: int) -> Iterator[tuple[float, TwistCover]]:
    """Yield covers with less and less friction, from the tangent of half an angle on."""
    least, most = 0.0, angle
    for _ in range(ANGLE_HALVINGS):
        middle = 0.5 * (least + most)
        friction = math.tan(middle)
        here = sites._replace(friction=np.full(FINGERS, friction))
        cover, _ = search_cover(here, twist_axes(*here[:3]), cones)
        if cover is None:
            least = middle
        else:
            most = middle
            yield friction, cover


def _seen(
    piece: FacePiece, x: Array, surface: Array, slack: float, height: float, slope: float
) -> Array:
    """Cut from a piece what triangles (t, 3, 3) in front of it may hide, (c, 2); (0, 2) if x is.

    Triangles within `slack` of the plane are the face itself. `height` is that from which fingers
    come, and `slope` the tangent of their largest angle to the normal.
    """
    corners, y = piece.corners, piece.in_plane(x)
    heights = (x - surface) @ piece.normal
    ahead = (heights.max(axis=1) > IN_FRONT) & (heights.min(axis=1) < height)
    ahead &= np.abs(heights).max(axis=1) > slack
    flat = (surface[ahead] - piece.origin) @ piece.frame
    for triangle in np.concatenate([flat, heights[ahead][..., None]], axis=2):
        part = clip(triangle, IN_FRONT_ROW, np.array([-IN_FRONT]))
        at, above = part[:, :2], part[:, 2]
        sides = at - np.roll(at, 1, axis=0)
        across = np.column_stack([-sides[:, 1], sides[:, 0]])
        ways = np.vstack([at - y, across, -across])
        ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), LEAST_INRADIUS)
        ways = np.vstack([piece.E, ways])
        along = ways @ at.T
        limits = np.maximum((along - slope * above).min(1), along.min(1) - slope * height)
        left, moved = limits - ways @ y, piece.b - limits[: len(piece.b)]
        best = first_best(-moved) if moved.min() <= EDGE_MOVED else first_best(left, 0.0)
        if left[best] <= 0.0:
            return np.empty((0, 2))
        corners = tidy(clip(corners, ways[best : best + 1], limits[best : best + 1]))
    return corners
