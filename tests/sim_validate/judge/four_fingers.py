"""A hand of four fingers around a cube, as files, and recorded grasps of it."""

import json

import numpy as np
import trimesh

HALF = 0.02
"""Half the side of the cube [m]."""
FINGER = """
<body euler="0 0 {turn}">
  <body name="finger{k}" pos="-0.026 0 0.06">
    <joint name="j{k}" axis="0 1 0" range="-30 30"/>
    <geom type="sphere" size="0.006" pos="0 0 -0.06" mass="0.01"/>
  </body>
</body>"""
HAND = "".join(FINGER.format(turn=90 * k, k=k) for k in range(4))
CLOSED = (0.0, 0.0, 0.0, 0.0)
"""Joint angles with the fingertips on the middles of the cube's four upright sides [rad]."""
TWO_OPEN = (0.0, 0.3, 0.0, 0.3)
"""Joint angles with two opposite fingers away from the cube [rad]."""


def write_hand(folder):
    """The hand's file."""
    path = folder / "four.xml"
    path.write_text(f"<mujoco><worldbody>{HAND}</worldbody></mujoco>")
    return path


def write_grasps(path, *joints, objects="cube", height_m=0.0):
    """A table of grasps, the hand as much higher than the middle of the cube."""
    root = np.eye(4)
    root[2, 3] = height_m
    path.write_text(json.dumps({
        "object": objects, "joint_names": ["j0", "j1", "j2", "j3"],
        "root_pose": [root.tolist()] * len(joints), "joints_rad": [list(each) for each in joints],
    }))  # fmt: skip
    return path


def judging(folder, *joints, **more):
    """Write hand, cube and grasps; return the command that judges them, without --out."""
    folder.mkdir(exist_ok=True)
    grasps = write_grasps(folder / "grasps.json", *joints, **more)
    trimesh.creation.box(extents=3 * [2.0 * HALF]).export(folder / "cube.obj")
    return ["judge", str(grasps), "--hand", str(write_hand(folder)), "--objects", str(folder)]
