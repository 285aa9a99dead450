"""Moves a grasp's contacts on its four faces to where the Ferrari-Canny quality is larger.

Each contact stays on the convex piece of a face that it is on.

The climb of `ascent` has many local optima, so it starts from the grasp's own contacts and from
random ones. The best result is certified like any grasp, and replaces the given grasp only if it is
proved to be better: its lower bound must exceed the given grasp's upper bound.

Moved contacts keep a finger's radius from the edges of their faces, or half the radius of the
largest disc in the face where that is less. Where the caller gives no radius, they may also come as
near to an edge as the given contact on that face is. With a radius, a contact that is nearer to an
edge is first moved away from it; the grasp stays as it is if no contacts at this distance are
better.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from grasp_core.allowed_values import SMALLEST, Friction, Seed, number, value_of
from grasp_core.arrays import Array
from grasp_core.by_value import ByValue
from grasp_core.errors import InputError
from grasp_core.families.free import closed_at, of_general_type
from grasp_core.families.placing import point_regions
from grasp_core.objects.face_pieces import FacePiece, deepest, inset_piece, pieces_by_face
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.ascent import ContactFaces
from grasp_core.planning.certify import Candidate, certify_each, to_grasp
from grasp_core.quality.ferrari_canny import FerrariCanny, ferrari_canny
from grasp_core.solvers.ties import coarse, largest_first, on_grid, surpassing
from grasp_core.values import FINGERS, ForceCone, Grasp

FINGER_RADIUS = 0.05
"""Default radius of a finger, in object radii: half the radius of a fingertip in the scenes."""
RANDOM_STARTS = 3
"""Number of random contact sets, the best of `RANDOM_TRIALS`, from which the climb starts besides
the grasp itself."""
RANDOM_TRIALS = 24
START_DIGITS = 8
"""Digits after the point to which the grasp's contacts are rounded before the climb, at unit size.
"""
STARTS_GAP = 2e-2
"""Largest gap between the bounds of a quality while starting points are compared."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Improvement(ByValue):
    """A grasp moved on its faces, with the proved bounds of its quality before and after."""

    grasp: Grasp
    """The moved grasp; the given one where no better one was found."""
    before: FerrariCanny
    after: FerrariCanny
    clearances: tuple[float, ...]
    """Distance [m] that each contact had to keep from the edges of its face in the search, (4,)."""

    @property
    def gain(self) -> float:
        """Return the factor by which the quality has grown: the ratio of its lower bounds."""
        return self.after.lower / self.before.lower


def optimize_contacts(
    body: Polyhedron,
    grasp: Grasp,
    friction: float = 0.5,
    *,
    finger_radius: float | None = None,
    seed: int = 0,
) -> Improvement:
    """Move a grasp's contacts on their faces to raise its Ferrari-Canny quality (`l1`).

    Torques are taken about the centre of mass and divided by the object's radius.

    Args:
        body: The object.
        grasp: A grasp of the object, in force closure at this friction.
        friction: Coulomb coefficient at every contact.
        finger_radius: How far moved contacts stay from edges [m], or half the radius of the
            largest disc in a face if that is less. If None a twentieth of the object's radius or,
            where that is less, as far as the given contact on that face.
        seed: Seed of the random starting points.

    Returns:
        A certified grasp of quality no lower than the given one's. If moved, its witness is of the
        general type, a regulus, and it claims no regions.

    Raises:
        InputError: An argument is out of range, or the grasp is not one of the body at this
            friction.
        SolverError: A program's answer failed its check.
    """
    check_on_faces(body, grasp)
    value_of(Friction, friction, "friction")
    seed = value_of(Seed, seed, "seed")
    if finger_radius is not None:
        where = ", the object's radius in m, or None"
        number(finger_radius, "finger_radius", ge=SMALLEST, le=body.radius, where=where)
    before = _quality(body, grasp, friction)
    if before.lower <= 0.0:
        raise InputError(
            f"grasp {grasp.id} must be in force closure at friction {friction}; "
            "raise the friction or give another grasp"
        )
    pieces = pieces_under(body, grasp)
    at = _unit_points(body, grasp)
    if finger_radius is None:
        depths = [piece.inset(point) for piece, point in zip(pieces, at, strict=True)]
        insets = [min(FINGER_RADIUS, max(-coarse(-each, START_DIGITS), 0.0)) for each in depths]
    else:
        insets = [finger_radius / body.radius] * FINGERS
    clearances = tuple(float(body.radius * inset) for inset in insets)
    rooms = tuple(inset_piece(*chosen) for chosen in zip(pieces, insets, strict=True))
    faces = ContactFaces(rooms, friction)
    here = [_clear_of_edges(*on) for on in zip(rooms, at, strict=True)]
    rng = np.random.default_rng([seed, *grasp.faces])
    starts = [np.array(here), *_random_starts(faces, rng)]
    ends = [faces.climb(y) for y in starts]
    for place in largest_first([found.lower for _, found in ends]):
        y, found = ends[place]
        if found.lower <= surpassing(before.lower):
            break
        moved = certified(body, f"o-{grasp.id}", pieces, faces.positions(y), friction, rng)
        if moved is not None and ((after := _quality(body, moved, friction)).lower > before.upper):
            return Improvement(moved, before, after, clearances)
    return Improvement(grasp, before, before, clearances)


