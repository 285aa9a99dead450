"""Finds grasps of any type on four convex faces, or a proof that there is none (free method).

Solved: whether any four contacts, one on each of four convex faces, are in force closure at a
given friction, at any friction and for any normals.

Derivation. Put a contact at every corner of the four faces: the corner contacts. A force at any
point of a convex face is a convex combination of the same force at its corners, so

    four contacts on the faces in force closure  =>  the corner contacts in force closure. (1)

A separating twist of the corner contacts is therefore a proof of absence; by convexity of the
supports it separates every grasp on these faces.

If the patch is closed, its forces, added up face by face, say where four contacts balance
(`free_contacts`). If no contacts are found in this way, patches of smaller random pieces of the
faces are tried, which give other forces (2). What is still open can be split (3): each face
quadruple is cut through its longest face, parts are dropped with their proof of absence, until a
grasp is found, nothing is left, or the budget is spent.

Nothing here depends on P3. The lines of force are of the most general type, as a rule a
regulus, with u, slopes and pitch free; so this also answers the freedom that the paper leaves
unused when it fixes the direction u (its section 4).

Source: Sudsang & Ponce 1995, Propositions 1 and 3; the relaxation by many contacts on a face
is that of Omata's virtual fingers (1991), the rest is this project's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np

from grasp_core.arrays import are_frictions, is_a, is_tuple_of
from grasp_core.by_value import ByValue
from grasp_core.closure.batches.certificates import certificates
from grasp_core.closure.force_closure import ClosureCertificate, force_closure
from grasp_core.errors import InputError, UndecidedError
from grasp_core.families.face_parts import (
    Corners,
    Path,
    corner_contacts,
    cover_everything,
    is_path,
    part_at,
    random_parts,
)
from grasp_core.families.free_contacts import grasp_from_patch, of_general_type
from grasp_core.families.placements import Placement
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.ties import graded
from grasp_core.values import FINGERS

RESTARTS = 12
"""Default number of smaller random patches that are tried."""
SAME_CORNERS = 1e-12
"""Distance of a proof's contacts from the corners of its part that counts as rounding."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Absence(ByValue):
    """A proof that no four contacts on four convex pieces are in force closure."""

    pieces: tuple[FacePiece, ...]
    friction: float
    leaves: tuple[tuple[Path, ClosureCertificate], ...]
    """Parts that together cover the pieces, each with a twist that separates contacts at all its
    corners."""

    def verify(self) -> bool:
        """Check every field again in plain arithmetic.

        This checks that the pieces are convex polygons, and that the parts cover them and are all
        separated. Whoever has the object checks that the pieces are parts of its faces.
        """
        with np.errstate(all="ignore"):
            return (
                are_frictions(np.array([self.friction]), 1)
                and is_tuple_of(self.pieces, FacePiece, FINGERS)
                and all(piece.sound() for piece in self.pieces)
                and is_tuple_of(self.leaves, tuple)
                and all(len(leaf) == len(("path", "proof")) for leaf in self.leaves)
                and all(is_path(path) for path, _ in self.leaves)
                and cover_everything([path for path, _ in self.leaves])
                and all(self._separated(path, proof) for path, proof in self.leaves)
            )

    def _separated(self, path: Path, proof: ClosureCertificate) -> bool:
        if not is_a(proof, ClosureCertificate) or proof.closed is not False:
            # a twist that separates at more friction separates at less
            return False
        if not proof.verify() or float(proof.friction.min()) < self.friction:
            return False
        points, normals = corner_contacts(self.pieces, part_at(self.pieces, path))
        return (
            proof.positions.shape == points.shape
            and float(np.abs(proof.positions - points).max()) <= SAME_CORNERS
            and float(np.abs(proof.normals - normals).max()) <= SAME_CORNERS
            and replace(proof, positions=points, normals=normals).separates()
        )


@dataclass(frozen=True, slots=True)
class Undecided:
    """The answer when the free method found neither a grasp nor a proof within its budget."""

    open_parts: int
    open_share: float
    """Share of all choices of contacts that is undecided, where each cut counts for half."""


def place_free(
    pieces: Sequence[FacePiece],
    friction: float,
    *,
    rng: np.random.Generator,
    cells: int = 1,
    restarts: int = RESTARTS,
    whole: ClosureCertificate | None = None,
) -> Placement | Absence | Undecided:
    """Find a grasp of four convex pieces, or prove that there is none."""
    if not friction > 0.0:
        raise InputError(f"friction must be greater than 0, got {friction}")
    leaves: list[tuple[Path, ClosureCertificate]] = []
    waiting: list[tuple[float, Path]] = [(0.0, ())]
    examined = 0
    while waiting and examined < cells:
        _, path = heappop(waiting)
        part = part_at(pieces, path)
        known = None if path else whole
        patch = close_patch(pieces, part, friction) if known is None else known
        examined += 1
        # (1): this part holds no grasp
        if patch is not None and not patch.closed:
            leaves.append((path, patch))
            continue
        found = grasp_from_patch(pieces, part, patch, friction) if patch is not None else None
        # (2), once for the whole pieces
        if found is None and not path:
            found = _restarted(pieces, friction, rng, restarts)
        if found is not None:
            general = of_general_type(pieces, found, friction, rng)
            return general or Undecided(len(waiting) + 1, _share([*waiting, (0.0, path)]))
        margin = patch.margin if patch is not None else 0.0
        # (3): parts with the largest margin are examined first
        for half in (0, 1):
            heappush(waiting, (-graded(margin), (*path, half)))
    if waiting:
        return Undecided(len(waiting), _share(waiting))
    return Absence(tuple(pieces), friction, tuple(leaves))


def _share(waiting: Sequence[tuple[float, Path]]) -> float:
    return sum(0.5 ** len(path) for _, path in waiting)


def close_patch(
    pieces: Sequence[FacePiece], part: Corners, friction: float
) -> ClosureCertificate | None:
    """Decide force closure of contacts at all corners of a part; None if too close to call."""
    try:
        return force_closure(*corner_contacts(pieces, part), friction)
    except UndecidedError:
        return None


def close_patches(
    quadruples: Sequence[Sequence[FacePiece]], friction: float
) -> list[ClosureCertificate | None]:
    """Decide force closure of contacts at all corners of many sets of four pieces, at once.

    Gives a certificate for each, or None where `close_patch` has to decide.
    """
    contacts = [corner_contacts(pieces, part_at(pieces, ())) for pieces in quadruples]
    sizes = np.array([len(points) for points, _ in contacts], dtype=np.int64)
    found: list[ClosureCertificate | None] = [None] * len(quadruples)
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size).tolist()
        points, normals = (np.array([contacts[i][each] for i in alike]) for each in (0, 1))
        for place, known in zip(alike, certificates(points, normals, friction), strict=True):
            found[place] = known
    return found


def _restarted(
    pieces: Sequence[FacePiece], friction: float, rng: np.random.Generator, restarts: int
) -> Placement | None:
    for part in random_parts(pieces, rng, restarts):
        patch = close_patch(pieces, part, friction)
        if patch is not None and (found := grasp_from_patch(pieces, part, patch, friction)):
            return found
    return None
