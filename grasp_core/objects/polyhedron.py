"""Defines the polyhedron, a solid bounded by planar faces, made from a mesh file or triangles.

`is_convex` rests on this: a point of the convex
hull is at most d from its border iff it is at most d below the plane of some facet. If that holds
for the centroid of a triangle, each corner is at most 3 d below the same plane, as no corner is
above it. The whole triangle is then within 3 d of the hull's border.
"""

import hashlib
import importlib
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, Quantity, instance, one_of, path_of, value_of
from grasp_core.arrays import Array, Point, Polygon, Shape, Triangles, rounded
from grasp_core.by_value import counted, summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, MeshError, MeshRefusal, about
from grasp_core.mesh_files.limits import FaceKind, MeshChoices, MeshLimits, PatchLimits
from grasp_core.mesh_files.reading import FileSurface, read_triangles
from grasp_core.messages import shown
from grasp_core.notebooks import InNotebooks
from grasp_core.objects.build import DEFAULT_CHOICES, DEFAULT_LIMITS, build
from grasp_core.objects.surface import Face, Surface
from grasp_core.settings import extended

UNITS_M = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048
}  # fmt: skip


@declared
class Polyhedron(Declared, InNotebooks):
    """A solid bounded by planar faces, with the mass properties of uniform density 1 kg/m^3."""

    name: str
    vertices: Polygon
    """Welded vertices, (n, 3) [m]."""
    triangles: Triangles
    """Vertex indices, (t, 3), counter-clockwise seen from outside."""
    faces: tuple[Face, ...]
    volume: Annotated[float, Interval(gt=0.0, le=LARGEST)]
    """Volume [m^3]."""
    center_of_mass: Point
    """Centre of mass, (3,) [m]."""
    inertia: Annotated[Array, Shape(3, 3)]
    """Inertia about the centre of mass at density 1 kg/m^3, (3, 3) [kg m^2]."""
    content_sha256: str
    """Hash of the sorted mesh: the same for any file name, vertex order or triangle order."""
    source_sha256: str
    """Hash of the file's bytes; equal to `content_sha256` when there was no file."""
    patches: PatchLimits | None = None
    """Limits of flatness for the patches of a curved surface; None where faces are exactly planar.
    """
    surface: Surface = field(default_factory=Surface)
    """What is known of the triangles, such as whether they are closed."""
    notes: tuple[str, ...] = field(default=(), compare=False)
    """Notes, for people to read, on what was changed when the mesh was read; not compared."""
    radius: float = field(init=False, compare=False)
    """Largest distance of a vertex from the centre of mass [m]; computed, as it is the unit of most
    lengths and asked for very often."""

    def __post_init__(self) -> None:
        Declared.__post_init__(self)
        reach = np.linalg.norm(self.vertices - self.center_of_mass, axis=1).max(initial=0.0)
        object.__setattr__(self, "radius", float(reach))

    def _check_together(self) -> None:
        if self.triangles.max(initial=0) >= max(len(self.vertices), 1):
            raise InputError(
                f"triangles must hold vertex numbers from 0 to {len(self.vertices) - 1}"
            )

    @classmethod
    def from_mesh(
        cls,
        vertices: ArrayLike,
        triangles: ArrayLike,
        *,
        name: str = "object",
        faces: FaceKind = "auto",
        patches: PatchLimits | None = None,
        flatness_m: float | None = None,
        largest_part: bool = False,
        center_of_mass: ArrayLike | None = None,
    ) -> Self:
        """Build a polyhedron from a triangle mesh, with the same checks as for a mesh file.

        Args:
            vertices: Vertices, (n, 3) [m].
            triangles: Vertex indices, (t, 3).
            name: Name of the object.
            faces: See `load_polyhedron`.
            patches: See `load_polyhedron`.
            flatness_m: See `load_polyhedron`.
            largest_part: See `load_polyhedron`.
            center_of_mass: See `load_polyhedron`.

        Raises:
            MeshError: The mesh is not a solid; its `reason` says why.
        """
        choices = MeshChoices(
            faces=faces, patches=patches or PatchLimits(), flatness_m=flatness_m,
            largest_part=largest_part,
        )  # fmt: skip
        return polyhedron_from_mesh(
            vertices, triangles, choices, name=name, center_of_mass=center_of_mass, kind=cls
        )

    def to_trimesh(self) -> Any:
        """Return the surface as a `trimesh.Trimesh` with the same vertices and triangles [m]."""
        trimesh: Any = importlib.import_module("trimesh")
        return trimesh.Trimesh(
            self.vertices, self.triangles, metadata={"name": self.name}, process=False
        )

    def mass_at(self, density_kg_m3: float) -> float:
        """Return the mass of the object at a uniform density [kg], to nine digits.

        Args:
            density_kg_m3: Density, such as 1000 for water [kg/m^3].

        Raises:
            InputError: The density is out of range, or the volume is not known.
        """
        density = value_of(Quantity, density_kg_m3, "density_kg_m3")
        if not self.surface.closed:
            raise InputError(
                f"{self.name}: a density gives no mass, because the surface is open and its volume "
                "is not known; give the mass, or close the surface"
            )
        return rounded(self.volume * density)

    @property
    def normals(self) -> Array:
        """Return the unit normals of the faces, into the object, (faces, 3)."""
        return np.array([face.normal for face in self.faces]).reshape(-1, 3)

    def __hash__(self) -> int:
        """Return the hash of the mesh: caches ask for it very often."""
        return hash(self.content_sha256)

    def __repr__(self) -> str:
        kind = "face" if self.patches is None else "patch"
        sizes = [(self.vertices, "vertex"), (self.triangles, "triangle"), (self.faces, kind)]
        parts = [counted(len(things), name) for things, name in sizes]
        return summary("Polyhedron", shown(self.name), *parts, radius=self.radius)