def _quality(body: Polyhedron, grasp: Grasp, friction: float) -> FerrariCanny:
    return ferrari_canny(
        grasp, friction=friction, center=body.center_of_mass, torque_scale=body.radius
    )


def pieces_under(body: Polyhedron, grasp: Grasp) -> tuple[FacePiece, ...]:
    """Return the piece of a face that each contact is deepest in, the first of equal ones."""
    pieces = pieces_by_face(body)
    return tuple(
        deepest(pieces[face], point)
        for face, point in zip(grasp.faces, _unit_points(body, grasp), strict=True)
    )


def _unit_points(body: Polyhedron, grasp: Grasp) -> Array:
    return (grasp.positions - body.center_of_mass) / body.radius


def _clear_of_edges(room: FacePiece, point: Array) -> Array:
    """Move a point in the plane of a face towards the middle of its room until inside, (2,)."""
    y, middle = on_grid(room.in_plane(point), START_DIGITS), room.corners.mean(axis=0)
    beyond = room.E @ y - room.b
    inward = room.E @ (y - middle)
    share = float((beyond[beyond > 0.0] / inward[beyond > 0.0]).max(initial=0.0))
    return y + min(share, 1.0) * (middle - y)


def _random_starts(faces: ContactFaces, rng: np.random.Generator) -> Iterator[Array]:
    trials = [
        np.array(
            [rng.dirichlet(np.ones(len(room.corners))) @ room.corners for room in faces.pieces]
        )
        for _ in range(RANDOM_TRIALS)
    ]
    rated = np.array([faces.quality(y, STARTS_GAP).lower for y in trials])
    best = largest_first(rated)
    return (trials[i] for i in best[:RANDOM_STARTS] if rated[i] > 0.0)


def certified(
    body: Polyhedron, name: str, pieces: tuple[FacePiece, ...], points: Array, friction: float,
    rng: np.random.Generator,
) -> Grasp | None:  # fmt: skip
    """Return the grasp at points, (4, 3) at unit size, or None where no certificate confirms it."""
    plain = closed_at(pieces, points, friction, 0.0)
    placement = plain and of_general_type(pieces, plain, friction, rng)
    if placement is None:
        return None
    a, b, c, d = (piece.face for piece in pieces)
    cones = tuple(ForceCone(piece.normal, math.atan(friction)) for piece in pieces)
    candidate = Candidate(
        name, (a, b, c, d), "regulus", pieces, cones, placement, point_regions(placement)
    )
    (found,) = certify_each([candidate], friction)
    return None if found is None else to_grasp(body, friction, found)
