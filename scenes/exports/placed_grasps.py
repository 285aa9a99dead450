"""Places what exports show of a grasp: contacts, fingertips with their rods, and figures.

Everything about one grasp is in the object's frame. In files that are looked at, the grasps stand
on a square grid, so that each can be seen: `offset` says where the frame of one grasp is.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.frames import poses_along
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from scenes.fingertips import fitting_radius

ROD_LENGTH = 0.5
"""Length of the rods where no free lines were planned, in object radii."""
SPACING = 2.5
"""Distance between neighbouring grasps of a grid, in object radii and rod lengths: two of each keep
them apart, and the rest is for the fingertips."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedGrasp:
    """One grasp as it is shown: poses are (4, 4) matrices that map to the object's frame."""

    grasp: Grasp
    offset: Array
    """Where the object's frame stands in a file with several grasps, (3,) [m]."""
    contacts: Array
    """Pose at each contact, (4, 4, 4) [m]: the origin is the contact, z the inward normal."""
    tip_radius: float
    """Radius of the fingertips, and of the rods behind them [m]."""
    rods: Array
    """Pose of each finger's rod, (4, 4, 4) [m]: the origin is the centre of the tip, and z is the
    direction in which the finger comes in; the rod lies behind the origin."""
    rod_length: float
    """Length of the rods, which is how far fingers draw back before a grasp [m]."""
    figures: Mapping[str, str | float]
    """What is known of the grasp, by the names that tables have: see `Plan.to_dataframe`."""


def placed_grasps(plan: Plan, fingertip_radius_m: float | None) -> tuple[PlacedGrasp, ...]:
    """Place every grasp of a plan, in order.

    Takes `fingertip_radius_m` [m].
    """
    radius, length = fingertip_radius_m, ROD_LENGTH * plan.body.radius
    if plan.finger is not None:
        radius, length = radius or plan.finger.radius_m, plan.finger.approach_m
    columns = math.ceil(math.sqrt(len(plan)))
    step = SPACING * (plan.body.radius + length)
    return tuple(
        PlacedGrasp(
            grasp=grasp,
            offset=step * np.array([place % columns, place // columns, 0.0]),
            contacts=grasp.contact_frames(),
            tip_radius=(tip := radius or fitting_radius(plan.body, grasp.positions, grasp.normals)),
            rods=_rods(grasp, tip),
            rod_length=length,
            figures=_figures(plan, grasp),
        )
        for place, grasp in enumerate(plan.grasps)
    )


def _rods(grasp: Grasp, radius: float) -> Array:
    ways = grasp.approach_directions
    return poses_along(
        grasp.positions - radius * grasp.normals, grasp.normals if ways is None else ways
    )


def _figures(plan: Plan, grasp: Grasp) -> Mapping[str, str | float]:
    lower, upper = grasp.ferrari_canny
    numbers = {
        "friction": plan.friction,
        "critical_friction": grasp.critical_friction,
        "closure_margin": grasp.closure_margin,
        "ferrari_canny_lower_n": lower,
        "ferrari_canny_upper_n": upper,
        "radius_m": grasp.radius,
    }
    # JSON has no infinity, which a critical friction is where none suffices
    finite = {name: value for name, value in numbers.items() if math.isfinite(value)}
    return {"id": grasp.id, "family": grasp.family, **finite}
