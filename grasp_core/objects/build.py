"""Checks a triangle mesh and finds its faces, or refuses it with a reason.

First come the numbers of the file. Then one surface is made of the triangles: close vertices are
welded, triangles are wound like their neighbours, small holes are closed, and the shells that
result are made one solid (`shells`). What remains open is left so. Then faces are found on it:
exact planar ones, which need a closed surface, or nearly flat patches, which do not. The notes say
what was changed.

Mass properties: by the divergence theorem volume and centre are integrals over the surface, of
x n_x and of x_i^2 n_i / 2. On a triangle with corners a, b, c they are polynomials in the corners.
Second moments are summed over the tetrahedra between the centre and the triangles. Trimesh computes
the same integrals, and tests compare the two; importing it takes longer than planning.

Source: Eberly, "Polyhedral mass properties (revisited)", 2002.

The volume that a hole may hide is bounded by that of half an ellipsoid over it, half as high as the
hole is wide: a cap of area A across a hole of width w is off by at most A w / 3 if the true surface
stays within. For a round hole this is half a ball. The width is the second largest extent along the
principal axes of the hole's border, so that long slits count for what they are.

Close vertices are linked and connected parts found with numpy, since importing scipy's graphs takes
longer than planning a small object does. Its search tree is used only where points are dense.
"""

import hashlib
import importlib
import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen, real_array
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.geometry.polygons import plane_frame
from grasp_core.mesh_files.limits import MeshChoices, MeshLimits, PatchLimits
from grasp_core.mesh_files.polygons import check_corners, single_rounding, too_many
from grasp_core.objects.booleans import hull, triangulate
from grasp_core.objects.planar_faces import (
    MAX_FACES,
    PLANAR,
    coplanar_groups,
    flat_patches,
    planar_face,
    planar_slack,
)
from grasp_core.objects.shells import (
    check_bounds,
    check_volume,
    keep_out_of_voids,
    one_solid,
    outward_sheets,
    wound_alike,
)
from grasp_core.objects.surface import (
    TRIANGLES_AT_EDGE,
    Face,
    Mesh,
    SoundSurface,
    Surface,
    components,
)
from grasp_core.objects.touching_parts import pulled_apart
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


KNOWN = 0.02
"""Largest share of the volume that closed holes may hide, for the volume to count as known."""
CRACK_AREA = 1e-9
"""Area of a loop, over its width squared, below which it is a crack between triangles."""
WELD = 1e-8
"""Distance below which vertices are joined, relative to the extent: single precision in a file
keeps 6e-8, and vertices that were equal before are equal to the last bit."""


def sound_surface(
    given: Mesh, flatness_m: float, choices: MeshChoices, known: Surface | None
) -> SoundSurface:
    """Make one surface of triangles."""
    if known is None:
        mesh, said = _joined(given, flatness_m)
        surface = Surface(flatness_m=flatness_m, repairs=tuple(said))
        if mesh.edges.fault():
            mesh, surface = _capped(mesh, surface)
            mesh = pulled_apart(mesh) or mesh
    else:  # vertices that were kept apart may be equal, where a united solid touches itself
        mesh, _ = welded(given, reach=-1.0)
        surface, count = known, len(mesh.triangles)
        if len(known.caps) and known.caps.max() >= count:
            raise InputError(
                f"caps must be numbers of triangles below {count}, got {known.caps.max()}"
            )
    # a volume is enclosed where edges are run along as often in both directions
    closed = not mesh.edges.balance.any()
    found = SoundSurface(mesh.vertices, mesh.triangles, replace(surface, closed=closed))
    if not closed:
        return found
    solid = one_solid(found, choices)
    return solid if known else keep_out_of_voids(solid)


