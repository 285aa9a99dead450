"""Mesh file or triangle arrays -> Polyhedron, or a refusal with its reason; the door to trimesh.

The order of the checks: the file's size and ending, that it can be read whole, its numbers,
its topology (closed, two triangles per edge, one consistent side), its volume, and that no
two of its parts overlap. Vertices closer than `WELD` are one vertex. An inside-out mesh is
turned, and the polyhedron's notes say so. Nothing else is repaired.
"""

import hashlib
import importlib
import io
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.planar_faces import FlatnessLimits, planar_faces
from grasp_core.solids import Solid, intersection_volume, triangulate, union_volume
from grasp_core.values import Polyhedron

AnyPolyhedron = TypeVar("AnyPolyhedron", bound=Polyhedron)

UNITS_M = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
FORMATS = ("obj", "stl", "ply", "off", "glb")

MAX_FILE_BYTES = 64 * 2**20
MAX_TRIANGLES = 200_000
SMALLEST_EXTENT_M, LARGEST_EXTENT_M = 5e-4, 20.0
"""Half a millimetre to twenty metres: outside it the unit is almost surely wrong."""
WELD = 1e-8
"""Vertices closer than this, relative to the extent, are one: single precision in a file
keeps 6e-8, and equal numbers in a file are equal to the last bit."""
THINNEST = 1e-9
"""Least volume relative to the cube of the extent."""
OVERLAP = 1e-6
"""Shared volume of two parts, relative to the whole, that counts as overlap; parts that
only touch share what rounding leaves."""

DEFAULT_FLATNESS = FlatnessLimits()


def load_polyhedron(
    path: str | Path, *, unit: str = "m", flatness: FlatnessLimits = DEFAULT_FLATNESS
) -> Polyhedron:
    """Read a solid from a mesh file.

    Args:
        path: An OBJ, STL, PLY, OFF or GLB file.
        unit: What one unit in the file is: "m", "cm", "mm" or "in".
        flatness: How far triangles may deviate and still be one planar face.

    Raises:
        InputError: The unit is unknown.
        MeshError: The file is not a solid; its `reason` says why.
    """
    if unit not in UNITS_M:
        raise InputError(f"unit must be one of {', '.join(UNITS_M)}, got {unit!r}")
    path = Path(path)
    vertices, triangles, data = _read(path)
    return polyhedron_from_mesh(
        vertices * UNITS_M[unit],
        triangles,
        name=path.stem,
        source_sha256=hashlib.sha256(data).hexdigest(),
        flatness=flatness,
    )


def polyhedron_from_mesh(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    name: str = "object",
    source_sha256: str | None = None,
    flatness: FlatnessLimits = DEFAULT_FLATNESS,
    kind: type[AnyPolyhedron] = Polyhedron,
) -> AnyPolyhedron:
    """Check a triangle mesh and build the polyhedron of its planar faces.

    Args:
        vertices: (n, 3) [m].
        triangles: Vertex indices, (t, 3).
        name: What to call the object.
        source_sha256: Hash of the file it came from, if any.
        flatness: How far triangles may deviate and still be one planar face.
        kind: The class to build.

    Raises:
        MeshError: The mesh is not a solid; its `reason` says why.
    """
    points, corners = _checked_arrays(vertices, triangles)
    points, corners, dropped = _welded(points, corners)
    _check_topology(corners)
    notes = [f"dropped {dropped} triangles without area"] if dropped else []
    corners, flipped = _oriented(points, corners)
    if flipped:
        notes.append("the mesh was inside out; its triangles were turned")
    content = _content_hash(points, corners)
    mass: Any = _trimesh("triangles").mass_properties(points[corners], density=1.0)
    return kind(
        name=name,
        vertices=points,
        triangles=corners,
        faces=planar_faces(points, corners, flatness, triangulate),
        volume=float(mass.volume),
        center_of_mass=np.asarray(mass.center_mass),
        inertia=np.asarray(mass.inertia),
        content_sha256=content,
        source_sha256=source_sha256 or content,
        notes=tuple(notes),
    )


def _trimesh(submodule: str) -> Any:
    return importlib.import_module(f"trimesh.{submodule}")


def _read(path: Path) -> tuple[Array, Indices, bytes]:
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        message = f"{path.name}: the ending must be one of {', '.join(FORMATS)}, got {kind!r}"
        raise MeshError(MeshRefusal.FORMAT, message)
    try:
        size = path.stat().st_size
        data = path.read_bytes() if size <= MAX_FILE_BYTES else b""
    except OSError as error:
        message = f"{path}: cannot be read ({error.strerror}); check the path and its rights"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if size > MAX_FILE_BYTES:
        message = f"{path.name}: {size} bytes is over the limit of {MAX_FILE_BYTES}; simplify it"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    if not data:
        raise MeshError(MeshRefusal.EMPTY, f"{path.name}: the file is empty")
    expected = _obj_triangle_count(path.name, data) if kind == "obj" else None
    vertices, triangles = _parsed(path.name, kind, data)
    if expected is not None and expected != len(triangles):
        message = f"{path.name}: {expected} triangles are written, {len(triangles)} were readable"
        raise MeshError(MeshRefusal.UNREADABLE, message)
    return vertices, triangles, data


