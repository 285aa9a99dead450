"""Describes objects for learners: shape classes, points on the surface, and resting poses."""

import hashlib
import importlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.polygons import plane_frame
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.datasets.learning.settings import Learning
from sim_validate.execution.trials import rests

CONVEX = 0.999
"""Least share of its hull's volume that a convex object has."""
COMPACT, LONG = 0.6, 0.5
"""Least ratio of the shortest to the longest side of a compact object, and largest ratio of the
middle to the longest side of a long one; others are flat."""


def object_cells(body: Polyhedron, name: str, asked: Learning, seed: int) -> Mapping[str, Any]:
    """Return the cells of an object's row that are there on request."""
    cells: dict[str, Any] = {
        "shape_class": asked.classes.get(Path(name).name, shape_class(body)),
        "box_sides_m": box_sides(body).tolist(),
    }
    if asked.points:
        points, normals = cloud(body, asked.points, seed)
        cells |= {"cloud_points_m": points.tolist(), "cloud_normals": normals.tolist()}
    return cells


def box_sides(body: Polyhedron) -> Array:
    """Return the sides of the box with the same moments of inertia, the longest first, (3,) [m].

    For a box of mass m with sides a, b and c, I_a = m (b^2 + c^2) / 12, so that a^2 = 6 (I_b + I_c
    - I_a) / m.
    """
    moments = np.linalg.eigvalsh(body.inertia)
    squares = 6.0 * (moments.sum() - 2.0 * moments) / body.volume  # at density one
    return np.sort(np.sqrt(np.maximum(squares, 0.0)))[::-1]


def shape_class(body: Polyhedron) -> str:
    """Say in three words how an object is shaped: hollow or not, its proportions, its surface."""
    spatial: Any = importlib.import_module("scipy.spatial")
    hull = float(spatial.ConvexHull(body.vertices / body.radius).volume) * body.radius**3
    longest, middle, shortest = box_sides(body)
    proportions = "flat"
    if shortest >= COMPACT * longest:
        proportions = "compact"
    elif middle <= LONG * longest:
        proportions = "long"
    convex = "convex" if body.volume >= CONVEX * hull else "concave"
    return f"{convex} {proportions} {'planar' if body.patches is None else 'curved'}"


def cloud(body: Polyhedron, count: int, seed: int) -> tuple[Array, Array]:
    """Draw points on the surface, as likely anywhere, with unit normals into the object, (n, 3).

    The points depend on the mesh and the seed alone.
    """
    digest = hashlib.sha256(f"{seed} {body.content_sha256} cloud".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:16], "big"))
    corners: Array = body.vertices[body.triangles]
    inward = np.cross(corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 0])
    sizes: Array = np.linalg.norm(inward, axis=1)
    drawn: Array = rng.random(count) * sizes.sum()
    chosen = np.minimum(
        np.searchsorted(np.cumsum(sizes), drawn, side="right"),
        int(np.flatnonzero(sizes)[-1]),
    )
    ways: Array = rng.random((count, 2, 1))
    ways = np.where(ways.sum(axis=1, keepdims=True) > 1.0, 1.0 - ways, ways)  # back into the half
    own = corners[chosen]
    sides = own[:, 1:] - own[:, :1]
    points: Array = own[:, 0] + (ways * sides).sum(axis=1)
    return points, inward[chosen] / sizes[chosen, None]


def rest_rows(body: Polyhedron) -> Iterator[Mapping[str, Any]]:
    """Yield a row for each face of the convex hull that the object can rest on, likeliest first."""
    for number, rest in enumerate(rests(body)):
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack([plane_frame(-rest.down), -rest.down]).T
        pose[:3, 3] = -pose[:3, :3] @ body.center_of_mass
        pose[2, 3] += rest.height
        yield {
            "object_id": body.content_sha256,
            "rest": number,
            "down": rest.down.tolist(),
            "height_m": rest.height,
            "likelihood": rest.likelihood,
            "T_table_object_m": pose.tolist(),
        }
