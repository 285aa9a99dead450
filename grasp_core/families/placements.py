"""Holds the result of a construction: contacts with the forces that prove them, or a bound.

Lengths are in the pieces' units, where the object has size one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cones.spanning import balancing_weights
from grasp_core.objects.face_pieces import FacePiece


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Four contacts, one on each piece, and the forces that hold them."""

    positions: Array
    """Contact points, (4, 3)."""
    forces: Array
    """Balanced forces along the witness lines, normal parts summing to one, (4, 3)."""
    foci: Array
    """Points where lines of force meet, (k, 3): one for a concurrent grasp, two for a pencil; for a
    regulus the points midway between the two lines of each pair, or none."""
    radii: Array
    """Radius of the independent disc around each contact, (4,); zeros where no disc is claimed."""
    merit: float
    """The quantity that the construction maximised, such as the smallest disc radius."""
    planned: Array | None = None
    """Forces for which the contacts were chosen, (4, 3); None if they are those of `forces`."""


@dataclass(frozen=True, slots=True, eq=False)
class NoPlacement:
    """The answer of a construction that finds no contacts on these pieces.

    `bound` is the largest merit that its programs' multipliers allow; minus infinity where only
    some slopes were tried.
    """

    bound: float


def balanced_forces(pieces: Sequence[FacePiece], directions: Array) -> Array:
    """Scale four positively spanning directions to forces whose sum is zero, (4, 3)."""
    forces = balancing_weights(directions)[:, None] * directions
    normals = np.array([piece.normal for piece in pieces])
    return forces / float(np.einsum("ki,ki->", forces, normals))


def focus_direction(axes: Array) -> Array:
    """Compute the direction u of the line through both foci of a pencil, (..., 3).

    The first focus belongs to fingers 0 and 1, the second to fingers 2 and 3. The direction lies in
    the planes of both pairs, and the first pair pushes along it: with positive weights lam of sum
    lam a = 0, u points along w = lam_0 a_0 + lam_1 a_1 = -lam_2 a_2 - lam_3 a_3.

    Takes `axes` (..., 4, 3).
    """
    first = np.einsum("...i,...ij->...j", balancing_weights(axes)[..., :2], axes[..., :2, :])
    w = np.asarray(first, dtype=np.float64)
    return w / np.linalg.norm(w, axis=-1, keepdims=True)