def _parsed(name: str, kind: str, data: bytes) -> tuple[Array, Indices]:
    try:
        scene = _trimesh("exchange.load").load_scene(
            io.BytesIO(data), file_type=kind, process=False, skip_materials=True
        )
        whole = scene.to_mesh() if scene.geometry else None
    except Exception as error:  # trimesh's parsers raise whatever the bytes led them to
        message = f"{name}: not a whole {kind.upper()} file; export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if whole is None or not len(getattr(whole, "faces", ())):
        raise MeshError(MeshRefusal.EMPTY, f"{name}: holds no triangles")
    return np.asarray(whole.vertices, dtype=np.float64), np.asarray(whole.faces, dtype=np.int64)


def _obj_triangle_count(name: str, data: bytes) -> int:
    """Count the triangles an OBJ text declares, refusing what a lenient parser would skip."""
    vertices = triangles = 0
    for number, line in enumerate(data.decode("utf-8", errors="replace").splitlines(), 1):
        words = line.split()
        if not words or words[0] not in {"v", "f"}:
            continue
        try:
            if words[0] == "v":
                vertices += 1
                finite = len(words) > 3 and np.isfinite([float(word) for word in words[1:4]]).all()  # noqa: PLR2004 - v x y z
                if not finite:
                    raise MeshError(
                        MeshRefusal.NON_FINITE,
                        f"{name}, line {number}: a vertex needs three finite numbers",
                    )
                continue
            corners = [int(word.split("/")[0]) for word in words[1:]]
        except ValueError as error:
            message = f"{name}, line {number}: not a number ({error})"
            raise MeshError(MeshRefusal.UNREADABLE, message) from error
        if any(corner == 0 or abs(corner) > vertices for corner in corners):
            message = f"{name}, line {number}: a face names a vertex outside 1..{vertices}"
            raise MeshError(MeshRefusal.INDEX, message)
        triangles += max(len(corners) - 2, 0)
    return triangles


def _checked_arrays(vertices: ArrayLike, triangles: ArrayLike) -> tuple[Array, Indices]:
    points = np.array(vertices, dtype=np.float64)
    corners = np.array(triangles)
    if points.ndim != 2 or corners.ndim != 2 or points.shape[1:] != (3,) or not corners.size:  # noqa: PLR2004
        message = f"need vertices (n, 3) and triangles (t, 3), got {points.shape}, {corners.shape}"
        raise MeshError(MeshRefusal.EMPTY, message)
    if corners.shape[1] != 3 or corners.dtype.kind not in "iu":  # noqa: PLR2004
        message = f"triangles must be whole numbers (t, 3), got {corners.dtype} {corners.shape}"
        raise MeshError(MeshRefusal.INDEX, message)
    if len(corners) > MAX_TRIANGLES:
        message = f"{len(corners)} triangles are over the limit of {MAX_TRIANGLES}; simplify it"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise MeshError(MeshRefusal.NON_FINITE, f"vertex {bad} is {points[bad]}, not finite")
    if corners.min() < 0 or corners.max() >= len(points):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        message = f"a triangle names vertex {wrong}, there are 0..{len(points) - 1}"
        raise MeshError(MeshRefusal.INDEX, message)
    extent = float(np.ptp(points[np.unique(corners)], axis=0).max())
    if not SMALLEST_EXTENT_M <= extent <= LARGEST_EXTENT_M:
        message = (
            f"the object is {extent:.3g} m across, expected {SMALLEST_EXTENT_M} to "
            f"{LARGEST_EXTENT_M} m; is the unit right (--unit mm)?"
        )
        raise MeshError(MeshRefusal.SIZE, message)
    return points, corners.astype(np.int64)


