"""Makes one rigid body of convex pieces that touch or overlap, as simulators take objects.

Programs such as CoACD take an object apart into convex pieces. Their files round coordinates to six
digits, so pieces that touch are parted by gaps as thin, and their union is often several solids.
Planning needs one solid whose faces are known, and refuses such unions. A grasp that is recorded
can be judged on them: the body made here keeps the triangles of the union as they are, has their
volume, centre of mass and inertia, and no faces.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import Quantity, value_of
from grasp_core.arrays import Polygon, frozen
from grasp_core.declared import Declared, declared
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.limits import PatchLimits
from grasp_core.objects.booleans import Solid, gap_between, hull, union
from grasp_core.objects.build import (
    LARGEST_EXTENT_M,
    SMALLEST_EXTENT_M,
    content_hash,
    mass_properties,
)
from grasp_core.objects.mesh_repair import welded
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.shells import LEAST_VOLUME, NEARLY, check_volume
from grasp_core.objects.surface import Mesh
from grasp_core.objects.touching_parts import pulled_apart

MOST_PIECES = 1000
"""Largest number of pieces of an object; their union takes some two seconds."""
MOST_COMPARED = 16
"""Largest number of separate parts between which gaps are measured."""
CONVEX = 1e-4
"""Largest difference between the volumes of a convex piece and its hull, as a share of the hull's:
coordinates of six digits change that of a piece of one by .01 by 1e-4."""


@declared
class PiecedObject(Declared):
    """A rigid body, and the convex pieces that it is made of, if it is made of pieces."""

    body: Polyhedron
    """The union of the pieces. Where there are pieces, it has no faces."""
    pieces: tuple[Polygon, ...] | None = None
    """Corners of each convex piece, (n, 3) [m], in the frame of the body; None where the object was
    one solid."""


def pieced_object(
    pieces: Sequence[Mesh | ArrayLike], *, scale: float = 1.0, name: str = "object"
) -> PiecedObject:
    """Unite convex pieces, which may touch, overlap or be apart, into one rigid body.

    The convex hull of a piece stands for it. Notes of the body say so where a piece was not convex,
    and tell of flat pieces, which are left out, and of parts that are apart.

    Args:
        pieces: Meshes of the pieces, or their corners, (n, 3) each.
        scale: Factor on the coordinates that makes them metres.
        name: Name of the body.

    Raises:
        InputError: The scale or a corner is not a finite number.
        MeshError: There are no pieces or too many, all of them are flat, or their size is out of
            range.
    """
    factor = value_of(Quantity, scale, "scale")
    if not 0 < len(pieces) <= MOST_PIECES:
        reason = MeshRefusal.TOO_MANY if len(pieces) else MeshRefusal.EMPTY
        raise MeshError(reason, f"expected 1 to {MOST_PIECES} convex pieces, got {len(pieces)}")
    hulls, said = _hulls_of([_scaled(piece, factor) for piece in pieces])
    solid, _ = union(hulls, [np.zeros(len(each.triangles), dtype=np.int64) for each in hulls])
    surface, _ = welded(solid)
    check_volume(surface)
    volume, center, inertia = mass_properties(surface)
    own_hash = content_hash(surface.vertices, surface.triangles)
    body = Polyhedron(
        name=name, vertices=surface.vertices, triangles=surface.triangles, faces=(), volume=volume,
        center_of_mass=center, inertia=inertia, content_sha256=own_hash,
        source_sha256=own_hash, patches=PatchLimits(), notes=(*said, *_on_parts(solid)),
    )  # fmt: skip
    return PiecedObject(body, tuple(each.vertices for each in hulls))


def _scaled(piece: Mesh | ArrayLike, factor: float) -> Mesh:
    """Check a piece, and return it in metres; a piece of corners alone has no triangles."""
    points = piece.vertices if isinstance(piece, Mesh) else piece
    corners = factor * frozen(points, (None, 3), "pieces")
    nothing = np.empty((0, 3), dtype=np.int64)
    return Mesh(corners, piece.triangles if isinstance(piece, Mesh) else nothing)


def _hulls_of(pieces: Sequence[Mesh]) -> tuple[list[Solid], list[str]]:
    """Return the hulls of pieces that are not flat; also say which pieces were not convex."""
    corners = [each.vertices[np.unique(each.triangles)] if len(each.triangles) else each.vertices
               for each in pieces]  # fmt: skip
    every = np.concatenate(corners)
    extent = float(np.ptp(every, axis=0).max()) if len(every) else 0.0
    if not SMALLEST_EXTENT_M <= extent <= LARGEST_EXTENT_M:
        raise MeshError(
            MeshRefusal.SIZE,
            f"the object is {extent:.3g} m across, expected {SMALLEST_EXTENT_M} to "
            f"{LARGEST_EXTENT_M} m; correct the scale by which its lengths are multiplied",
        )
    hulls, loose, more = list[Solid](), 0, 0.0
    for piece, points in zip(pieces, corners, strict=True):
        solid = hull(points)
        if _is_flat(solid):
            continue
        hulls.append(solid)
        if len(piece.triangles) and not _is_convex(piece, solid):
            loose, more = loose + 1, more + solid.volume - abs(piece.volume)
    if not hulls:
        message = f"all {len(pieces)} pieces of the object are flat; give pieces that have a volume"
        raise MeshError(MeshRefusal.ZERO_VOLUME, message)
    said = list[str]()
    if flat := len(pieces) - len(hulls):
        said.append(f"{flat} of {len(pieces)} pieces were flat and are left out")
    if loose:
        said.append(
            f"{loose} of {len(pieces)} pieces were not convex; their hulls stand for them and hold "
            f"{1e6 * more:.4g} cm^3 more"
        )
    return hulls, said


def _is_flat(solid: Solid) -> bool:
    return not len(solid.triangles) or solid.volume <= LEAST_VOLUME * solid.extent**3


def _is_convex(piece: Mesh, its_hull: Solid) -> bool:
    return not _is_flat(its_hull) and (
        abs(its_hull.volume - abs(piece.volume)) <= CONVEX * its_hull.volume
    )


def _on_parts(solid: Solid) -> list[str]:
    """Say so if a union is several solids, and how far each is at most from the nearest other."""
    parts = [part for part in parts_of(solid) if part.volume > 0.0]  # a void has a negative one
    if (count := len(parts)) == 1:
        return []
    said, most = f"the pieces make {count} parts", NEARLY * solid.extent
    if count <= MOST_COMPARED:
        gap = max(
            min(gap_between(one, other, most) for other in parts if other is not one)
            for one in parts
        )
        said += f" that are {'up to' if gap < most else 'more than'} {1e3 * gap:.2g} mm apart"
    return [f"{said}; they are taken as one rigid body"]


def parts_of(mesh: Mesh) -> list[Mesh]:
    """Split a mesh into parts that share no edge, once solids that touch are told apart."""
    mesh = pulled_apart(mesh) or mesh
    label = mesh.edges.parts()
    order, counts = np.argsort(label, kind="stable"), np.bincount(label)
    groups = np.split(mesh.triangles[order], np.cumsum(counts)[:-1])
    return [mesh.with_triangles(group) for group in groups]


def convex_solids(mesh: Mesh) -> list[Mesh] | None:
    """Split a mesh into convex solids; None if it is not made of two or more of them.

    Solids that touch may share vertices. A cavity, wound against the rest, is no solid.
    """
    parts = parts_of(welded(mesh)[0] if mesh.edges.fault() else mesh)
    volumes = [part.volume for part in parts]
    if not 1 < len(parts) <= MOST_PIECES or min(volumes) < 0.0 < max(volumes):
        return None
    return parts if all(_is_convex(part, hull(part.vertices)) for part in parts) else None
