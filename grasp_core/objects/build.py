"""Checks a triangle mesh and finds its faces, or refuses it with a reason.

The checks come in this order: the numbers of the file, one consistent orientation, closure with two
triangles per edge, the volume, and that no two parts of the mesh overlap. Close vertices are
welded, and a closed inside-out mesh is turned. A surface on which nearly flat patches replace the
faces need not be closed: if it is faulty, its largest part is used, with the orientation it has.
The notes say what was changed. Nothing else is repaired.
"""

import hashlib
import math
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen, real_array
from grasp_core.checked import instance, one_of
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.objects.booleans import Solid, hull, triangulate
from grasp_core.objects.curved_patches import flat_patches
from grasp_core.objects.face import Face, FaceKind, PatchLimits
from grasp_core.objects.mass import MassProperties, mass_properties
from grasp_core.objects.planar_faces import MAX_FACES, FlatnessLimits, coplanar_groups, planar_faces
from grasp_core.objects.solid_checks import (
    check_volume,
    largest_part,
    oriented,
    surface_fault,
    welded,
)
from grasp_core.values import FINGERS

SMALLEST_EXTENT_M, LARGEST_EXTENT_M = 5e-4, 20.0
"""Smallest and largest extent of an object [m]: beyond them, the unit of the file is almost surely
wrong."""
SURROUNDINGS = 1e-6
"""Largest distance of a given centre of mass from the object's bounding box, relative to the
extent."""
DEFAULT_FLATNESS = FlatnessLimits()
DEFAULT_LIMITS = MeshLimits()


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The parts of a polyhedron: mesh, faces, mass properties and notes."""

    vertices: Array
    """Welded vertices, (n, 3) [m]."""
    triangles: Indices
    """Vertex indices, (t, 3), counter-clockwise seen from outside."""
    faces: tuple[Face, ...]
    mass: MassProperties
    content_sha256: str
    """Hash of the mesh with vertices and triangles in sorted order."""
    patches: PatchLimits | None
    """Limits of flatness for patches that replace faces; None where faces are exactly planar."""
    notes: tuple[str, ...]
    """Notes, for people to read, on what was changed in the mesh."""


def build(  # noqa: PLR0913, PLR0917 - as `load_polyhedron`
    vertices: ArrayLike,
    triangles: ArrayLike,
    flatness: FlatnessLimits,
    faces: FaceKind,
    patches: PatchLimits | None,
    center_of_mass: ArrayLike | None,
    limits: MeshLimits,
) -> Parts:
    """Check a triangle mesh and find its faces; `load_polyhedron` explains the arguments.

    Raises:
        InputError: The centre of mass is not a point.
        MeshError: The mesh is not a solid; its `reason` says why.
    """
    check_choices(faces, patches, flatness)
    points, corners = _checked_arrays(vertices, triangles, limits.max_triangles)
    center = _given_center(points, center_of_mass)
    points, corners, dropped = welded(points, corners)
    notes = [f"dropped {dropped} triangles without area"] if dropped else []
    groups = _planar_groups(points, corners, flatness, faces)
    if len(groups or ()) > limits.max_faces:
        message = (
            f"{len(groups or ())} planar faces exceed the limit of {limits.max_faces}; simplify "
            "the mesh, or plan on nearly flat patches (--faces patches)"
        )
        raise MeshError(MeshRefusal.TOO_MANY, message)
    flat = (patches or PatchLimits()) if groups is None else None
    fault = surface_fault(corners)
    if fault and (flat is None or fault.reason is MeshRefusal.WINDING):
        raise fault
    points, corners, said = _sound_surface(points, corners, fault, limits.max_parts)
    notes += said
    if flat is not None:
        found, said = _patched(points, corners, flat, fault)
        notes += said
    else:
        found = planar_faces(points, corners, groups or [], flatness, triangulate)
    solid = hull(points) if fault and fault.reason is MeshRefusal.OPEN else Solid(points, corners)
    check_volume(solid)
    mass = mass_properties(solid, center)
    return Parts(points, corners, found, mass, content_hash(points, corners), flat, tuple(notes))


def check_choices(faces: FaceKind, patches: PatchLimits | None, flatness: FlatnessLimits) -> None:
    """Refuse values of `faces`, `patches` or `flatness` that are of the wrong kind.

    Raises:
        InputError: A value is of the wrong kind.
    """
    one_of(faces, get_args(FaceKind), "faces")
    if patches is not None:
        instance(patches, PatchLimits, "patches")
    instance(flatness, FlatnessLimits, "flatness")


def _given_center(points: Array, center_of_mass: ArrayLike | None) -> Array | None:
    """Check the centre of mass that a user gave, (3,) [m]; None if none was given."""
    if center_of_mass is None:
        return None
    center = frozen(center_of_mass, (3,), "center_of_mass")
    low, high = points.min(axis=0), points.max(axis=0)
    slack = SURROUNDINGS * float((high - low).max())
    if (center < low - slack).any() or (center > high + slack).any():
        raise InputError(
            f"center_of_mass {center.tolist()} must be inside the object, from {low.tolist()} "
            f"to {high.tolist()} m"
        )
    return center


def _planar_groups(
    points: Array, corners: Indices, flatness: FlatnessLimits, faces: FaceKind
) -> list[Indices] | None:
    """Group triangles into planar faces; None where patches are used instead."""
    if faces == "patches":
        return None
    groups = coplanar_groups(points, corners, flatness)
    return groups if faces == "planar" or len(groups) <= MAX_FACES else None


def _sound_surface(
    points: Array, corners: Indices, fault: MeshError | None, most: int
) -> tuple[Array, Indices, list[str]]:
    """Orient a surface outwards or, if it is faulty, return its largest part as it is."""
    if fault:
        return largest_part(points, corners)
    corners, flipped = oriented(points, corners, most)
    said = ["the mesh was inside out; its triangles were turned"] if flipped else []
    return points, corners, said


def _patched(
    points: Array, corners: Indices, limits: PatchLimits, fault: MeshError | None
) -> tuple[tuple[Face, ...], list[str]]:
    """Find the patches of a surface, and write notes about them."""
    patches = flat_patches(points, corners, limits)
    if len(patches) < FINGERS:
        raise MeshError(
            MeshRefusal.NOT_FLAT,
            f"only {len(patches)} patches are within {limits.spread_deg:g} deg and "
            f"{limits.depth:g} of the extent from flat, but four fingers need four patches; "
            "allow more (--patch-spread-deg, --patch-depth), or refine the mesh",
        )
    lean = max((face.spread for face in patches), default=0.0)
    off = max((face.depth for face in patches), default=0.0)
    notes = [
        f"the surface is curved; its {len(patches)} patches stand for faces, and lean from their "
        f"planes by up to {math.degrees(lean):.3g} deg and are up to {1e3 * off:.3g} mm off them"
    ]
    if fault and fault.reason is MeshRefusal.OPEN:
        notes.append(
            f"the surface is not closed ({fault}); only its patches are used, and the centre of "
            "mass is that of the convex hull unless it is given"
        )
    elif fault:
        notes.append(f"the surface is faulty ({fault}); only its patches are used")
    return patches, notes


def _checked_arrays(vertices: ArrayLike, triangles: ArrayLike, most: int) -> tuple[Array, Indices]:
    points = real_array(vertices, "vertices")
    real_array(triangles, "triangles")  # before numpy makes an array of anything
    corners = np.array(triangles)
    if points.ndim != 2 or corners.ndim != 2 or points.shape[1:] != (3,) or not corners.size:  # noqa: PLR2004
        got = f"{points.shape} and {corners.shape}"
        message = f"vertices must be (n, 3) and triangles (t, 3), got {got}"
        raise MeshError(MeshRefusal.EMPTY, message)
    if corners.shape[1] != 3 or corners.dtype.kind not in "iu":  # noqa: PLR2004
        message = f"triangles must be whole numbers (t, 3), got {corners.dtype} {corners.shape}"
        raise MeshError(MeshRefusal.INDEX, message)
    if len(corners) > most:
        message = f"the mesh has {len(corners)} triangles, expected at most {most}; simplify it"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise MeshError(
            MeshRefusal.NON_FINITE, f"vertex {bad} must have finite coordinates, got {points[bad]}"
        )
    if corners.min() < 0 or corners.max() >= len(points):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        message = f"a triangle names vertex {wrong}; the last vertex is {len(points) - 1}"
        raise MeshError(MeshRefusal.INDEX, message)
    with np.errstate(over="ignore"):
        extent = float(np.ptp(points[np.unique(corners)], axis=0).max())
    if not SMALLEST_EXTENT_M <= extent <= LARGEST_EXTENT_M:
        wrong = (
            "small (without --unit it is metres; --scale multiplies it)"
            if extent < 1.0
            else "large (--unit mm, perhaps, or --scale)"
        )
        message = (
            f"the object is {extent:.3g} m across, expected {SMALLEST_EXTENT_M} to "
            f"{LARGEST_EXTENT_M} m; its unit makes it too {wrong}"
        )
        raise MeshError(MeshRefusal.SIZE, message)
    return points, corners.astype(np.int64)


def content_hash(points: Array, corners: Indices) -> str:
    """Hash a mesh with SHA-256, vertices and triangles in sorted order."""
    order = np.lexsort(points.T[::-1])
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    renamed = place[corners]
    turned = np.array([np.roll(t, -int(np.argmin(t))) for t in renamed])
    turned = turned[np.lexsort(turned.T[::-1])]
    digest = hashlib.sha256(np.ascontiguousarray(points[order] + 0.0, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(turned, dtype="<i8").tobytes())
    return digest.hexdigest()
