"""The nouns of the project: faces, polyhedra, contacts and grasps, all frozen.

Every vector is in the object's frame and in SI units. Normals are unit vectors that
point into the object. Arrays are copied, checked and made read-only on construction.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, Self, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen, frozen_indices, frozen_units
from grasp_core.errors import InputError

Family: TypeAlias = Literal["concurrent", "pencil", "regulus"]
"""The class of a grasp's witness lines."""
Method: TypeAlias = Literal["concurrent", "pencil", "regulus", "free"]
"""How grasps are looked for: by one of the paper's constructions, or free of any type."""
FaceKind: TypeAlias = Literal["auto", "planar", "patches"]
"""What counts as a face: flat parts, nearly flat patches, or what suits the surface."""
RegionKind: TypeAlias = Literal["cone", "disc", "point", "certified"]
FaceQuadruple: TypeAlias = tuple[int, int, int, int]
"""Indices of four faces, in finger order."""

Item = TypeVar("Item")

FINGERS = 4
LARGEST_FRICTION = 1e3
"""Coefficients above this are reported as infinite; no material comes near it."""


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A planar face: one outer border, perhaps holes, and a split into convex pieces."""

    normal: Array
    """Unit vector into the object, (3,)."""
    centroid: Array
    """Centre of area, on the plane, (3,) [m]."""
    area: float
    """[m^2]"""
    polygon: Array
    """Outer border, (k, 3) [m], counter-clockwise when `normal` points at the viewer."""
    holes: tuple[Array, ...]
    """Borders of the holes, each (k, 3) [m], clockwise in the same view."""
    pieces: tuple[Array, ...]
    """Convex polygons that tile the face, each (k, 3) [m], wound as `polygon`."""
    spread: float = 0.0
    """Of a curved patch: the most that the surface over it leans from the plane [rad]."""
    depth: float = 0.0
    """Of a curved patch: largest distance of the surface over it from the plane [m]."""
    facets: Indices = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Of a curved patch: the triangles that are the surface over the polygon, (f,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "facets", frozen_indices(self.facets, (None,), "facets"))
        object.__setattr__(self, "normal", frozen_units(self.normal, (3,), "normal"))
        object.__setattr__(self, "centroid", frozen(self.centroid, (3,), "centroid"))
        object.__setattr__(self, "polygon", frozen(self.polygon, (None, 3), "polygon"))
        for name in ("holes", "pieces"):
            loops = tuple(frozen(loop, (None, 3), name) for loop in getattr(self, name))
            object.__setattr__(self, name, loops)


@dataclass(frozen=True, slots=True)
class PatchLimits:
    """How far a patch may be from flat, and how many there are.

    Raises:
        InputError: A limit is out of range.
    """

    spread_deg: float = 10.0
    """Largest angle between the surface and the patch's plane [deg]; friction loses it."""
    depth: float = 0.01
    """Largest distance of the surface from the plane, relative to the object's largest extent."""
    most: int = 20
    """So many patches, those with the largest discs."""

    def __post_init__(self) -> None:
        if not 0.0 < self.spread_deg <= 45.0:  # noqa: PLR2004 - above it nothing is flat
            raise InputError(f"spread_deg must be above 0 and at most 45, got {self.spread_deg}")
        if not 0.0 < self.depth <= 0.1:  # noqa: PLR2004
            raise InputError(f"depth must be above 0 and at most 0.1, got {self.depth}")
        if not 4 <= self.most <= 200:  # noqa: PLR2004 - four fingers; what the planner takes
            raise InputError(f"most must be from 4 to 200, got {self.most}")