def _joined(given: Mesh, flatness_m: float) -> tuple[Mesh, list[str]]:
    """Weld close vertices, and wind triangles like their neighbours; also say what was changed."""
    mesh, dropped = welded(given)
    said = [f"dropped {dropped} triangles without area"] if dropped else []
    fault = mesh.edges.fault()
    if fault and (twice := len(mesh.triangles) - len((once := _without_repeats(mesh)).triangles)):
        mesh, fault = once, once.edges.fault()
        said.append(f"dropped {twice} triangles that were there twice")
    if fault and fault.reason is MeshRefusal.WINDING:
        wound = wound_alike(mesh.triangles, mesh.areas)
        if wound is None:
            raise MeshError(
                MeshRefusal.WINDING,
                "the surface has only one side, so its triangles cannot be wound alike; repair it "
                "in a modelling program",
            )
        triangles, turned = wound
        mesh = Mesh(mesh.vertices, triangles)
        said.append(f"triangles wound against their neighbours were turned, {turned.sum()} in all")
        fault = mesh.edges.fault()
    if fault and fault.reason is not MeshRefusal.NON_MANIFOLD and flatness_m:
        closer, _ = welded(mesh, 0.5 * flatness_m)
        if closer.edges.fault() is None:
            mesh = closer
            said.append("vertices that rounding had moved apart were joined")
    return mesh, said


def _without_repeats(mesh: Mesh) -> Mesh:
    """Drop triangles that are there twice, and those once from behind if a closed surface is left.

    Triangles stay where edges are run along as often in both directions with them, and not without:
    there, two parts have the same wall.
    """
    triangles, count = mesh.triangles, len(mesh.vertices)
    first = triangles.argmin(axis=1)[:, None]
    turned = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    once, either = (
        Mesh(mesh.vertices, triangles[np.sort(np.unique(
            (row[:, 0] * count + row[:, 1]) * count + row[:, 2], return_index=True)[1])])
        for row in (turned, np.sort(triangles, axis=1))
    )  # fmt: skip
    if not once.edges.balance.any():
        return once
    if not mesh.edges.balance.any():
        return mesh
    return either if (either.edges.uses == TRIANGLES_AT_EDGE).all() else once


def _capped(mesh: Mesh, surface: Surface) -> tuple[Mesh, Surface]:
    caps = caps_of(mesh)
    if caps is None:
        return mesh, surface
    whole = Mesh(mesh.vertices, np.concatenate([mesh.triangles, caps.triangles]))
    volume = abs(whole.volume)
    if not (volume > 0.0 and caps.hidden <= KNOWN * volume):
        return mesh, surface
    # a cap that is thinner than rounding is a crack between triangles that meet, not a hole
    corners = mesh.vertices[caps.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    wide = 2.0 * caps.areas > max(1e-6 * mesh.extent, surface.flatness_m) * longest
    holes = np.unique(caps.hole_of[wide])
    cracks = ("cracks between triangles that meet were closed",) * (len(holes) < len(caps.widths))
    return whole, replace(
        surface,
        caps=len(mesh.triangles) + np.flatnonzero(wide),
        holes=len(holes),
        largest_hole_m=float(caps.widths[holes].max(initial=0.0)),
        volume_error=caps.hidden / volume,
        repairs=(*surface.repairs, *cracks),
    )


class Caps(NamedTuple):
    """Triangles that close all holes of a surface, (c, 3), with the sizes of the holes."""

    triangles: Indices  # vertex indices, wound like the surface around them, (c, 3)
    widths: Array  # largest distance between two corners of each hole, (h,) [m]
    areas: Array  # areas of the triangles, (c,) [m^2]
    hole_of: Indices  # number of the hole that each triangle closes, (c,)
    hidden: float  # largest volume by which the caps may differ from the true surface [m^3]


def caps_of(mesh: Mesh) -> Caps | None:
    """Close the holes of a surface; None if it has none, or its open edges do not form loops."""
    loops, points = mesh.edges.open_loops(), mesh.vertices
    if not loops:
        return None
    caps = [Mesh(points, _cap(points, loop)) for loop in loops]
    widths = np.array([_width(points[loop]) for loop in loops])
    across = np.array([_across(points[loop]) for loop in loops])
    hidden = float(np.array([each.areas.sum() for each in caps]) @ across) / 3.0
    hole_of = np.repeat(np.arange(len(loops)), [len(each.triangles) for each in caps])
    return Caps(
        np.concatenate([each.triangles for each in caps]), widths,
        np.concatenate([each.areas for each in caps]), hole_of, hidden,
    )  # fmt: skip


def _cap(points: Array, loop: list[int]) -> Indices:
    """Triangulate a loop in the plane that fits it, or as a fan where that is not possible."""
    numbers: Indices = np.array(loop, dtype=np.int64)
    places = points[numbers]
    fan = np.column_stack([np.zeros(len(loop) - 2, dtype=np.int64),
                           np.arange(1, len(loop) - 1), np.arange(2, len(loop))])  # fmt: skip
    spokes = places - places.mean(axis=0)
    normal = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    length, size = float(np.linalg.norm(normal)), float(np.ptp(places, axis=0).max())
    if len(loop) == 3 or length <= CRACK_AREA * size**2:  # noqa: PLR2004
        return numbers[fan]
    flat: Array = spokes @ plane_frame(normal / length)
    found = triangulate([flat])
    return numbers[found if _covers(found, len(loop)) else fan]


def _covers(triangles: Indices, count: int) -> bool:
    """Tell whether triangles have the edges of a loop of `count` corners as their border."""
    if len(triangles) != count - 2:
        return False
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)}
    border = {edge for edge in edges if edge[::-1] not in edges}
    return border == {(k, (k + 1) % count) for k in range(count)}


