"""Bounds from above the Ferrari-Canny quality of all contacts on four faces.

Solved: how much better than a known grasp any other on the same faces can be.

Derivation. In any direction y the support of a contact's cone,

    n.v + mu |tangential part of v|,  with v the velocity of the contact under y,             (1)

is convex in the contact's position. On a product of convex parts of the faces it is therefore
largest at corners, and contacts at all corners together have a quality no smaller than any four
contacts in the parts. The support of all corners in a single direction, any one, is an upper bound
already.

Branch and bound: the part with the highest bound is cut through its longest face, until all are
near the target. Directions that bound one part well often bound its neighbours, so all found so far
are tried before another is searched.

The bound is for contacts that keep clear of the edges as `better_contacts` keeps them; a grasp
nearer to an edge may have a larger quality. Faces that are not convex count as a whole, up to their
borders.

Every part left carries its direction, so the bound can be checked again in plain arithmetic.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from heapq import heappop, heappush
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen_each
from grasp_core.by_value import ByValue
from grasp_core.checked import LARGEST, coefficient, number, several, whole
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.closure.wrenches import WRENCH
from grasp_core.errors import InputError
from grasp_core.families.face_parts import Path, corner_contacts, cover_everything, is_path, part_at
from grasp_core.fields import are_frictions, are_units, is_a, is_number, is_tuple_of
from grasp_core.objects.face_pieces import FacePiece, inset_piece, pieces_by_face
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.better_contacts import FINGER_RADIUS
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.solvers.ties import first_best, graded
from grasp_core.values import FINGERS, FaceQuadruple

PART_GAP = 0.02
"""Largest gap between the bounds of the quality of corner contacts: smaller gaps do not help while
parts are large."""
MOST_PARTS = 1_000_000
ENOUGH = 0.01
"""Parts whose bound is within this share of the known quality are not cut any more."""
BOUND_SLACK = 1e-9
"""How far a part's bound may exceed the ceiling, relative to it or to one newton."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Leaf(ByValue):
    """A part of the faces that is not divided, with the direction that bounds its quality."""

    choice: int
    """Index of a combination of convex pieces, one piece per face."""
    path: Path
    """Divisions that lead from the whole pieces to this part."""
    direction: Array
    """Unit twist in which the support of all corner contacts bounds the quality, (6,)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class QualityCeiling(ByValue):
    """A proved bound `upper` on the quality of all contacts on four faces, clear of the edges."""

    upper: float
    choices: tuple[tuple[FacePiece, ...], ...]
    """Combinations of convex pieces, one piece per face, without the margins along edges, at unit
    size."""
    friction: float
    leaves: tuple[Leaf, ...]

    def verify(self) -> bool:
        """Check every field again in plain arithmetic.

        The check is that the pieces are convex polygons, that the parts cover them, and that all
        are bounded, to within `BOUND_SLACK`. Whether the pieces are those of an object's faces can
        only be checked with the object.
        """
        with np.errstate(all="ignore"):
            return (
                is_number(self.upper)
                and are_frictions(np.array([self.friction]), 1)
                and is_tuple_of(self.choices, tuple)
                and len(self.choices) > 0
                and all(is_tuple_of(choice, FacePiece, FINGERS) for choice in self.choices)
                and is_tuple_of(self.leaves, Leaf)
                and all(piece.sound() for piece in self._pieces())
                and all(self._fits(leaf) for leaf in self.leaves)
                and self._covers()
                and all(
                    self._bound(leaf) <= self.upper + BOUND_SLACK * max(self.upper, 1.0)
                    for leaf in self.leaves
                )
            )

    def _pieces(self) -> Iterable[FacePiece]:
        return {id(piece): piece for choice in self.choices for piece in choice}.values()

    def _fits(self, leaf: Leaf) -> bool:
        return (
            is_a(leaf.choice, int)
            and 0 <= leaf.choice < len(self.choices)
            and is_path(leaf.path)
            and are_units(leaf.direction, WRENCH)
        )

    def _covers(self) -> bool:
        return all(
            cover_everything([leaf.path for leaf in self.leaves if leaf.choice == index])
            for index in range(len(self.choices))
        )

    def _bound(self, leaf: Leaf) -> float:
        corners = _corner_wrenches(self.choices[leaf.choice], leaf.path, self.friction)
        unit = leaf.direction / np.linalg.norm(leaf.direction)
        return float(corners.support(unit)[0])


def quality_ceiling(
    body: Polyhedron,
    faces: FaceQuadruple,
    friction: float = 0.5,
    *,
    known: float = 0.0,
    finger_radius: ArrayLike | None = None,
    parts: int = 200,
) -> QualityCeiling:
    """Find an upper bound on the `l1` quality of all contacts on four faces.

    Torques are taken about the centre of mass and divided by the object's radius, as in
    `optimize_contacts`.

    Args:
        body: The object.
        faces: Indices of four faces.
        friction: Coulomb coefficient at every contact.
        known: A quality that is attained [N], where bounding may stop.
        finger_radius: How far contacts stay from the edges of their faces [m], one for all faces
            or one each, such as an improvement's `clearances`; contacts nearer to an edge are not
            bounded. A twentieth of the object's radius if None.
        parts: How many parts of the faces to examine at most.

    Raises:
        InputError: An argument is out of range.
        SolverError: A program's answer failed its check.
    """
    check_body(body)
    friction = coefficient(friction)
    number(known, "known", least=0.0, most=LARGEST)
    whole(parts, "parts", least=1, most=MOST_PARTS)
    given = FINGER_RADIUS * body.radius if finger_radius is None else finger_radius
    radii = frozen_each(given, FINGERS, "finger_radius")
    if (radii < 0.0).any() or (radii > body.radius).any():
        raise InputError(
            f"finger_radius must be from 0 to the object's radius of {body.radius:.4g} m, got "
            f"{radii.tolist()}"
        )
    choices = _choices(body, faces, radii / body.radius)
    if parts < len(choices):
        raise InputError(
            f"parts must be at least {len(choices)}, one per combination of pieces, got {parts}"
        )
    directions: list[Array] = []
    waiting: list[tuple[float, int, Path, float, Array]] = []
    fresh: list[tuple[int, Path]] = [(index, ()) for index in range(len(choices))]
    examined = 0
    target = known * (1.0 + ENOUGH)
    while True:
        for index, path in fresh:
            bound, direction = _bounded(choices[index], path, friction, directions, target)
            heappush(waiting, (-graded(bound), index, path, bound, direction))
            examined += 1
        if waiting[0][3] <= target or examined + 2 > parts:
            break
        _, index, path, _, _ = heappop(waiting)
        fresh = [(index, (*path, half)) for half in (0, 1)]
    leaves = [Leaf(index, path, direction) for _, index, path, _, direction in waiting]
    upper = max(bound for _, _, _, bound, _ in waiting)
    return QualityCeiling(max(upper, 0.0), choices, friction, tuple(leaves))


def _choices(
    body: Polyhedron, faces: Sequence[int], insets: Array
) -> tuple[tuple[FacePiece, ...], ...]:
    each = partial(whole, name="faces", most=len(body.faces) - 1)
    given = several(faces, each, "faces", "indices")
    if len(given) != FINGERS:
        raise InputError(f"faces must be {FINGERS} indices of faces, got {len(given)}")
    pieces = pieces_by_face(body)
    by_face = [pieces[face] for face in given]
    if not all(by_face):
        raise InputError(
            f"faces {tuple(faces)}: one of them is too narrow for a contact; choose others"
        )
    # edges between the pieces of a face are no borders: contacts may lie on them
    rooms = [
        (inset_piece(one[0], inset),) if len(one) == 1 else one
        for one, inset in zip(by_face, insets.tolist(), strict=True)
    ]
    return tuple(product(*rooms))


def _bounded(
    choice: Sequence[FacePiece], path: Path, friction: float, directions: list[Array],
    target: float,
) -> tuple[float, Array]:  # fmt: skip
    """Bound a part from above, and return the direction; a new direction joins the list."""
    corners = _corner_wrenches(choice, path, friction)
    best, bounds = None, np.empty(0)
    if directions:
        bounds = corners.supports(np.array(directions))
        # a direction that bounded another part costs no search, so all are tried first
        best = first_best(-bounds)
        if bounds[best] <= target:
            return float(bounds[best]), directions[best]
    direction = wrench_set_quality(corners.on_grid(), PART_GAP).direction
    directions.append(direction)
    upper = corners.support(direction)[0]
    if best is not None and bounds[best] < upper:
        return float(bounds[best]), directions[best]
    # (1) at all corners in the new direction; an old one may still be better
    return upper, direction


def _corner_wrenches(choice: Sequence[FacePiece], path: Path, friction: float) -> WrenchSet:
    points, normals = corner_contacts(choice, part_at(choice, path))
    return WrenchSet.at(points, normals, np.full(len(points), friction))
