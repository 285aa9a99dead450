"""Defines the face of a polyhedron, and the limits of flatness for patches that replace faces."""

from dataclasses import dataclass, field
from functools import partial
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices, frozen, frozen_indices, frozen_units
from grasp_core.by_value import ByValue
from grasp_core.checked import BOUNDS, LARGEST, number, several, whole
from grasp_core.short_text import counted, summary
from grasp_core.values import RIGHT_ANGLE

FaceKind: TypeAlias = Literal["auto", "planar", "patches"]
"""Which faces to use: exactly planar ones, nearly flat patches, or whichever suits the surface."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Face(ByValue):
    """A planar face: one outer border, perhaps holes, and a split into convex pieces."""

    normal: Array
    """Unit vector into the object, (3,)."""
    centroid: Array
    """Centre of area, on the plane, (3,) [m]."""
    area: float
    """Area of the face without its holes [m^2]."""
    polygon: Array
    """Outer border, (k, 3) [m], counter-clockwise when `normal` points at the viewer."""
    holes: tuple[Array, ...]
    """Borders of the holes, each (k, 3) [m], clockwise in the same view."""
    pieces: tuple[Array, ...]
    """Convex polygons that tile the face, each (k, 3) [m], wound as `polygon`."""
    spread: float = 0.0
    """Largest angle between the surface and the plane of a curved patch [rad]."""
    depth: float = 0.0
    """Largest distance of the surface from the plane of a curved patch [m]."""
    facets: Indices = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Indices of the triangles over a curved patch, (f,); empty for an exact face."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "facets", frozen_indices(self.facets, (None,), "facets"))
        object.__setattr__(self, "normal", frozen_units(self.normal, (3,), "normal"))
        object.__setattr__(self, "centroid", frozen(self.centroid, (3,), "centroid"))
        object.__setattr__(self, "polygon", frozen(self.polygon, (None, 3), "polygon"))
        for name in ("holes", "pieces"):
            each = partial(frozen, shape=(None, 3), name=name)
            loops = several(getattr(self, name), each, name, "polygons")
            object.__setattr__(self, name, loops)
        number(self.area, "area", above=0.0, most=LARGEST)
        number(self.spread, "spread", least=0.0, below=RIGHT_ANGLE)
        number(self.depth, "depth", least=0.0, most=LARGEST)

    def __repr__(self) -> str:
        parts = [counted(len(self.polygon), "corner"), counted(len(self.holes), "hole")]
        return summary("Face", *parts, area=self.area, centroid=self.centroid, normal=self.normal)


@dataclass(frozen=True, slots=True)
class PatchLimits:
    """How flat a patch of a curved surface must be, and how many patches are kept.

    Raises:
        InputError: A limit is out of range.
    """

    spread_deg: float = 10.0
    """Largest angle between the surface and the patch's plane [deg]; the friction angle available
    to the planner shrinks by it."""
    depth: float = 0.01
    """Largest distance of the surface from the plane, relative to the object's largest extent."""
    most: int = 20
    """Keep at most this many patches: those with the largest inscribed discs."""

    def __post_init__(self) -> None:
        number(self.spread_deg, "spread_deg", **BOUNDS["patch_spread_deg"])
        number(self.depth, "depth", **BOUNDS["patch_depth"])
        whole(self.most, "most", **BOUNDS["patches"])
