"""Places contacts for many attempts of one construction at once, with the regions of the fingers.

An attempt is four convex pieces in the order of the fingers, with a force cone each. Compiled code
solves the programs of the concurrent and the pencil construction and checks its answers by their
residuals; what it does not prove is left to the construction itself, one attempt at a time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.by_value import trusted
from grasp_core.compiled import compiled
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns
from grasp_core.families.batches.placed import LEFT, PLACED, Footprints, Placed, room_for
from grasp_core.families.concurrent import BEFORE, BEHIND, MIXED_SIDES
from grasp_core.families.constructions import DISC_CORNERS, LEAST_RADIUS, MIXED, Construction
from grasp_core.families.kernel_tables import Attempts, FaceTable, face_table
from grasp_core.families.placements import Placement
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.values import (
    FINGERS,
    ContactRegion,
    FaceQuadruple,
    ForceCone,
    RegionKind,
    four,
)

ROOM = "grasp_core.families.batches"

Ask: TypeAlias = tuple[FaceQuadruple, Sequence[ForceCone], float]
"""One attempt: faces in finger order, a force cone on each, and the least radius that counts."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What compiled code says about one attempt: contacts with regions, or that there are none."""

    placement: Placement | None
    regions: tuple[ContactRegion, ...] | None
    """Regions of the fingers, in the pieces' units; None where they are left to the construction.
    """


@dataclass(frozen=True, eq=False)
class ManyPlacements:
    """Places contacts on convex pieces, one for each face of an object."""

    pieces: Sequence[FacePiece | None]
    """The piece of each face; None for faces without room."""

    def of(self, construction: Construction, asked: Sequence[Ask]) -> list[Known | None]:
        """Place contacts for each attempt; None where that is left to the construction itself."""
        if construction.limits is None or not asked:
            return [None] * len(asked)
        attempts = Attempts(
            np.array([faces for faces, _, _ in asked], dtype=np.int64),
            np.array([[cone.axis for cone in cones] for _, cones, _ in asked]),
            np.array([cones[0].half_angle for _, cones, _ in asked]),
        )
        least = np.array([each for _, _, each in asked])
        placed = room_for(len(asked))
        if construction.family == "pencil":
            kernel = compiled(f"{ROOM}.pencil_kernel")
            kernel.place(self._table, attempts, LEAST_RADIUS, least, placed)
            regions = self._discs(attempts, placed)
        else:
            turns = np.array(facet_turns(PYRAMID_SIDES))
            sides = MIXED_SIDES if construction is MIXED else (BEFORE, BEHIND)
            kernel = compiled(f"{ROOM}.concurrent_kernel")
            kernel.place(self._table, attempts, turns, np.array(sides), least, placed)
            regions = self._footprints(attempts, turns, placed)
        alike = [len({cone.half_angle for cone in cones}) == 1 for _, cones, _ in asked]
        return [
            None if end == LEFT or not same else Known(_placement(placed, place, construction), on)
            for place, (end, same, on) in enumerate(
                zip(placed.ends.tolist(), alike, regions, strict=True)
            )
        ]

    def _discs(self, attempts: Attempts, placed: Placed) -> list[tuple[ContactRegion, ...] | None]:
        """Make the discs of pencils, as `constructions` makes them one by one."""
        rings = placed.positions[:, :, None] + (
            placed.radii[:, :, None, None] * self._rings[attempts.faces]
        )
        counts = np.full(placed.radii.shape, DISC_CORNERS)
        return _regions("disc", Footprints(rings, counts, placed.radii), placed.ends)

    def _footprints(
        self, attempts: Attempts, turns: Array, placed: Placed
    ) -> list[tuple[ContactRegion, ...] | None]:
        """Cut the regions of concurrent grasps out of their faces."""
        most = self._table.E.shape[1] + len(turns) + 1
        shape = placed.radii.shape
        cut = Footprints(
            np.zeros((*shape, most, 3)), np.zeros(shape, dtype=np.int64), np.zeros(shape)
        )
        kernel = compiled(f"{ROOM}.footprints_kernel")
        kernel.footprints(self._table, attempts, turns, placed, cut)
        return _regions("cone", cut, placed.ends)

    @cached_property
    def _table(self) -> FaceTable:
        return face_table(self.pieces)

    @cached_property
    def _rings(self) -> Array:
        """Border points of a disc of radius one on each face, about its centre, (f, n, 3)."""
        turns = 2.0 * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS
        circle = np.column_stack([np.cos(turns), np.sin(turns)])
        return np.array([circle @ frame.T for frame in self._table.frames])


def _placement(placed: Placed, place: int, construction: Construction) -> Placement | None:
    """Return the placement of one attempt; None where there is none."""
    if placed.ends[place] != PLACED:
        return None
    foci = 2 if construction.family == "pencil" else 1
    return Placement(
        placed.positions[place], placed.forces[place], placed.foci[place, :foci],
        placed.radii[place], float(placed.merits[place]),
    )  # fmt: skip


def _regions(
    kind: RegionKind, cut: Footprints, ends: Indices
) -> list[tuple[ContactRegion, ...] | None]:
    """Make the regions of each attempt; None where a polygon has no corners."""
    cut.polygons.setflags(write=False)
    found: list[tuple[ContactRegion, ...] | None] = []
    for place, (corners, sizes, end) in enumerate(
        zip(cut.counts.tolist(), cut.radii.tolist(), ends.tolist(), strict=True)
    ):
        known = end == PLACED and min(corners) > 0
        found.append(
            four(
                trusted(
                    ContactRegion,
                    kind=kind,
                    polygon=cut.polygons[place, finger, : corners[finger]],
                    inscribed_radius=sizes[finger],
                )
                for finger in range(FINGERS)
            )
            if known
            else None
        )
    return found
