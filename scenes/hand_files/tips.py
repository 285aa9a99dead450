"""Says which ball a named site, geom or body of a model gives a fingertip.

A site or sphere is the ball itself. A capsule gives the ball at the end that is farther from the
last joint. Any other geom is taken as its box: the capsule in it, along the axis that points most
away from the last joint, whose ball touches the box's end.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.hands.hand import LinkShape
from scenes.hand_files.chains import Tip
from scenes.hand_files.model import HandModel

ACROSS = {0: (1, 2), 1: (0, 2), 2: (0, 1)}


@dataclass(frozen=True, slots=True)
class TipBall:
    """A fingertip's ball in the frame of its body, and the shape that stands for the geom."""

    center: Array
    radius: float
    stand_in: LinkShape | None
    """Capsule in place of a geom that is neither sphere nor capsule; None to keep the geom."""


def tip_ball(model: HandModel, tip: Tip, joint: Array, name: str) -> TipBall:
    """Find the ball of a fingertip.

    Args:
        model: The compiled model.
        tip: What the fingertip's name stands for.
        joint: Origin of the last joint in the frame of the tip's body, (3,) [m].
        name: What to call the file in a message.

    Raises:
        InputError: A site has no size.
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
    sizes = np.zeros(3)
    sizes[axis] = half[axis] - radius
    if sizes[axis] == 0.0:
        return TipBall(center, radius, LinkShape(middle, R, np.zeros(3), radius))
    return TipBall(center, radius, LinkShape(middle, R, sizes, radius))
