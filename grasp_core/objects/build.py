"""Checks a triangle mesh and finds its faces, or refuses it with a reason.

First come the numbers of the file. Then one surface is made of the triangles (`mesh_repair`). Then
faces are found on it: exact planar ones, which need a closed surface, or nearly flat patches, which
do not. The notes say what was changed.

Mass properties: by the divergence theorem volume and centre are integrals over the surface, of
x n_x and of x_i^2 n_i / 2. On a triangle with corners a, b, c they are polynomials in the corners.
Second moments are summed over the tetrahedra between the centre and the triangles. Trimesh computes
the same integrals, and tests compare the two; importing it takes longer than planning.

Source: Eberly, "Polyhedral mass properties (revisited)", 2002.
"""

import hashlib
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen, real_array
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.mesh_files.limits import MeshChoices, MeshLimits, PatchLimits
from grasp_core.mesh_files.polygons import check_corners, single_rounding, too_many
from grasp_core.objects.booleans import hull
from grasp_core.objects.mesh_repair import sound_surface
from grasp_core.objects.planar_faces import (
    MAX_FACES,
    PLANAR,
    coplanar_groups,
    flat_patches,
    planar_face,
    planar_slack,
)
from grasp_core.objects.shells import check_bounds, check_volume, keep_out_of_voids, outward_sheets
from grasp_core.objects.surface import Face, Mesh, SoundSurface, Surface
from grasp_core.values import FINGERS

SMALLEST_EXTENT_M, LARGEST_EXTENT_M = 5e-4, 20.0
"""Ends of an object's extent [m]: beyond them, the unit of the file is almost surely wrong."""
OUTSIDE_BOX = 1e-6
"""Largest distance of a given centre of mass from the bounding box, relative to the extent."""
CORNER_ROUNDINGS = 8.0
"""Number of rounding errors of a coordinate that a corner of a face may be off its plane: a corner
may be off by the root of three, and a plane through three of them as far from a fourth by more."""
COARSEST = 1e-3
"""Largest distance from a plane, over the extent, that rounding explains and shapes do not."""
LARGEST_FLATNESS = 0.1
"""Largest flatness over the extent: with much more, faces are one whose normals differ by far."""
DEFAULT_LIMITS, DEFAULT_CHOICES = MeshLimits(), MeshChoices()


def build(
    vertices: ArrayLike, triangles: ArrayLike, choices: MeshChoices, rounding: float | None,
    center_of_mass: ArrayLike | None, known: Surface | None,
) -> dict[str, Any]:  # fmt: skip
    """Check a triangle mesh and find its faces; return the fields of a `Polyhedron`."""
    points, corners = _checked_arrays(vertices, triangles, choices.max_triangles)
    extent = float(np.ptp(points[np.unique(corners)], axis=0).max())
    off = single_rounding(points) if rounding is None else rounding
    blur = known.flatness_m if known else _flatness(off, choices.flatness_m, extent)
    if blur > LARGEST_FLATNESS * extent:
        raise InputError(
            f"flatness_m must be at most {LARGEST_FLATNESS:g} of the object's extent, which is "
            f"{extent:.6g} m, got {blur:.6g}"
        )
    found = sound_surface(Mesh(points, corners), blur, choices, known)
    slack = planar_slack(extent, blur)
    groups = _planar_groups(found, slack, blur, choices)
    fault = found.edges.fault()
    if groups is not None and fault:
        raise fault
    if found.surface.closed:
        check_bounds(found)
    else:
        found = outward_sheets(found, largest_part=choices.largest_part)
        found = found if known else keep_out_of_voids(found)
    patches = None
    if groups is None:
        patches = choices.patches
        faces, said = _patched(found, fault, patches)
    else:
        faces = tuple(planar_face(found, group, slack) for group in groups)
        said = _uneven(found, groups, faces, PLANAR * extent)
    center = _given_center(found.vertices, center_of_mass)
    surface = found.surface
    if known is None:
        surface = replace(surface, center_given=center is not None)
    solid = found if surface.closed else hull(found.vertices)
    check_volume(solid)
    volume, middle, inertia = mass_properties(solid, center)
    return {
        "vertices": found.vertices,
        "triangles": found.triangles,
        "faces": faces,
        "volume": volume,
        "center_of_mass": middle,
        "inertia": inertia,
        "content_sha256": content_hash(found.vertices, found.triangles),
        "patches": patches,
        "surface": surface,
        "notes": (*surface.notes(), *said),
    }


def _uneven(
    found: SoundSurface, groups: list[Indices], faces: tuple[Face, ...], usual: float
) -> list[str]:
    """Say how far corners are off the planes of their faces, if that is more than usual [m]."""
    off = max(
        float(np.abs((found.corners[group] - face.centroid) @ face.normal).max())
        for group, face in zip(groups, faces, strict=True)
    )
    if off <= usual:
        return []
    return [f"the coordinates are rounded: corners are up to {1e3 * off:.2g} mm off their faces"]


