"""Places the shapes of a hand's file where the hand stands, for pictures of it."""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from scenes.hand_files.model import mesh_points
from scenes.mujoco.filed_hand import FiledHand
from scenes.silent_mujoco import mujoco, unlogged


@dataclass(frozen=True, slots=True, eq=False)
class PlacedShape:
    """A shape of a link where it stands."""

    link: str
    """Name of the link in scenes, as contacts have it."""
    kind: str
    """Kind of the shape, as MuJoCo calls it: `box`, `capsule`, `cylinder`, `ellipsoid`, `sphere` or
    `mesh`."""
    size: Array
    """MuJoCo's sizes of its kind, (3,) [m]."""
    position: Array
    """Place of the shape in the object's frame, (3,) [m]."""
    rotation: Array
    """Columns are the axes of the shape in the object's frame, (3, 3)."""
    corners: Array
    """Corners of a mesh in the frame of the shape, (n, 3) [m]; none of other kinds."""


def placed_shapes(hand: FiledHand, root: Array, joints: Array) -> tuple[PlacedShape, ...]:
    """Place the shapes of a hand that collide.

    Args:
        hand: The hand, as its file has it.
        root: Pose of its root, the world of the file, in the object's frame, (4, 4).
        joints: Angles in the order of `hand.joints`, (j,) [rad].
    """
    model, raw = hand.model, hand.model.raw
    data = mujoco.MjData(raw)
    data.qpos[raw.jnt_qposadr[list(hand.joints)]] = joints
    with unlogged():
        mujoco.mj_kinematics(raw, data)
    return tuple(
        PlacedShape(
            link=hand.link_name(int(raw.geom_bodyid[geom])),
            kind=model.geom_kinds[geom],
            size=np.array(raw.geom_size[geom]),
            position=root[:3, :3] @ data.geom_xpos[geom] + root[:3, 3],
            rotation=root[:3, :3] @ data.geom_xmat[geom].reshape(3, 3),
            corners=mesh_points(model, geom),
        )
        for geom in hand.shapes()
    )
