"""Defines faces of objects, and what is known of the surface that an object was made from.

Whatever depends on how far a mesh can be trusted asks here. An orientation that is not certain has
no field, because such meshes are refused.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np

from grasp_core.arrays import Indices, Point, Polygon, Shape, UnitVector
from grasp_core.declared import Declared, counted, summary
from grasp_core.kinds import LARGEST, NotNegative, Number, Range
from grasp_core.objects.triangles import Mesh
from grasp_core.values import RIGHT_ANGLE

Places = Annotated[Indices, Shape(None, whole=True)]
"""Places of things in a list, (n,)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Face(Declared):
    """A planar face: one outer border, perhaps holes, and a split into convex pieces."""

    normal: UnitVector
    """Unit vector into the object, (3,)."""
    centroid: Point
    """Centre of area, on the plane, (3,) [m]."""
    area: Annotated[float, Range(above=0.0, most=LARGEST)]
    """Area of the face without its holes [m^2]."""
    polygon: Polygon
    """Outer border, (k, 3) [m], counter-clockwise when `normal` points at the viewer."""
    holes: tuple[Polygon, ...]
    """Borders of the holes, each (k, 3) [m], clockwise in the same view."""
    pieces: tuple[Polygon, ...]
    """Convex polygons that tile the face, each (k, 3) [m], wound as `polygon`."""
    spread: Annotated[float, Range(least=0.0, below=RIGHT_ANGLE)] = 0.0
    """Largest angle between the surface and the plane of a curved patch [rad]."""
    depth: NotNegative = 0.0
    """Largest distance of the surface from the plane of a curved patch [m]."""
    facets: Places = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Indices of the triangles over a curved patch, (f,); empty for an exact face."""

    def __repr__(self) -> str:
        parts = [counted(len(self.polygon), "corner"), counted(len(self.holes), "hole")]
        return summary("Face", *parts, area=self.area, centroid=self.centroid, normal=self.normal)


MM = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class Surface(Declared):
    """What is known of an object's triangles."""

    closed: bool = True
    """Whether the triangles, caps included, enclose a solid. Where they do not, the mass properties
    are those of the convex hull."""
    caps: Places = field(default_factory=lambda: np.empty(0, dtype=np.int64))
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


@dataclass(frozen=True, eq=False)
class SoundSurface(Mesh):
    """Welded and consistently wound triangles, with what is known of them."""

    surface: Surface

    def mended(
        self, mesh: Mesh, caps: Indices, dropped: float, said: Sequence[str]
    ) -> "SoundSurface":
        """Return the surface with other triangles, made by dropping a share and by what is said."""
        known = replace(
            self.surface,
            caps=caps,
            dropped=max(self.surface.dropped, dropped),
            repairs=(*self.surface.repairs, *said),
        )
        return SoundSurface(mesh.vertices, mesh.triangles, known)
