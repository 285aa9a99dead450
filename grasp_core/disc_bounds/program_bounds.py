"""Bounds the disc radii of many attempts from above, by small programs in compiled code.

An attempt is four faces in the order of the fingers, with a force cone each. Where a construction
has discs, the bound is the value of the first program of `largest_discs`, which maximises the
smallest radius, on the convex hulls of the faces: no choice of their pieces offers more. For
reguli the bound only says whether any slopes are feasible on the hulls.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns
from grasp_core.families.constructions import LEAST_RADIUS, Construction
from grasp_core.families.kernel_tables import Attempts, FaceTable, face_table
from grasp_core.families.regulus import regulus_bounds
from grasp_core.objects.face_pieces import Shapes
from grasp_core.solvers.lp import RESIDUAL
from grasp_core.values import Family

KERNELS: dict[Family, str] = {
    "concurrent": "grasp_core.disc_bounds.concurrent_kernel",
    "pencil": "grasp_core.disc_bounds.pencil_kernel",
}


@dataclass(frozen=True, eq=False)
class AttemptBounds:
    """Upper bounds on disc radii for attempts on one object's faces."""

    shapes: Shapes

    def of(self, construction: Construction, attempts: Attempts, least: float) -> Array:
        """Bound the smallest radius from above, (a,) [object radii]; infinite if not proved.

        For reguli the bounds are infinite or, where no slopes are feasible, minus infinity.
        """
        attempts = Attempts(
            np.ascontiguousarray(attempts.faces),
            np.ascontiguousarray(attempts.axes),
            np.ascontiguousarray(attempts.half_angles),
        )
        if construction.limits is None:
            return self._of_reguli(attempts)
        # hulls stand for faces of several pieces: they offer no less than any piece
        kernel = compiled(KERNELS[construction.family])
        bounds = np.empty(len(attempts.faces))
        if construction.family == "pencil":
            kernel.pencil_bounds(self._table, attempts, LEAST_RADIUS, least, bounds)
        else:
            turns = np.array(facet_turns(PYRAMID_SIDES))
            kernel.concurrent_bounds(self._table, attempts, turns, least, bounds)
        # a proved bound may be off by what the check of multipliers allows
        return bounds + RESIDUAL

    def _of_reguli(self, attempts: Attempts) -> Array:
        bounds = np.full(len(attempts.faces), np.inf)
        merits, _ = regulus_bounds(self._table, attempts, -np.inf)
        # merits are no radii: only a proof that excludes all slopes tells anything
        bounds[merits == -np.inf] = -np.inf
        return bounds

    @cached_property
    def _table(self) -> FaceTable:
        """Put the hulls of all faces into one table."""
        return face_table([shape.hull if shape else None for shape in self.shapes])
