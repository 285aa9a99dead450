"""Computes volume, centre of mass and inertia of a solid of uniform density from its surface.

By the divergence theorem volume and centre are integrals over the surface, of x n_x and of x_i^2
n_i / 2. On a triangle with corners a, b, c they are polynomials in the corners. Second moments are
summed over the tetrahedra between the centre and the triangles.

Trimesh computes the same integrals, and tests compare the two. This module does not use trimesh,
because importing it takes 180 ms, a fourth of the time in which a fresh process plans on a small
object.

Source: Eberly, "Polyhedral mass properties (revisited)", 2002.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, frozen
from grasp_core.objects.booleans import Solid


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """Mass properties of a solid at density 1 kg/m^3."""

    volume: float
    """Volume [m^3]."""
    center: Array
    """Centre of mass, (3,) [m]."""
    inertia: Array
    """Inertia about the centre, (3, 3) [kg m^2]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", frozen(self.center, (3,), "center"))
        object.__setattr__(self, "inertia", frozen(self.inertia, (3, 3), "inertia"))


def mass_properties(solid: Solid, center: Array | None = None) -> MassProperties:
    """Compute the mass properties of a solid of uniform density.

    Takes `center` (3,) [m].
    """
    a, b, c = solid.vertices[solid.triangles].transpose(1, 0, 2)
    areas = np.cross(b - a, c - b)  # normals, as long as twice the area
    total = a + b + c
    volume = float((areas[:, 0] * total[:, 0]).sum()) / 6.0
    squares = a**2 + b**2 + a * b + c * total
    uniform = np.ascontiguousarray((areas * squares).T).sum(axis=1) / 24.0 / volume
    about: Array = uniform if center is None else center
    return MassProperties(volume, about, _inertia(a - about, b - about, c - about))


def _inertia(a: Array, b: Array, c: Array) -> Array:
    """Sum the inertias of tetrahedra between triangles and the origin, (3, 3)."""
    sizes = np.einsum("ti,ti->t", a, np.cross(b, c))[:, None]
    moments = sum(part.T @ (sizes * part) for part in (a, b, c, a + b + c)) / 120.0
    return np.trace(moments) * np.eye(3) - moments
