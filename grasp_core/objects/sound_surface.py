"""Makes the surface of one solid of the triangles of a file, and says what is known of it.

Close vertices are welded, triangles are wound like their neighbours, small holes are closed, and
the shells that result are made one solid (`shells`). What remains open is left so: it may still be
used for its patches, once `sheets` has found which side is inside.

The volume that a hole may hide is bounded by that of half a ball: a cap of area A across a hole of
width d is off by at most A d / 3 if the true surface stays within the half-ball over the hole.

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
from grasp_core.objects.shells import one_solid, wound_alike
from grasp_core.objects.surface import Mesh, SoundSurface, Surface, components

KNOWN = 0.02
"""Largest share of the volume that closed holes may hide, for the volume to count as known."""
FLAT = 1e-9
"""Area of a loop in the plane that fits it, relative to its width squared, below which it is a
crack between triangles that meet."""
WELD = 1e-8
"""Distance below which vertices are joined, relative to the extent: single precision in a file
keeps 6e-8, and vertices that were equal before are equal to the last bit."""


def sound_surface(
    given: Mesh, flatness_m: float, choices: MeshChoices, known: Surface | None
) -> SoundSurface:
    """Make one surface of triangles."""
    if known is None:
        mesh, said = _joined(given, flatness_m, choices.max_parts)
        surface = Surface(flatness_m=flatness_m, repairs=tuple(said))
        if mesh.edges.fault():
            mesh, surface = _capped(mesh, surface)
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
    return one_solid(found, choices) if closed else found


def _joined(given: Mesh, flatness_m: float, most_parts: int) -> tuple[Mesh, list[str]]:
    """Weld close vertices, and wind triangles like their neighbours; also say what was changed."""
    mesh, dropped = welded(given)
    said = [f"dropped {dropped} triangles without area"] if dropped else []
    fault = mesh.edges.fault()
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
    if fault and fault.reason is MeshRefusal.NON_MANIFOLD:
        mesh = _welded_apart(given, most_parts) or mesh
    elif fault and flatness_m:
        closer, _ = welded(mesh, 0.5 * flatness_m)
        if closer.edges.fault() is None:
            mesh = closer
            said.append("vertices that rounding had moved apart were joined")
    return mesh, said


def _welded_apart(given: Mesh, most: int) -> Mesh | None:
    """Weld parts without common vertices one by one; None unless all of several bound solids."""
    vertices, triangles = given.vertices, given.triangles
    sides = np.column_stack([triangles.ravel(), np.roll(triangles, 1, axis=1).ravel()])
    _, label = np.unique(components(len(vertices), sides)[triangles[:, 0]], return_inverse=True)
    if not 1 <= label.max() < most:
        return None
    parts = [welded(Mesh(vertices, triangles[label == part]))[0] for part in range(label.max() + 1)]
    if any(part.edges.fault() for part in parts):
        return None
    counts = [len(part.vertices) for part in parts]
    joined = [part.triangles + sum(counts[:place]) for place, part in enumerate(parts)]
    return Mesh(np.concatenate([part.vertices for part in parts]), np.concatenate(joined))


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
    hidden = float(np.array([each.areas.sum() for each in caps]) @ widths) / 3.0
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
    if len(loop) == 3 or length <= FLAT * size**2:  # noqa: PLR2004
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
CROWDED = 64
"""Largest number of neighbours on the line that are compared with a point one by one."""
MOST_LINKS = 100
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
        if step > CROWDED:
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
    if pairs > MOST_LINKS * len(points):
        raise InputError(
            f"{pairs} pairs of points are within {reach:.3g} of each other, more than {MOST_LINKS} "
            "per point; merge points that coincide first"
        )
    return np.asarray(tree.query_pairs(reach, output_type="ndarray"), dtype=np.int64)
