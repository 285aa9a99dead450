"""Defines faces of objects, and what is known of the surface that an object was made from.

Whatever depends on how far a mesh can be trusted asks here. An orientation that is not certain has
no field, because such meshes are refused.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices, Shape, frozen, frozen_indices, frozen_units
from grasp_core.checked import LARGEST, number, several
from grasp_core.declared import ByValue, Declared, counted, summary
from grasp_core.kinds import NotNegative, Number, Range
from grasp_core.settings import Settings
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
class PatchLimits(Settings):
    """How flat a patch of a curved surface must be, and how many patches are kept.

    Raises:
        InputError: A limit is out of range.
    """

    spread_deg: Annotated[float, Range(above=0.0, most=45.0)] = 10.0
    """Largest angle between the surface and the patch's plane [deg]; the friction angle available
    to the planner shrinks by it."""
    depth: Annotated[float, Range(above=0.0, most=0.1)] = 0.01
    """Largest distance of the surface from the plane, relative to the object's largest extent."""
    most: Annotated[int, Range(least=4, most=200)] = 20
    """Keep at most this many patches: those with the largest inscribed discs."""


MM = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class Surface(Declared):
    """What is known of an object's triangles."""

    closed: bool = True
    """Whether the triangles, caps included, enclose a solid. Where they do not, the mass properties
    are those of the convex hull."""
    caps: Annotated[Indices, Shape(None, whole=True)] = field(
        default_factory=lambda: np.empty(0, dtype=np.int64)
    )
    """Indices of the triangles that close small holes, (c,); no finger may stand on them."""
    holes: Number = 0
    """Number of holes that were closed."""
    largest_hole_m: NotNegative = 0.0
    """Largest distance between two corners of one closed hole [m]."""
    volume_error: NotNegative = 0.0
    """Largest error of the volume if each closed hole was a half-sphere, as a share of it."""
    dropped: Annotated[float, Range(least=0.0, most=1.0)] = 0.0
    """Area of the parts that were left out, as a share of the whole."""
    flatness_m: NotNegative = 0.0
    """Distance from one plane that the rounding of the coordinates explains [m]; 0 where no more is
    known of them than that they are in double precision."""
    center_given: bool = False
    """Whether the centre of mass was given, and is not that of uniform density."""
    repairs: tuple[str, ...] = ()
    """What else was changed, in words."""

    @property
    def volume_source(self) -> Literal["surface", "capped surface", "convex hull"]:
        """What the mass properties are computed from."""
        if not self.closed:
            return "convex hull"
        return "capped surface" if self.holes else "surface"

    def notes(self) -> Iterator[str]:
        """Yield what people must know of the surface, a sentence each."""
        yield from self.repairs
        if self.holes:
            yield (
                f"{self.holes} hole{'s' * (self.holes > 1)} in the surface, at most "
                f"{MM * self.largest_hole_m:.3g} mm wide, "
                f"{'are' if self.holes > 1 else 'is'} closed for volume and centre of mass, which "
                f"makes the volume uncertain by at most {100.0 * self.volume_error:.2g} %; no "
                "finger is placed there"
            )
        if not self.closed:
            what = "its volume is" if self.center_given else "its volume and centre of mass are"
            yield f"the surface is open, so {what} of the convex hull, and a density gives no mass"