@dataclass(frozen=True, slots=True, eq=False)
class Polyhedron:
    """A solid bounded by planar faces, with the mass properties of uniform density 1."""

    name: str
    vertices: Array
    """Welded vertices, (n, 3) [m]."""
    triangles: Indices
    """Vertex indices, (t, 3), counter-clockwise seen from outside."""
    faces: tuple[Face, ...]
    volume: float
    """[m^3]"""
    center_of_mass: Array
    """(3,) [m]"""
    inertia: Array
    """About the centre of mass at density 1 kg/m^3, (3, 3) [kg m^2]."""
    content_sha256: str
    """Hash of the canonical mesh: the same for any file name, vertex or triangle order."""
    source_sha256: str
    """Hash of the file's bytes; `content_sha256` when there was no file."""
    patches: PatchLimits | None = None
    """Of a curved or scanned surface whose faces are patches; None where they are exact."""
    notes: tuple[str, ...] = ()
    """What was mended on the way in, for people to read."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, (None, 3), "vertices"))
        triangles = frozen_indices(self.triangles, (None, 3), "triangles")
        object.__setattr__(self, "triangles", triangles)
        center = frozen(self.center_of_mass, (3,), "center_of_mass")
        object.__setattr__(self, "center_of_mass", center)
        object.__setattr__(self, "inertia", frozen(self.inertia, (3, 3), "inertia"))

    @classmethod
    def from_mesh(
        cls,
        vertices: ArrayLike,
        triangles: ArrayLike,
        *,
        name: str = "object",
        faces: FaceKind = "auto",
        patches: PatchLimits | None = None,
        center_of_mass: ArrayLike | None = None,
    ) -> Self:
        """Build from a triangle mesh, with the checks and refusals of a mesh file.

        Args:
            vertices: (n, 3) [m].
            triangles: Vertex indices, (t, 3).
            name: What to call the object.
            faces: As `load_polyhedron`.
            patches: As `load_polyhedron`.
            center_of_mass: As `load_polyhedron`.

        Raises:
            MeshError: The mesh is not a solid; its `reason` says why.
        """
        from grasp_core.polyhedra import polyhedron_from_mesh

        return polyhedron_from_mesh(
            vertices, triangles, name=name, faces=faces, patches=patches,
            center_of_mass=center_of_mass, kind=cls,
        )  # fmt: skip

    @property
    def radius(self) -> float:
        """Largest distance of a vertex from the centre of mass [m]."""
        return float(np.linalg.norm(self.vertices - self.center_of_mass, axis=1).max())

    @property
    def normals(self) -> Array:
        """The faces' normals, (faces, 3)."""
        return np.array([face.normal for face in self.faces]).reshape(-1, 3)


@dataclass(frozen=True, slots=True, eq=False)
class ForceCone:
    """A circular cone of force directions inside a friction cone.

    The paper's case has the normal as axis and the friction angle as half-angle.
    """

    axis: Array
    """Unit vector, (3,)."""
    half_angle: float
    """[rad]"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", frozen_units(self.axis, (3,), "axis"))
        if not 0.0 <= self.half_angle < np.pi / 2:
            raise InputError(f"half_angle must be in [0, pi/2), got {self.half_angle:.6g}")


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """Where one fingertip touches, and which way it can push."""

    position: Array
    """Point on the surface, (3,) [m]."""
    normal: Array
    """Unit vector into the object, (3,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position, (3,), "position"))
        object.__setattr__(self, "normal", frozen_units(self.normal, (3,), "normal"))


@dataclass(frozen=True, slots=True, eq=False)
class ContactRegion:
    """Where one finger may stand while the others stay anywhere in their own regions."""

    kind: RegionKind
    """What certifies it: `cone` is the inverted force cone of a focus point cut with the face,
    `disc` a disc around the contact of a pencil; `certified` a proof of its own (see
    `certified_regions`); `point` claims nothing but the contact."""
    polygon: Array
    """Convex polygon on the face, (k, 3) [m]; of a disc, points of its border."""
    inscribed_radius: float
    """Radius of the largest disc inside the region [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "polygon", frozen(self.polygon, (None, 3), "polygon"))


@dataclass(frozen=True, slots=True, eq=False)
class Witness:
    """Balanced forces, whose four lines show what family a grasp belongs to."""

    points: Array
    """A point on each line, the contact, (4, 3) [m]."""
    forces: Array
    """Forces along the lines, into the object, normal parts summing to one, (4, 3)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, (FINGERS, 3), "points"))
        object.__setattr__(self, "forces", frozen(self.forces, (FINGERS, 3), "forces"))

    @property
    def directions(self) -> Array:
        """Unit vectors along the lines, (4, 3)."""
        return self.forces / np.linalg.norm(self.forces, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True, eq=False)
