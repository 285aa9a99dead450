"""Reads the mesh file of a part that has changed, the way its old version was read.

A `grasps.json` does not say in which unit its mesh file was. Where the user does not say so either,
it is taken to be the unit in which the changed part is most nearly as large as the old one, by the
diagonals of their bounding boxes. A part that has then become larger or smaller by more than
`SURE_GROWTH` could be in another unit, so it is refused.
"""

import math
from pathlib import Path

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import read_triangles
from grasp_core.objects.build import DEFAULT_LIMITS
from grasp_core.objects.polyhedron import UNITS_M, Polyhedron, load_polyhedron
from grasp_core.objects.shells import SMALL

SURE_GROWTH = 1.5
"""Largest ratio of the two sizes at which the unit is sure: an inch and a centimetre, the two units
nearest to each other, differ by 2.54, which is more than the square of it."""
SAME = 1e-6
"""Largest relative difference of two lengths that differ by rounding and joined vertices only."""


def load_changed_part(
    path: Path,
    old: Polyhedron,
    unit: str,
    limits: MeshLimits = DEFAULT_LIMITS,
    *,
    scale: float = 1.0,
) -> Polyhedron:
    """Read a changed part from its mesh file, with exact planar faces.

    A centre of mass that was given for the old part is kept; otherwise it is that of uniform
    density.
    """
    return load_polyhedron(
        path,
        unit=unit,
        scale=scale,
        faces="planar",
        largest_part=old.surface.dropped > SMALL,
        center_of_mass=given_center(old),
        limits=limits,
    )


def given_center(body: Polyhedron) -> Array | None:
    """Return the centre of mass of a part if it was given and is not that of uniform density."""
    return body.center_of_mass if body.surface.center_given else None


def growth(old: Polyhedron, new: Polyhedron) -> float:
    """Return the size of a changed part relative to the old one."""
    return _diagonal(new.vertices) / _diagonal(old.vertices)


def fitting_unit(
    path: Path, old: Polyhedron, limits: MeshLimits = DEFAULT_LIMITS, *, scale: float = 1.0
) -> str:
    """Find the unit in which a mesh file holds a part about as large as the old one."""
    size = scale * _times(path, old, limits)
    off = {unit: abs(math.log(size * length)) if size > 0.0 else math.inf
           for unit, length in UNITS_M.items()}  # fmt: skip
    best = min(off, key=off.__getitem__)
    if off[best] > math.log(SURE_GROWTH):
        raise InputError(
            f"{path}: the unit of the changed part is not clear: in {best}, which fits best, its "
            f"size is {size * UNITS_M[best]:.3g} times that of the old part; say the unit, and the "
            "scale if it has one"
        )
    return best


def fitting_lengths(
    path: Path, body: Polyhedron, limits: MeshLimits = DEFAULT_LIMITS
) -> tuple[str, float]:
    """Find a unit and a scale at which a mesh file is as large as the body that was read from it.

    Unless the scale is 1, the unit is the metre, and the scale has nine digits.
    """
    length = float(f"{1.0 / _times(path, body, limits):.9g}")
    same = (unit for unit, metres in UNITS_M.items() if math.isclose(length, metres, rel_tol=SAME))
    return next(((unit, 1.0) for unit in same), ("m", length))


def _times(path: Path, body: Polyhedron, limits: MeshLimits) -> float:
    """Return the size of a mesh file, in its own unit, relative to that of a body."""
    mesh = read_triangles(path, limits)
    return _diagonal(mesh.vertices[np.unique(mesh.triangles)]) / _diagonal(body.vertices)


def _diagonal(vertices: Array) -> float:
    return float(np.linalg.norm(np.ptp(vertices, axis=0))) if len(vertices) else 0.0
