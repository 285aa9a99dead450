"""Says which ball or block a named site, geom or body of a model gives a fingertip.

A site or sphere is the ball itself. A capsule gives the ball at the end that is farther from the
last joint. Any other geom is a block: a mesh the hull of its corners, anything else its box. A
block has sharp edges, so that its corners are given a rounding, by which it is larger all around.
The ball that stands for it lies in its box, at the end that is farther from the last joint.
"""

import importlib
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.hands.hand import SAME, LinkShape
from scenes.hand_files.chains import Tip
from scenes.hand_files.model import HandModel

ACROSS = {0: (1, 2), 1: (0, 2), 2: (0, 1)}


SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
ROUNDING = 1e-4
"""Least rounding of a block [m]."""
MOST_WAYS = 180
"""Number of directions in which the corners of a mesh are taken that has more of them."""


@dataclass(frozen=True, slots=True)
class TipBall:
    """A fingertip in the frame of its body: its ball, and its block if it is one."""

    center: Array
    radius: float
    corners: Array | None = None
    """Corners of the block, (m, 3) [m]; None for a ball."""
    rounding: float = 0.0
    cover: LinkShape | None = None
    """Box that covers the block, in place of its geom; None to keep the geom."""


def tip_ball(model: HandModel, tip: Tip, joint: Array, name: str) -> TipBall:
    """Find the ball of a fingertip.

    Takes `joint` (3,) [m].
    """
    if tip.site is not None:
        radius = float(model.site_radii[tip.site])
        if radius <= 0.0:
            raise InputError(f"{name}: site {tip.name} must have a size, the ball's radius")
        return TipBall(model.site_positions[tip.site], radius, None)
    geom = int(tip.geom or 0)
    R, kind = model.geom_rotations[geom], model.geom_kinds[geom]
    if kind == "sphere":
        return TipBall(model.geom_positions[geom], float(model.geom_sizes[geom, 0]), None)
    middle = model.geom_positions[geom] + R @ model.geom_boxes[geom, :3]
    half = model.geom_boxes[geom, 3:].copy()
    if kind == "capsule":
        axis, radius = 2, float(model.geom_sizes[geom, 0])
    else:
        axis = int(np.argmax(np.abs(R.T @ (middle - joint))))
        radius = float(half[list(ACROSS[axis])].min())
        half[axis] = max(half[axis], radius)
    sign = 1.0 if R[:, axis] @ (middle - joint) >= 0.0 else -1.0
    center = middle + sign * (half[axis] - radius) * R[:, axis]
    if kind == "capsule":
        return TipBall(center, radius, None)
    corners, rounding = _corners(model, geom)
    low, high = corners.min(axis=0) - rounding, corners.max(axis=0) + rounding
    cover = LinkShape(
        model.geom_positions[geom] + R @ (0.5 * (low + high)), R, 0.5 * (high - low) + SAME, 0.0
    )
    return TipBall(
        center, radius, model.geom_positions[geom] + corners @ R.T, rounding, cover
    )  # fmt: skip


def _corners(model: HandModel, geom: int) -> tuple[Array, float]:
    """Return corners in a geom's frame, (m, 3), whose hull, less a rounding, holds the geom."""
    box, points = model.geom_boxes[geom], model.geom_points[geom]
    if len(points) == 0:
        return box[:3] + SIGNS * box[3:], ROUNDING
    spatial: Any = importlib.import_module("scipy.spatial")
    points = points[spatial.ConvexHull(points, qhull_options="QJ Pp").vertices]
    if len(points) <= MOST_WAYS:
        return points, ROUNDING
    ways = np.random.default_rng(0).normal(size=(MOST_WAYS, 3))
    kept, near, other = points[np.unique(np.argmax(points @ ways.T, axis=0))], *np.empty((2, 3))
    kernel = compiled("grasp_core.hands.distances_kernel")
    beyond = [kernel.hull_hull(kept, point[None], np.inf, near, other) for point in points]
    return kept, ROUNDING + max(beyond)
