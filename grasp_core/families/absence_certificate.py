"""Proves that no contacts on four convex faces are in force closure (absence).

Solved: given four convex pieces of faces and a friction, no four contacts on them, one on each, are
in force closure. The proof is a list of parts with a separating twist each.

A part is made by cuts: each cuts the longest of four polygons in half and keeps one half. A force
at a point of a convex polygon is a convex combination of the same force at its corners. So a twist
that separates contacts at *all corners* of a part separates all contacts on that part, and if the
parts cover the pieces there are no contacts left. `free` finds such proofs, or a grasp.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grasp_core.allowed_values import FrictionOrZero
from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.declared import Declared, declared
from grasp_core.geometry.polygons import clip
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.ties import first_best

MOST_CUTS_IN_A_ROW = 1000
"""Largest number of cuts in a row: more leave parts smaller than floating-point numbers can tell
apart."""
PartCorners = tuple[Array, ...]
"""Corners of a convex part of each piece, each (k, 2) in the plane coordinates of its piece."""
Path = tuple[int, ...]
"""The half, 0 or 1, that was kept at each cut."""
SAME_CORNERS = 1e-12
"""Distance of a proof's contacts from the corners of its part that counts as rounding."""


@declared
class Absence(Declared):
    """A proof that no four contacts on four convex pieces are in force closure."""

    pieces: tuple[FacePiece, FacePiece, FacePiece, FacePiece]
    friction: FrictionOrZero
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
                self.is_sound()
                and _cover_everything([path for path, _ in self.leaves])
                and all(self._separated(path, proof) for path, proof in self.leaves)
            )

    def _separated(self, path: Path, proof: ClosureCertificate) -> bool:
        # a twist that separates at more friction separates at less
        if proof.closed or not proof.verify() or float(proof.friction.min()) < self.friction:
            return False
        points, normals = corner_contacts(self.pieces, part_at(self.pieces, path))
        return (
            proof.positions.shape == points.shape
            and float(np.abs(proof.positions - points).max()) <= SAME_CORNERS
            and float(np.abs(proof.normals - normals).max()) <= SAME_CORNERS
            and replace(proof, positions=points, normals=normals).separates()
        )


def corner_contacts(pieces: Sequence[FacePiece], part: PartCorners) -> tuple[Array, Array]:
    """Put contacts at all corners of a part; return positions and normals, each (k, 3)."""
    points = [p.places(corners) for p, corners in zip(pieces, part, strict=True)]
    normals = [np.tile(p.normal, (len(c), 1)) for p, c in zip(pieces, part, strict=True)]
    return np.vstack(points), np.vstack(normals)


def part_at(pieces: Sequence[FacePiece], path: Path) -> PartCorners:
    """Return the part reached by a path, which cuts the polygon with the longest diagonal."""
    part = [piece.corners for piece in pieces]
    for half in path:
        spans = [_longest(corners) for corners in part]
        widest = first_best([length for length, _ in spans])
        along, sign = spans[widest][1], 1.0 if half == 0 else -1.0
        heights = part[widest] @ along
        middle = 0.5 * float(heights.min() + heights.max())
        part[widest] = clip(part[widest], sign * along[None], np.array([sign * middle]))
    return tuple(part)


def _cover_everything(paths: Sequence[Path]) -> bool:
    """Return whether paths name parts, none inside another, that together make up the whole."""
    if not all(len(path) <= MOST_CUTS_IN_A_ROW and set(path) <= {0, 1} for path in paths):
        return False
    apart = not any(
        two[: len(one)] == one
        for i, one in enumerate(paths)
        for j, two in enumerate(paths)
        if i != j
    )
    # a part after k cuts is 2^-k of the whole; whole numbers keep the sum exact
    deepest = max((len(path) for path in paths), default=0)
    shares = sum(1 << (deepest - len(path)) for path in paths)
    return apart and shares == 1 << deepest


def _longest(corners: Array) -> tuple[float, Array]:
    """Return length and unit direction of the longest line between two corners."""
    between = (corners[:, None] - corners[None]).reshape(-1, 2)
    lengths = np.linalg.norm(between, axis=1)
    far = first_best(lengths)
    return float(lengths[far]), between[far] / lengths[far]
