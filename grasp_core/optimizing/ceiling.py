"""Bounds from above the Ferrari-Canny quality of all contacts on four faces.

Solved: how much better than a known grasp any other on the same faces can be.

Derivation. The search for cuts that bounds the best grasp of an object (`support_cuts`) bounds
contacts on four faces as well: each finger begins on the convex pieces of its own face, and fingers
are not interchangeable. Of a row of bounds, each below the one before by the gap, the least that
can be refuted is sought, in growing steps from above and then by halving: a bound is not refuted if
there are contacts that reach it. So what comes out does not depend on the way of the search, unless
the number of cases is spent before.

The bound is for contacts that keep clear of the edges as `better_contacts` keeps them; a grasp
nearer to an edge may have a larger quality. Faces that are not convex count as a whole, up to their
borders.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen_each
from grasp_core.declared import Declared
from grasp_core.errors import InputError
from grasp_core.kinds import LARGEST, Cases, Friction, Range, number, several, value_of
from grasp_core.objects.face_pieces import inset_piece, pieces_by_face
from grasp_core.objects.on_faces import check_planar
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best_grasp import AIMED, FINER
from grasp_core.optimizing.better_contacts import FINGER_RADIUS
from grasp_core.optimizing.grounds import Grounds, grounds_on
from grasp_core.optimizing.search import Searching, Stop
from grasp_core.optimizing.support_cuts import LEAST_THRESHOLD, CutTree
from grasp_core.solvers.ties import few_digits
from grasp_core.values import FINGERS, FaceQuadruple

SMALLEST_GAP, LARGEST_GAP = 1e-3, 0.9
SMALLEST = 1e-5
"""Bound that is not lowered any more [N]."""
SEED = 0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
    number(known, "known", least=0.0, most=LARGEST)
    number(gap, "gap", least=SMALLEST_GAP, most=LARGEST_GAP)
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
    return QualityCeiling(searching.proof())


def _grounds(body: Polyhedron, faces: Sequence[int], insets: Array) -> tuple[Grounds, Indices]:
    each = partial(value_of, Annotated[int, Range(least=0, most=len(body.faces) - 1)], name="faces")
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
    searching.threshold = max(searching.threshold, LEAST_THRESHOLD)
    bounds = _bounds(searching.bound, known, gap)
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
    least, share = max(known, SMALLEST), 1.0 - AIMED * gap
    rising = [least / share if known >= SMALLEST else least]
    while rising[-1] < first * share:  # each is larger by `AIMED` of `SMALLEST_GAP` at least
        rising.append(rising[-1] / share)
    return [few_digits(bound, gap / FINER) for bound in rising[::-1] if bound < first]
