"""Gives the paper's three constructions one interface, which the planner uses."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.families.concurrent import cone_footprint, place_concurrent, place_on_mixed_sides
from grasp_core.families.pencil import place_pencil
from grasp_core.families.placements import LEAST_RADIUS, NoPlacement, Placement
from grasp_core.families.regulus import nearly_symmetric, place_regulus
from grasp_core.geometry.polygons import edge_rows
from grasp_core.kinds import Family
from grasp_core.objects.face_pieces import FacePiece, inscribed_radius
from grasp_core.values import ContactRegion, ForceCone

FingerOrder: TypeAlias = tuple[int, int, int, int]
Region: TypeAlias = Callable[[FacePiece, ForceCone, Placement, int], ContactRegion]

AS_LISTED: tuple[FingerOrder, ...] = ((0, 1, 2, 3),)
PAIRINGS: tuple[FingerOrder, ...] = ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2))
"""The three ways to group four faces into the pairs (first, second) and (third, fourth)."""
DISC_CORNERS = 64
"""Number of points that are listed on the border of a disc."""


@dataclass(frozen=True, slots=True)
class Construction:
    """The construction of one family, with the functions that the planner needs for it."""

    family: Family
    orders: tuple[FingerOrder, ...]
    """Orders of the fingers on the same faces that give different grasps."""
    place: Callable[[Sequence[FacePiece], Sequence[ForceCone], float], Placement | NoPlacement]
    """Function that places contacts, given pieces, force cones and the least merit that counts."""
    limits: slice | None
    """Columns of `disc_limits`, one per finger order; None where no disc is claimed."""
    admits: Callable[[Array, Array], NDArray[np.bool_]] | None
    """Function that returns for which quadruples a program may be feasible, (q,), from normals in
    finger order, (q, 4, 3), and half-angles, (q,) [rad]; None for all."""
    region: Region  # function that makes the region of one finger, in the pieces' units

    @property
    def least(self) -> float:
        """Return the merit that a placement must exceed to count."""
        return LEAST_RADIUS if self.limits else -math.inf


def _cone_region(
    piece: FacePiece, cone: ForceCone, placed: Placement, finger: int
) -> ContactRegion:
    polygon = cone_footprint(piece, cone, placed.foci[0], placed.positions[finger])
    E, b = edge_rows((polygon - piece.origin) @ piece.frame)
    return ContactRegion("cone", polygon, inscribed_radius(E, b))


def circle() -> Array:
    """Return points on the border of a disc of radius one, (n, 2)."""
    turns = 2.0 * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS
    return np.column_stack([np.cos(turns), np.sin(turns)])


def _disc_region(piece: FacePiece, _: ForceCone, placed: Placement, finger: int) -> ContactRegion:
    ring = circle() @ piece.frame.T
    radius = float(placed.radii[finger])
    return ContactRegion("disc", placed.positions[finger] + radius * ring, radius)


def regions_of(
    region: Region, pieces: Sequence[FacePiece], cones: Sequence[ForceCone], placed: Placement
) -> tuple[ContactRegion, ...]:
    """Make the regions of all fingers, in the pieces' units."""
    return tuple(
        region(piece, cone, placed, finger)
        for finger, (piece, cone) in enumerate(zip(pieces, cones, strict=True))
    )


def point_region(_: FacePiece, __: ForceCone, placed: Placement, finger: int) -> ContactRegion:
    """Make a region of one point, the contact itself."""
    return ContactRegion("point", placed.positions[finger][None], 0.0)


CONSTRUCTIONS: dict[Family, Construction] = {
    "concurrent": Construction(
        "concurrent", AS_LISTED, place_concurrent, slice(0, 1), None, _cone_region
    ),
    "pencil": Construction("pencil", PAIRINGS, place_pencil, slice(1, 4), None, _disc_region),
    "regulus": Construction(
        "regulus", PAIRINGS, lambda pieces, cones, _: place_regulus(pieces, cones), None,
        nearly_symmetric, point_region,
    ),
}  # fmt: skip
MIXED = replace(CONSTRUCTIONS["concurrent"], place=place_on_mixed_sides)
"""Construction of concurrent grasps with the focus before some fingers and behind the others."""
