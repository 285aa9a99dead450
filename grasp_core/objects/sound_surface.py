"""Makes the surface of one solid of the triangles of a file, and says what is known of it.

Close vertices are welded, triangles are wound like their neighbours, small holes are closed, and
the shells that result are made one solid (`shells`). What remains open is left so: it may still be
used for its patches, once `sheets` has found which side is inside.
"""

from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.geometry.connectivity import components
from grasp_core.objects.booleans import Solid
from grasp_core.objects.holes import caps_of
from grasp_core.objects.sheets import check_bounds, outward_sheets
from grasp_core.objects.shells import Shells, one_solid
from grasp_core.objects.solid_checks import balanced, surface_fault, triangle_areas, welded
from grasp_core.objects.surface import Surface
from grasp_core.objects.winding import wound_alike

KNOWN = 0.02
"""Largest share of the volume that closed holes may hide, for the volume to count as known."""
NONE = -1.0
"""Distance within which no two vertices are."""


@dataclass(frozen=True, slots=True, eq=False)
class SoundSurface:
    """Welded and consistently wound triangles, with what is known of them."""

    points: Array
    """Vertices, (n, 3) [m]."""
    corners: Indices
    """Vertex indices, (t, 3)."""
    surface: Surface
    fault: MeshError | None
    """Why the triangles do not bound a solid with planar faces; None if they do."""

    def check_bounds(self) -> None:
        """Refuse a closed surface if parts of it do not bound the solid."""
        check_bounds(self.points, self.corners)

    def outward(self, *, largest_part: bool) -> "SoundSurface":
        """Return this surface with an open one oriented outwards; a closed one is so already."""
        if self.surface.closed:
            self.check_bounds()
            return self
        found = outward_sheets(self.points, self.corners, largest_part=largest_part)
        return _with_shells(self, found)


def sound_surface(
    vertices: Array,
    triangles: Indices,
    flatness_m: float,
    *,
    most_parts: int,
    largest_part: bool,
    known: Surface | None = None,
) -> SoundSurface:
    """Make one surface of triangles.

    Takes `vertices` (n, 3) [m]; `triangles` (t, 3); `flatness_m` [m].
    """
    if known is None:
        points, corners, said = _joined(vertices, triangles, flatness_m, most_parts)
        surface = Surface(flatness_m=flatness_m, repairs=tuple(said))
        if surface_fault(corners):
            corners, surface = _capped(points, corners, surface)
    else:  # vertices that were kept apart may be equal, where a united solid touches itself
        points, corners, _ = welded(vertices, triangles, NONE)
        surface = known
        if len(known.caps) and known.caps.max() >= len(corners):
            raise InputError(
                f"caps must be numbers of triangles below {len(corners)}, got {known.caps.max()}"
            )
    surface = replace(surface, closed=balanced(corners))
    found = SoundSurface(points, corners, surface, surface_fault(corners))
    if not surface.closed:
        return found
    whole = one_solid(points, corners, surface.caps, most=most_parts, largest_part=largest_part)
    return _with_shells(found, whole)


def _joined(
    vertices: Array, triangles: Indices, flatness_m: float, most_parts: int
) -> tuple[Array, Indices, list[str]]:
    """Weld close vertices, and wind triangles like their neighbours; also say what was changed."""
    points, corners, dropped = welded(vertices, triangles)
    said = [f"dropped {dropped} triangles without area"] if dropped else []
    fault = surface_fault(corners)
    if fault and fault.reason is MeshRefusal.WINDING:
        corners, turned = _wound(points, corners)
        said.append(f"triangles wound against their neighbours were turned, {turned} in all")
        fault = surface_fault(corners)
    if fault and fault.reason is MeshRefusal.NON_MANIFOLD:
        apart = _welded_apart(vertices, triangles, most_parts)
        if apart is not None:
            points, corners = apart
    elif fault and flatness_m:
        closer, joined, _ = welded(points, corners, 0.5 * flatness_m)
        if surface_fault(joined) is None:
            points, corners = closer, joined
            said.append("vertices that rounding had moved apart were joined")
    return points, corners, said


def _welded_apart(vertices: Array, triangles: Indices, most: int) -> tuple[Array, Indices] | None:
    """Weld each part of a file by itself, since parts that touch are no longer apart once welded.

    Parts share no vertex in the file. None if there is one part, more than `most`, or if a part
    does not bound a solid.
    """
    sides = np.column_stack([triangles.ravel(), np.roll(triangles, 1, axis=1).ravel()])
    _, label = np.unique(components(len(vertices), sides)[triangles[:, 0]], return_inverse=True)
    if not 1 <= label.max() < most:
        return None
    points, corners, count = list[Array](), list[Indices](), 0
    for part in range(int(label.max()) + 1):
        mine, local, _ = welded(vertices, triangles[label == part])
        if surface_fault(local) is not None:
            return None
        points.append(mine)
        corners.append(local + count)
        count += len(mine)
    return np.concatenate(points), np.concatenate(corners)


def _with_shells(found: SoundSurface, made: Shells) -> SoundSurface:
    surface = replace(
        found.surface,
        caps=made.caps,
        dropped=max(found.surface.dropped, made.dropped),
        repairs=(*found.surface.repairs, *made.said),
    )
    fault = surface_fault(made.corners) if found.surface.closed else found.fault
    return SoundSurface(made.points, made.corners, surface, fault)


def _wound(points: Array, corners: Indices) -> tuple[Indices, int]:
    """Wind triangles like their neighbours; also return how many were turned."""
    found = wound_alike(corners, triangle_areas(points, corners))
    if found is None:
        raise MeshError(
            MeshRefusal.WINDING,
            "the surface has only one side, so its triangles cannot be wound alike; repair it in a "
            "modelling program",
        )
    return found[0], int(found[1].sum())


def _capped(points: Array, corners: Indices, surface: Surface) -> tuple[Indices, Surface]:
    """Close the holes of a surface if they are small, and say so."""
    caps = caps_of(points, corners)
    if caps is None:
        return corners, surface
    whole = np.concatenate([corners, caps.triangles])
    volume = abs(Solid(points, whole).volume)
    if not (volume > 0.0 and caps.hidden <= KNOWN * volume):
        return corners, surface
    # a cap that is thinner than rounding is a crack between triangles that meet, not a hole
    areas = triangle_areas(points, caps.triangles)
    sides = points[caps.triangles] - points[np.roll(caps.triangles, 1, axis=1)]
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    crack = 1e-6 * float(np.ptp(points, axis=0).max())
    wide = 2.0 * areas > max(crack, surface.flatness_m) * longest
    holes = np.unique(caps.hole_of[wide])
    cracks = ("cracks between triangles that meet were closed",) * (len(holes) < len(caps.widths))
    return whole, replace(
        surface,
        caps=len(corners) + np.flatnonzero(wide),
        holes=len(holes),
        largest_hole_m=float(caps.widths[holes].max(initial=0.0)),
        volume_error=caps.hidden / volume,
        repairs=(*surface.repairs, *cracks),
    )
