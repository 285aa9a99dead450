"""How large the discs of many attempts can be: one small program each, solved in compiled code.

An attempt is four faces in the order of the fingers with a force cone each. Its bound is the value
of the first program of `largest_discs`, which maximises the smallest radius, on the convex hulls of
the faces: no choice of their pieces offers more. Without kernels the constructions themselves are
asked, at a hundred times the cost.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array
from grasp_core.concurrent_grasps import PYRAMID_SIDES, facet_turns
from grasp_core.constructions import LEAST_RADIUS, Construction
from grasp_core.errors import SolverError
from grasp_core.face_pieces import FacePiece, Shapes
from grasp_core.kernels import compiled
from grasp_core.kernels.tables import Attempts, FaceTable
from grasp_core.lp import RESIDUAL
from grasp_core.placements import Placement
from grasp_core.values import Family, ForceCone, four

KERNELS: dict[Family, str] = {"concurrent": "concurrent", "pencil": "pencils"}


@dataclass(frozen=True, eq=False)
class DiscBounds:
    """Bounds for attempts on the faces of one object."""

    shapes: Shapes

    def of(self, construction: Construction, attempts: Attempts, least: float) -> Array:
        """Upper bounds on the smallest radius, (a,), in object radii; infinite if none is proved.

        Args:
            construction: With discs.
            attempts: On faces with room, in finger order, with cones that positively span (P3).
            least: Smaller discs do not matter; their bounds are the best ones or this at most.
        """
        kernel = compiled(KERNELS[construction.family])
        if kernel is None:
            return self._by_constructions(construction, attempts, least)
        attempts = Attempts(
            np.ascontiguousarray(attempts.faces),
            np.ascontiguousarray(attempts.axes),
            np.ascontiguousarray(attempts.half_angles),
        )
        bounds = np.empty(len(attempts.faces))
        if construction.family == "pencil":
            kernel.pencil_bounds(self._table, attempts, LEAST_RADIUS, least, bounds)
        else:
            turns = np.array(facet_turns(PYRAMID_SIDES))
            kernel.concurrent_bounds(self._table, attempts, turns, least, bounds)
        return bounds + RESIDUAL

    def _by_constructions(
        self, construction: Construction, attempts: Attempts, least: float
    ) -> Array:
        bounds = np.empty(len(attempts.faces))
        for place, (faces, axes, half_angle) in enumerate(zip(*attempts, strict=True)):
            hulls = [self._hull(int(face)) for face in faces]
            cones = four(ForceCone(axis, float(half_angle)) for axis in axes)
            try:
                found = construction.place(hulls, cones, least)
            except SolverError:
                bounds[place] = np.inf
                continue
            bounds[place] = found.merit if isinstance(found, Placement) else found.bound
        return bounds + RESIDUAL

    def _hull(self, face: int) -> FacePiece:
        shape = self.shapes[face]
        if shape is None:
            raise IndexError(f"face {face} has no room for a contact")
        return shape.hull

    @cached_property
    def _table(self) -> FaceTable:
        """The hulls as the kernel wants them, in one array per property."""
        hulls = {face: shape.hull for face, shape in enumerate(self.shapes) if shape}
        count, most = len(self.shapes), max((len(hull.E) for hull in hulls.values()), default=0)
        table = FaceTable(
            normals=np.zeros((count, 3)),
            origins=np.zeros((count, 3)),
            frames=np.zeros((count, 3, 2)),
            E=np.zeros((count, most, 2)),
            b=np.zeros((count, most)),
            edges=np.zeros(count, dtype=np.int64),
            corners=np.zeros((count, most, 3)),
            depths=np.zeros(count),
        )
        for face, hull in hulls.items():
            table.normals[face], table.origins[face] = hull.normal, hull.origin
            table.frames[face], table.depths[face] = hull.frame, hull.depth
            table.edges[face] = len(hull.E)
            table.corners[face, : len(hull.E)] = hull.origin + hull.corners @ hull.frame.T
            table.E[face, : len(hull.E)], table.b[face, : len(hull.b)] = hull.E, hull.b
        return table