class Grasp:
    """Four contacts in finger order, with the witness of why they hold."""

    id: str
    family: Family
    faces: FaceQuadruple
    contacts: tuple[Contact, Contact, Contact, Contact]
    focus_points: Array
    """Where witness lines of force meet, (k, 3) [m]: one point for a concurrent grasp, one for
    each pair of a pencil. For a regulus, the points between the two lines of each pair, or none."""
    force_cones: tuple[ForceCone, ForceCone, ForceCone, ForceCone]
    """The cones the construction used; each lies inside its contact's friction cone."""
    regions: tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
    radius: float
    """Radius of the smallest of the four independent discs [m]; 0.0 where none is claimed."""
    span_angle: float
    """Largest half-angle at which the four normals positively span, theta* [rad]."""
    critical_friction: float
    """Smallest Coulomb coefficient above which the contacts are in force closure."""
    closure_margin: float
    """Margin of the exact closure test at the planned friction (see `force_closure`)."""
    ferrari_canny: tuple[float, float]
    """Proved bounds of the `l1` quality at the planned friction, torques about the centre of mass
    and over the object's radius [N]."""
    witness: Witness
    """Balanced forces whose lines are of the grasp's family."""
    approach_directions: Array | None = None
    """Which way each finger moves in to its contact, on the free line that was found for it, unit
    vectors, (4, 3); None if none was asked for (`plan(finger=...)`)."""

    def __post_init__(self) -> None:
        if self.approach_directions is not None:
            ways = frozen_units(self.approach_directions, (FINGERS, 3), "approach_directions")
            object.__setattr__(self, "approach_directions", ways)
        for name in ("faces", "contacts", "force_cones", "regions"):
            if len(getattr(self, name)) != FINGERS:
                count = len(getattr(self, name))
                raise InputError(f"a grasp has {FINGERS} {name}, got {count}")
        object.__setattr__(self, "focus_points", frozen(self.focus_points, (None, 3), "focus"))

    @property
    def positions(self) -> Array:
        """Contact points in finger order, (4, 3) [m]."""
        return np.array([contact.position for contact in self.contacts])

    @property
    def normals(self) -> Array:
        """Inward normals in finger order, (4, 3)."""
        return np.array([contact.normal for contact in self.contacts])


def four(items: Iterable[Item]) -> tuple[Item, Item, Item, Item]:
    """Exactly four things, one per finger.

    Raises:
        InputError: There are more or fewer.
    """
    listed = tuple(items)
    if len(listed) != FINGERS:
        raise InputError(f"expected {FINGERS}, one per finger, got {len(listed)}")
    return listed


def stacked(contacts: Iterable[Contact]) -> tuple[Array, Array]:
    """Positions and inward normals of contacts, each (k, 3)."""
    listed = tuple(contacts)
    positions = np.array([contact.position for contact in listed])
    return positions, np.array([contact.normal for contact in listed])


def contact_arrays(positions: ArrayLike | Grasp, normals: ArrayLike | None) -> tuple[Array, Array]:
    """Positions and inward normals, each (k, 3), from a grasp or from two arrays.

    Raises:
        InputError: Shapes differ, a normal is not a unit vector, or fewer than two contacts.
    """
    if isinstance(positions, Grasp):
        return positions.positions, positions.normals
    if normals is None:
        raise InputError("normals are missing: pass positions and normals, or a Grasp")
    points = frozen(positions, (None, 3), "positions")
    units = frozen_units(normals, (len(points), 3), "normals")
    if len(points) < 2:  # noqa: PLR2004 - one contact alone can balance nothing
        raise InputError(f"at least two contacts are needed, got {len(points)}")
    return points, units


def contact_frictions(friction: ArrayLike, count: int) -> Array:
    """One checked Coulomb coefficient per contact, (count,), from one for all or one each."""
    values = np.asarray(friction, dtype=np.float64)
    mu = frozen(np.full(count, values) if values.ndim == 0 else values, (count,), "friction")
    if (mu < 0.0).any():
        raise InputError(f"friction must not be negative, got {float(mu.min()):.6g}")
    if (mu > LARGEST_FRICTION).any():
        raise InputError(
            f"friction must be at most {LARGEST_FRICTION:g}, got {float(mu.max()):.6g}"
        )
    return mu