def _flatness(rounding: float, asked: float | None, extent: float) -> float:
    """Return the distance from a plane that rounding explains, 0 if next to nothing [m]."""
    if asked is not None:
        return asked
    explained = min(CORNER_ROUNDINGS * rounding, COARSEST * extent)
    return explained if explained > PLANAR * extent else 0.0


def _given_center(points: Array, center_of_mass: ArrayLike | None) -> Array | None:
    if center_of_mass is None:
        return None
    center = frozen(center_of_mass, (3,), "center_of_mass")
    low, high = points.min(axis=0), points.max(axis=0)
    slack = OUTSIDE_BOX * float((high - low).max())
    if (center < low - slack).any() or (center > high + slack).any():
        raise InputError(
            f"center_of_mass {center.tolist()} must be inside the object, from {low.tolist()} "
            f"to {high.tolist()} m"
        )
    return center


def _planar_groups(
    found: SoundSurface, slack: float, blur: float, choices: MeshChoices
) -> list[Indices] | None:
    if choices.faces == "patches":
        return None
    automatic = choices.faces == "auto"
    most = MAX_FACES if automatic else choices.max_faces
    groups = coplanar_groups(
        found, slack, blur=0.5 * slack, refit=blur > 0.0, caps=found.surface.caps, most=most
    )
    if automatic and len(groups) > most:
        return None
    if len(groups) > choices.max_faces:
        message = (
            f"the mesh has more planar faces than the limit of {choices.max_faces}; simplify the "
            "mesh, plan on nearly flat patches (--faces patches), or allow more (--max-faces)"
        )
        raise MeshError(MeshRefusal.TOO_MANY, message)
    return groups


def _patched(
    found: SoundSurface, fault: MeshError | None, limits: PatchLimits
) -> tuple[tuple[Face, ...], list[str]]:
    patches = flat_patches(found, limits, found.surface.caps)
    if len(patches) < FINGERS:
        raise MeshError(
            MeshRefusal.NOT_FLAT,
            f"only {len(patches)} patches are within {limits.spread_deg:g} deg and "
            f"{limits.depth:g} of the extent from flat, but four fingers need four patches; "
            "allow more (--patches.spread-deg, --patches.depth), or refine the mesh",
        )
    lean = max((face.spread for face in patches), default=0.0)
    off = max((face.depth for face in patches), default=0.0)
    notes = [
        f"the surface is curved; its {len(patches)} patches stand for faces, and lean from their "
        f"planes by up to {math.degrees(lean):.3g} deg and are up to {1e3 * off:.3g} mm off them"
    ]
    if fault and found.surface.closed:
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
    corners = corners.astype(np.int64)
    if len(corners) > most:
        too_many(len(corners), most)
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise MeshError(
            MeshRefusal.NON_FINITE, f"vertex {bad} must have finite coordinates, got {points[bad]}"
        )
    check_corners(corners, len(points))
    with np.errstate(over="ignore"):
        extent = float(np.ptp(points[np.unique(corners)], axis=0).max())
    if not SMALLEST_EXTENT_M <= extent <= LARGEST_EXTENT_M:
        wrong = (
            "small (without --unit it is metres, or what a 3MF file states; --scale multiplies it)"
            if extent < 1.0
            else "large (--unit mm, perhaps, or --scale)"
        )
        message = (
            f"the object is {extent:.3g} m across, expected {SMALLEST_EXTENT_M} to "
            f"{LARGEST_EXTENT_M} m; its unit makes it too {wrong}"
        )
        raise MeshError(MeshRefusal.SIZE, message)
    return points, corners


def content_hash(points: Array, corners: Indices) -> str:
    """Hash a mesh with SHA-256, vertices and triangles in sorted order."""
    order = np.lexsort(points.T[::-1])
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    renamed = place[corners]
    turns = (renamed.argmin(axis=1)[:, None] + np.arange(3)) % 3
    turned = np.take_along_axis(renamed, turns, axis=1)
    turned = turned[np.lexsort(turned.T[::-1])]
    digest = hashlib.sha256(np.ascontiguousarray(points[order] + 0.0, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(turned, dtype="<i8").tobytes())
    return digest.hexdigest()


def mass_properties(solid: Mesh, center: Array | None = None) -> tuple[float, Array, Array]:
    """Compute volume, centre unless given (3,), inertia about it (3, 3), at 1 kg/m^3."""
    a, b, c = solid.corners.transpose(1, 0, 2)
    areas = np.cross(b - a, c - b)  # normals, as long as twice the area
    total = a + b + c
    volume = float((areas[:, 0] * total[:, 0]).sum()) / 6.0
    squares = a**2 + b**2 + a * b + c * total
    uniform = np.ascontiguousarray((areas * squares).T).sum(axis=1) / 24.0 / volume
    about: Array = uniform if center is None else center
    # the inertias of the tetrahedra between the triangles and the centre
    a, b, c = a - about, b - about, c - about
    sizes = np.einsum("ti,ti->t", a, np.cross(b, c))[:, None]
    moments = sum(part.T @ (sizes * part) for part in (a, b, c, a + b + c)) / 120.0
    return volume, about, np.trace(moments) * np.eye(3) - moments
