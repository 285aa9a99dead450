"""Chooses force cones for sets of four faces, and bounds the discs that such cones allow.

A force cone holds the directions in which a finger may push, inside its friction cone. A disc is
the region around a contact in which it may move while the grasp stays good.

Cones around the normals, as in the paper, are planned at theta_plan = min(theta, just below the
span angle theta*): these smaller cones lie inside the real ones, so what holds for them holds at
the friction asked for. Tilted cones are an alternative, and for most quadruples the only one.

Quadruples are rows: faces (q, 4), axes of both choices of cones (q, 2, 4, 3), angles [rad]; bounds
on discs are in object radii.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.cones.spanning import span_sines
from grasp_core.cones.tilting import tilted_cones, toward, widened, widest_half_angles
from grasp_core.families.disc_bounds import (
    angle_limits,
    corners_of,
    disc_limits,
    distances,
    widths_apart,
)
from grasp_core.families.placements import LEAST_RADIUS, Corners, Placement
from grasp_core.families.placing import Cones
from grasp_core.objects.face_pieces import FacePiece, Shapes
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import ForceCone, four

LEAST_SPAN_ANGLE = math.atan(LEAST_RADIUS)
"""Least half-angle to plan with [rad]: narrower cones hold no disc that counts at a depth of one
object radius."""
BELOW_SPAN_ANGLE = 0.999
"""Share of the span angle theta* to plan with: P3 is a strict inequality."""
INSIDE_FRICTION = 1.0 - 1e-6
"""Share of the friction angle to plan with, so that equilibrium is not marginal."""
NORMAL, TILTED = 0, 1
"""Indices of the two choices of force cones."""


@dataclass(frozen=True, eq=False)
class PlannedCones:
    """Chooses force cones for the face quadruples of one object."""

    body: Polyhedron
    shapes: Shapes
    theta: float  # half-angle of the friction cones to plan with [rad]
    tilted: bool  # whether cones may also be tilted away from the normals

    @cached_property
    def rooms(self) -> Array:
        """Return the radius of the largest disc in each face, or zero, (f,) [object radii]."""
        return np.array(
            [max(p.inradius for p in shape.pieces) if shape else 0.0 for shape in self.shapes]
        )

    def widest(self, quads: Indices) -> Array:
        """Return upper bounds on the half-angles of any choice of force cones, (q,) [rad]."""
        normals, thetas = self.normals[quads], self._thetas[quads]
        sines = span_sines(normals)
        around = _around(sines, thetas)
        if not self.tilted:
            return around
        return np.maximum(around, widest_half_angles(normals, thetas, sines))

    def limits(self, quads: Indices, widest: Array) -> Array:
        """Return upper bounds on discs for cones no wider than `widest`, (q, 4), see `disc_limits`.

        With psi the half-angle, theta the friction angle and h half the angle between two normals,
        narrower cones may lean more, so the bound tan(psi / 2) / sin(h - theta + psi) of a pair has
        to hold for all psi up to the widest w. Where h >= theta it grows with psi, as
        1 / sin(psi) is above cot(h - theta + psi). Where h < theta, cones that positively span (P3)
        still never overlap: half the angle between their axes is above psi, so the true bound is
        below tan(psi / 2) / sin(psi) = 1 / (2 cos^2(psi / 2)), and the bound of w is above this.
        """
        extent = float(np.linalg.norm(self._corners.points, axis=-1).max(initial=0.0))
        leaning = np.maximum(self._thetas[quads].max(axis=1, initial=0.0) - widest, 0.0)
        widths = widths_apart(quads, self._distances, self._halves, leaning)
        return angle_limits(extent, widths, widest)

    def chosen(self, quads: Indices) -> tuple[Array, Array, Array]:
        """Choose cones around normals and tilted: axes (q, 2, 4, 3), half-angles or 0 (q, 2).

        Also gives upper bounds on the discs of both, (q, 2, 4), see `disc_limits`.
        """
        normals, thetas = self.normals[quads], self._thetas[quads]
        axes = [normals, normals]
        half_angles = [_around(span_sines(normals), thetas), np.zeros(len(quads))]
        if self.tilted:
            leaning = tilted_cones(normals, thetas)
            axes[TILTED] = leaning.axes
            half_angles[TILTED] = BELOW_SPAN_ANGLE * leaning.half_angles
        limits = [
            disc_limits(self._corners, self.normals, quads, axes[kind], half_angles[kind])
            for kind in range(1 + self.tilted)
        ]
        return (
            np.stack(axes, axis=1),
            np.stack(half_angles, axis=1),
            np.stack([limits[NORMAL], limits[-1]], axis=1),
        )

    @cached_property
    def normals(self) -> Array:
        """Return the inward unit normals of all faces, (f, 3)."""
        return self.body.normals

    @cached_property
    def _distances(self) -> Array:
        return distances(self._corners)

    @cached_property
    def _halves(self) -> Array:
        """Return half the angle between every two face normals, (f, f) [rad]."""
        apart = np.linalg.norm(self.normals[:, None] - self.normals, axis=-1)
        return np.arcsin(np.minimum(0.5 * apart, 1.0))

    @cached_property
    def _thetas(self) -> Array:
        spreads = np.array([face.spread for face in self.body.faces])
        return usable_half_angles(self.theta, spreads)

    @cached_property
    def _corners(self) -> Corners:
        return corners_of(self.body)


def usable_half_angles(theta: float, spreads: Array) -> Array:
    """Compute half-angles inside friction cones all over a patch, too small where it leans."""
    return np.maximum(INSIDE_FRICTION * theta - spreads, 0.5 * LEAST_SPAN_ANGLE)


def cones_around(
    placed: Sequence[tuple[Sequence[FacePiece], Placement]], theta: float
) -> list[tuple[Cones, ...]]:
    """Choose tilted cones: towards the faces' or the object's middle, or around the forces."""
    normals = np.array([[piece.normal for piece in pieces] for pieces, _ in placed])
    spreads = np.array([[piece.spread for piece in pieces] for pieces, _ in placed])
    thetas = usable_half_angles(theta, spreads)
    middles = np.array(
        [[piece.point(piece.corners.mean(axis=0)) for piece in pieces] for pieces, _ in placed]
    )
    forces = np.array([at.forces if at.planned is None else at.planned for _, at in placed])
    kinds = (
        toward(middles.mean(axis=1), middles, normals, thetas),
        toward(np.zeros((len(placed), 3)), middles, normals, thetas),
        widened(forces, normals, thetas),
    )
    return [
        tuple(
            four(ForceCone(axis, angle) for axis in kind.axes[place])
            for kind in kinds
            if (angle := BELOW_SPAN_ANGLE * float(kind.half_angles[place])) > LEAST_SPAN_ANGLE
        )
        for place in range(len(placed))
    ]


def _around(sines: Array, thetas: Array) -> Array:
    """Compute half-angles of cones around normals from sines of span angles, (q,) [rad]."""
    spanned = BELOW_SPAN_ANGLE * np.arcsin(np.maximum(sines, 0.0))
    return np.minimum(thetas.min(axis=1, initial=np.inf), spanned)