def _width(places: Array) -> float:
    """Return the largest distance between two points, or a bound on it for very many."""
    if len(places) > 500:  # noqa: PLR2004 - the diagonal of the box is at most 1.8 times as long
        return float(np.linalg.norm(np.ptp(places, axis=0)))
    return float(np.linalg.norm(places[:, None] - places[None], axis=2).max())


def _across(places: Array) -> float:
    """Return the second largest extent of points along their principal axes."""
    spokes = places - places.mean(axis=0)
    axes = np.linalg.svd(spokes, full_matrices=False)[2]
    return float(np.sort(np.ptp(spokes @ axes.T, axis=0))[-2])


def welded(mesh: Mesh, reach: float | None = None) -> tuple[Mesh, int]:
    """Join close vertices, drop unused ones and collapsed triangles; also count the latter."""
    mesh = mesh.with_triangles(mesh.triangles)
    points, corners = mesh.vertices, mesh.triangles
    if reach is None:
        reach = WELD * mesh.extent
    try:
        links = close_pairs(points, reach) if reach >= 0.0 else np.empty((0, 2), dtype=np.int64)
    except InputError as error:
        raise MeshError(MeshRefusal.LIMIT, str(error)) from error
    label = components(len(points), links)
    _, first, order = np.unique(label, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    points, corners = points[np.sort(first)], rank[order][corners]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise MeshError(MeshRefusal.ZERO_VOLUME, "no triangle has an area; export a solid")
    return Mesh(points, corners[whole]), int((~whole).sum())


GENERAL = np.array([0.41421, 0.56714, 0.69315])
"""Direction of the line on which points are projected, perpendicular to no face that parts usually
have. It is shorter than one, so that projections are closer together than points."""
MOST_NEIGHBOURS = 64
"""Largest number of neighbours on the line that are compared with a point one by one."""
LINKS_PER_POINT = 100
"""Largest number of links per point."""


def close_pairs(points: Array, reach: float) -> Indices:
    """List links between points within a distance of each other, as pairs of indices, (k, 2).

    Close points have close projections on a line, so only neighbours there are compared. Equal
    points are linked in a row, and only one of them is compared with other points.
    """
    shadows = ((points - points[0]) * GENERAL).sum(axis=1)
    order = np.argsort(shadows, kind="stable")
    equal = (points[order[1:]] == points[order[:-1]]).all(axis=1)
    links = [np.column_stack([order[:-1], order[1:]])[equal]]
    order = order[np.append(True, ~equal)]
    for step in range(1, len(order)):
        near = shadows[order[step:]] - shadows[order[:-step]] <= reach
        if not near.any():
            break
        if step > MOST_NEIGHBOURS:
            links.append(order[_pairs_of_tree(points[order], reach)])
            break
        pairs = np.column_stack([order[:-step][near], order[step:][near]])
        apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        links.append(pairs[apart <= reach])
    return np.concatenate(links)


def _pairs_of_tree(points: Array, reach: float) -> Indices:
    spatial: Any = importlib.import_module("scipy.spatial")
    tree = spatial.KDTree(points)
    pairs = (int(tree.count_neighbors(tree, reach)) - len(points)) // 2
    if pairs > LINKS_PER_POINT * len(points):
        raise InputError(
            f"{pairs} pairs of points are within {reach:.3g} of each other, more than "
            f"{LINKS_PER_POINT} per point; merge points that coincide first"
        )
    return np.asarray(tree.query_pairs(reach, output_type="ndarray"), dtype=np.int64)
