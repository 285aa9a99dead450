"""Shapes of a hand's file stand where its joints and its root put them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.hand_files.model import compiled_hand
from scenes.hand_files.model_text import ModelText
from scenes.mujoco.filed_hand import FiledHand
from scenes.mujoco.placed_shapes import placed_shapes

HAND = """
<mujoco><compiler angle="radian"/>
<asset><mesh name="wedge" vertex="0 0 0  .06 0 0  0 .03 0  0 0 .03"/></asset>
<worldbody><body name="palm" pos="0 0 .1">
  <joint name="WRJTx" type="slide" axis="1 0 0"/>
  <geom type="box" size=".03 .04 .01"/>
  <geom type="sphere" size=".01" contype="0" conaffinity="0"/>
  <body name="finger" pos=".05 0 0">
    <joint name="bend" axis="0 1 0"/>
    <geom type="capsule" size=".008 .02" pos="0 0 .02"/>
    <body name="tip" pos="0 0 .04"><joint name="out" type="slide" axis="0 0 1"/>
      <geom type="mesh" mesh="wedge"/></body>
  </body>
</body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def hand():
    return FiledHand.of(compiled_hand(ModelText(HAND, {}, {})), (1.0, 0.0, 0.0), 5.0)


def test_shapes_are_where_joints_and_root_put_them(hand):
    assert hand.joint_names == ("bend", "out")
    root, angle, out = np.eye(4), 0.7, 0.015
    root[:3, :3] = Rotation.from_euler("xyz", [0.4, -1.0, 2.0]).as_matrix()
    root[:3, 3] = 0.2, -0.1, 0.3
    palm, finger, tip = placed_shapes(hand, root, np.array([angle, out]))
    assert [each.kind for each in (palm, finger, tip)] == ["box", "capsule", "mesh"]
    assert [each.link for each in (palm, finger, tip)] == ["hand/palm", "hand/finger", "hand/tip"]
    bent = np.array([np.sin(angle), 0.0, np.cos(angle)])  # the finger's way, from z towards x
    knuckle = np.array([0.05, 0.0, 0.1])

    def at(point):
        return root[:3, :3] @ point + root[:3, 3]

    np.testing.assert_allclose(palm.position, at([0.0, 0.0, 0.1]), atol=1e-12)
    np.testing.assert_allclose(palm.rotation, root[:3, :3], atol=1e-12)
    np.testing.assert_allclose(finger.position, at(knuckle + 0.02 * bent), atol=1e-12)
    np.testing.assert_allclose(finger.rotation[:, 2], root[:3, :3] @ bent, atol=1e-12)
    across = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    start = knuckle + (0.04 + out) * bent
    axes = np.array([across, [0.0, 1.0, 0.0], bent])
    wanted = [start, *(start + np.array([[0.06], [0.03], [0.03]]) * axes)]
    corners = tip.position + tip.corners @ tip.rotation.T
    for point in wanted:  # MuJoCo moves a mesh into its own axes, and keeps single precision
        assert np.linalg.norm(corners - at(point), axis=1).min() < 1e-6
    assert len(corners) == 4