def _welded(points: Array, corners: Indices) -> tuple[Array, Indices, int]:
    """Join vertices closer than WELD, drop unused ones and collapsed triangles."""
    spatial: Any = importlib.import_module("scipy.spatial")
    graph: Any = importlib.import_module("scipy.sparse")
    used, corners = np.unique(corners, return_inverse=True)
    points, corners = points[used], corners.reshape(-1, 3)
    reach = WELD * float(np.ptp(points, axis=0).max())
    pairs = spatial.cKDTree(points).query_pairs(reach, output_type="ndarray")
    links = graph.coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    _, label = graph.csgraph.connected_components(links, directed=False)
    _, first, order = np.unique(label, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    points, corners = points[np.sort(first)], rank[order][corners]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return points, corners[whole], int((~whole).sum())


def _check_topology(corners: Indices) -> None:
    """Each undirected edge must belong to two triangles that run along it both ways."""
    tail, head = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    edges, where, uses = np.unique(
        np.sort(np.column_stack([tail, head]), axis=1), axis=0, return_inverse=True,
        return_counts=True,
    )  # fmt: skip
    if (uses == 1).any():
        message = f"{int((uses == 1).sum())} edges belong to one triangle only; close the surface"
        raise MeshError(MeshRefusal.OPEN, message)
    if (uses != 2).any():  # noqa: PLR2004 - the two sides of an edge
        message = f"edge {edges[uses != 2][0].tolist()} belongs to {uses[uses != 2][0]} triangles"  # noqa: PLR2004
        raise MeshError(MeshRefusal.NON_MANIFOLD, message)
    forward = np.bincount(where.ravel(), weights=tail < head)
    if (forward != 1).any():
        message = (
            f"{int((forward != 1).sum())} edges have both triangles on the same side; wind all "
            "triangles counter-clockwise seen from outside"
        )
        raise MeshError(MeshRefusal.WINDING, message)


def _oriented(points: Array, corners: Indices) -> tuple[Indices, bool]:
    """Turn an inside-out mesh; refuse flat, inconsistent and overlapping parts."""
    extent = float(np.ptp(points, axis=0).max())
    total = Solid(points, corners).volume
    if abs(total) < THINNEST * extent**3:
        message = f"the volume is {total:.3g} m^3; a solid must have one"
        raise MeshError(MeshRefusal.ZERO_VOLUME, message)
    if total < 0.0:
        corners = corners[:, ::-1]
    parts = _parts(points, corners)
    bodies = [part for part in parts if part.volume > 0.0]
    cavities = [Solid(part.vertices, part.triangles[:, ::-1]) for part in parts if part.volume <= 0]
    slack = OVERLAP * abs(total)
    if len(bodies) > 1 and sum(body.volume for body in bodies) - union_volume(bodies) > slack:
        message = f"{len(bodies)} solids overlap; unite them into one surface first"
        raise MeshError(MeshRefusal.OVERLAP, message)
    if len(bodies) > 1:
        message = f"{len(bodies)} separate solids; a grasp holds one, so give one solid a file"
        raise MeshError(MeshRefusal.SEPARATE, message)
    for cavity in cavities:
        inside = sum(intersection_volume(body, cavity) for body in bodies)
        if cavity.volume - inside > slack:
            message = "one part is inside out and not a cavity of another; turn its triangles"
            raise MeshError(MeshRefusal.WINDING, message)
    return corners, total < 0.0


def _parts(points: Array, corners: Indices) -> list[Solid]:
    """The edge-connected parts of a mesh."""
    graph: Any = importlib.import_module("scipy.sparse")
    links = graph.coo_array(
        (np.ones(corners.size), (corners.ravel(), np.roll(corners, 1, axis=1).ravel())),
        shape=(len(points),) * 2,
    )
    count, label = graph.csgraph.connected_components(links, directed=False)
    parts: list[Solid] = []
    for part in range(count):
        used, local = np.unique(corners[label[corners[:, 0]] == part], return_inverse=True)
        parts.append(Solid(points[used], local.reshape(-1, 3)))
    return parts


def _content_hash(points: Array, corners: Indices) -> str:
    """Hash of the mesh with vertices and triangles in sorted order."""
    order = np.lexsort(points.T[::-1])
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    renamed = place[corners]
    turned = np.array([np.roll(t, -int(np.argmin(t))) for t in renamed])
    turned = turned[np.lexsort(turned.T[::-1])]
    digest = hashlib.sha256(np.ascontiguousarray(points[order] + 0.0, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(turned, dtype="<i8").tobytes())
    return digest.hexdigest()


def nearest_on_surface(vertices: Array, triangles: Indices, points: Array) -> Array:
    """The surface point nearest to each of several points, (n, 3).

    Args:
        vertices: (v, 3) [m]
        triangles: (t, 3)
        points: (n, 3) [m]
    """
    corners = vertices[triangles]
    closest_point: Any = _trimesh("triangles").closest_point
    nearest = np.empty((len(points), 3))
    for place, point in enumerate(points):
        candidates = closest_point(corners, np.broadcast_to(point, (len(corners), 3)))
        nearest[place] = candidates[int(np.argmin(np.linalg.norm(candidates - point, axis=1)))]
    return nearest