AnyPolyhedron = TypeVar("AnyPolyhedron", bound=Polyhedron)


def load_polyhedron(  # noqa: PLR0913 - one keyword for each way to take a mesh
    path: str | Path,
    *,
    unit: str | None = None,
    scale: float = 1.0,
    faces: FaceKind = "auto",
    patches: PatchLimits | None = None,
    flatness_m: float | None = None,
    largest_part: bool = False,
    center_of_mass: ArrayLike | None = None,
    limits: MeshLimits = DEFAULT_LIMITS,
) -> Polyhedron:
    """Read a solid from a mesh file and find its faces.

    Small holes are closed, and parts that overlap are united; the notes of the result say so.

    Args:
        path: An OBJ, STL, PLY, OFF, GLB or 3MF file.
        unit: Unit of length of the file: "m", "cm", "mm", "um", "in" or "ft". If not given, it is
            the one that a 3MF file states, and the metre in other files.
        scale: Factor on the coordinates of the file, besides its unit.
        faces: `planar` for exact planar faces; `patches` for the nearly flat parts of a curved or
            scanned surface, which may have large holes; `auto` takes patches where there are more
            than `MAX_FACES` planar faces.
        patches: Limits of flatness for patches, and their number.
        flatness_m: Distance within which corners count as in one plane [m]. If not given, it is a
            millionth of the extent, or what the rounding of the file's coordinates explains.
        largest_part: Whether to use the largest part alone where the file holds several. Otherwise
            at most 1 % of the surface is ever left out.
        center_of_mass: Centre of mass in the file's frame, (3,) [m]. If not given, it is that of
            uniform density, estimated from the convex hull where the surface has large holes.
        limits: Largest size of the file, and largest cost of reading it.

    Raises:
        InputError: The unit is unknown, or a number is out of range.
        MeshError: The file is not a solid; its `reason` says why.
    """
    if unit is not None:
        one_of(unit, UNITS_M, "unit")
    choices = extended(
        MeshChoices, instance(limits, MeshLimits, "limits"), faces=faces,
        patches=patches or PatchLimits(), flatness_m=flatness_m, largest_part=largest_part,
    )  # fmt: skip
    scale = value_of(Quantity, scale, "scale")
    path = path_of(path, "path")
    mesh = read_triangles(path, limits)
    with about(path):
        size = UNITS_M[_unit_of(mesh, unit)] * scale
        return polyhedron_from_mesh(
            mesh.vertices * size,
            mesh.triangles,
            choices,
            name=path.stem,
            source_sha256=hashlib.sha256(mesh.data).hexdigest(),
            center_of_mass=center_of_mass,
            rounding=mesh.rounding * size,
        )


def _unit_of(mesh: FileSurface, given: str | None) -> str:
    """Return the unit of a mesh file: as it states, as it is given, or the metre."""
    if mesh.unit is not None and given not in (None, mesh.unit):
        message = (
            f"expected the unit that the file states ({mesh.unit}), got {given}; leave out the "
            "unit (--unit), or correct the size by a factor (--scale)"
        )
        raise MeshError(MeshRefusal.SIZE, message)
    return mesh.unit or given or "m"


def polyhedron_from_mesh(  # noqa: PLR0913 - what is known of a mesh, a keyword each
    vertices: ArrayLike,
    triangles: ArrayLike,
    choices: MeshChoices = DEFAULT_CHOICES,
    *,
    name: str = "object",
    source_sha256: str | None = None,
    center_of_mass: ArrayLike | None = None,
    rounding: float | None = None,
    known: Surface | None = None,
    kind: type[AnyPolyhedron] = Polyhedron,
) -> AnyPolyhedron:
    """Check a triangle mesh and build the polyhedron of its faces."""
    value_of(str, name, "name")
    made = build(vertices, triangles, choices, rounding, center_of_mass, known)
    return kind(name=name, source_sha256=source_sha256 or made["content_sha256"], **made)


FLUSH = 1e-6
"""Largest depth of a triangle's centroid below the surface of the convex hull, in object radii: ten
times the error of coordinates in single precision."""
TRIANGLES_AT_ONCE = 256
"""Number of triangles compared with all facets at a time, which needs a few megabytes."""


def _is_below_all_faces(body: Polyhedron) -> bool:
    """Return whether no vertex lies above the plane of a face, which the hull then has, too."""
    anchors = np.array([face.pieces[0][0] for face in body.faces])
    heights = body.normals @ body.vertices.T - np.einsum("fi,fi->f", body.normals, anchors)[:, None]
    return bool(heights.min() >= -FLUSH * body.radius)


@lru_cache(maxsize=16)
def is_convex(body: Polyhedron) -> bool:
    """Return whether all triangles of an object lie on the surface of their convex hull."""
    if body.patches is None and _is_below_all_faces(body):
        return True  # without a library of hulls, whose import takes as long as many grasps
    spatial: Any = importlib.import_module("scipy.spatial")
    points = (body.vertices - body.center_of_mass) / body.radius
    facets: Array = spatial.ConvexHull(points).equations
    centroids = points[body.triangles].mean(axis=1)
    for start in range(0, len(centroids), TRIANGLES_AT_ONCE):
        depths = -(centroids[start : start + TRIANGLES_AT_ONCE] @ facets[:, :3].T + facets[:, 3])
        if (depths.min(axis=1) > FLUSH).any():
            return False
    return True
