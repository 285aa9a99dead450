"""Estimates masses and inertias of a hand's links from their shapes, where no source states them.

Shapes are taken as solid and of one density, and as apart where they overlap. A shape with rounded
edges has its true volume, and the inertia of the box around it.
"""

import math
from collections.abc import Sequence

import numpy as np

from grasp_core.hands.hand import PALM, Hand, Link, LinkShape

DENSITY_KG_M3 = 1000.0
"""Density of links: the one that MuJoCo takes itself."""
BALL = LinkShape(np.zeros(3), np.eye(3), np.zeros(3), 0.01)
"""What a link without shapes is taken for."""
LEAST_KG, LEAST_M = 1e-6, 1e-6
"""Least mass of a link [kg], and least length of a shape [m]: the simulator refuses none at all."""


def hand_inertials(hand: Hand) -> dict[str, dict[str, object]]:
    """Return the MJCF inertial of the palm and of each link, by name."""
    own = {link.name: _inertial(link.shapes, link) for link in hand.links}
    return {PALM: _inertial(hand.palm, None), **own}


def _inertial(shapes: Sequence[LinkShape], link: Link | None) -> dict[str, object]:
    """Return the inertial of shapes, with the mass and centre that are known of their link."""
    shapes = shapes or (BALL,)
    known = None if link is None else link.mass_kg
    center = None if link is None else link.center_of_mass
    volumes = np.array([_volume(shape) for shape in shapes])
    middles = np.array([shape.position for shape in shapes])
    mass = DENSITY_KG_M3 * float(volumes.sum()) if known is None else max(known, LEAST_KG)
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
