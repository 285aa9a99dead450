"""Repairs a mesh, and makes one surface of its triangles.

Close vertices are welded, triangles are wound like their neighbours, small holes are closed, and
the shells that result are made one solid (`shells`). What remains open is left so.

The volume that a hole may hide is bounded by that of half an ellipsoid over it, half as high as the
hole is wide: a cap of area A across a hole of width w is off by at most A w / 3 if the true surface
stays within. For a round hole this is half a ball. The width is the second largest extent along the
principal axes of the hole's border, so that long slits count for what they are.

Close vertices are linked and connected parts found with numpy, since importing scipy's graphs takes
longer than planning a small object does. Its search tree is used only where points are dense.
"""

import importlib
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.geometry.polygons import plane_frame
from grasp_core.mesh_files.limits import MeshChoices
from grasp_core.objects.booleans import triangulate
from grasp_core.objects.shells import keep_out_of_voids, one_solid, wound_alike
from grasp_core.objects.surface import TRIANGLES_AT_EDGE, Mesh, SoundSurface, Surface, components
from grasp_core.objects.touching_parts import pulled_apart

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
    """Make one surface of triangles, repaired unless it is known already."""
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
LINKS_PER_POINT = 100


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
