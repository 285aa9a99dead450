"""Estimates masses and inertias of a hand's links from their shapes, where no source states them.

Shapes are taken as solid and of one density, and as apart where they overlap. A shape with rounded
edges has its true volume, and the inertia of the box around it.
"""

import math
from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array
from grasp_core.hands.hand import Hand, Link, LinkShape

LEAST_KG, LEAST_M = 1e-6, 1e-6
"""Least mass of a link [kg], and least length of a shape [m]: the simulator refuses none at all."""


def link_inertials(hand: Hand, density_kg_m3: float) -> dict[str, dict[str, object]]:
    """Return the MJCF inertial of each link: its own mass and centre, or those of its shapes."""
    return {link.name: _of_link(link, density_kg_m3) for link in hand.links}


def _of_link(link: Link, density_kg_m3: float) -> dict[str, object]:
    """Return a link's inertial; a link without shapes has those of a ball of 1 cm."""
    shapes = link.shapes or (LinkShape(np.zeros(3), np.eye(3), np.zeros(3), 0.01),)
    return inertial(shapes, density_kg_m3, link.mass_kg, link.center_of_mass)


def inertial(
    shapes: Sequence[LinkShape], density_kg_m3: float, mass_kg: float | None, center: Array | None
) -> dict[str, object]:
    """Return the MJCF inertial of shapes that move as one.

    Args:
        shapes: The shapes, at least one.
        density_kg_m3: Their density, where their mass is not known.
        mass_kg: Their mass together, where it is known.
        center: Their centre of mass, where it is known, (3,) [m].
    """
    volumes = np.array([_volume(shape) for shape in shapes])
    middles = np.array([shape.position for shape in shapes])
    mass = density_kg_m3 * float(volumes.sum()) if mass_kg is None else max(mass_kg, LEAST_KG)
    masses = mass * volumes / volumes.sum()
    middle = masses @ middles / mass
    second = np.zeros((3, 3))
    for shape, part, place in zip(shapes, masses, middles - middle, strict=True):
        sides = shape.rotation * (shape.half_sizes + shape.radius)
        second += part * (sides @ sides.T / 3.0 + np.outer(place, place))
    inertia = np.trace(second) * np.eye(3) - second
    return {
        "pos": middle if center is None else center, "mass": mass,
        "fullinertia": inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
    }  # fmt: skip


def _volume(shape: LinkShape) -> float:
    """Return the volume of a box with rounded edges [m^3], by Steiner's formula."""
    (a, b, c), r = np.maximum(2.0 * shape.half_sizes, LEAST_M).tolist(), shape.radius
    area, edges = 2.0 * (a * b + b * c + c * a), a + b + c
    return a * b * c + area * r + math.pi * r**2 * edges + 4.0 / 3.0 * math.pi * r**3
