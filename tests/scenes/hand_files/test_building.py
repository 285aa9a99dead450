"""Hands from files: the same as MuJoCo has them, and refusals of what is not a hand."""

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled
from tests.scenes.hand_files.grippers import Beside, gripper, written
from tests.scenes.meshes import box_obj

BOX = ("box", 'pos="0 0 0.02" size="0.008 0.009 0.02"')


@pytest.mark.parametrize("tips", ["s{}", "p{}", "d{}"])
def test_fingertips_are_named_by_site_geom_or_body(tips, tmp_path):
    path = written(tmp_path, gripper())
    hand = scenes.hand_from_file(path, [tips.format(n) for n in range(4)])
    assert len(hand.joints) == 12
    assert [f.tip.radius for f in hand.fingers] == pytest.approx([0.007] * 4)
    assert hand.joints[1].lowest == pytest.approx(-0.5 * np.pi)
    assert [j.torque_limit_n_m for j in hand.joints[:3]] == [None, None, 0.4]
    assert hand.palm_link == "base"
    angles = np.random.default_rng(10).uniform(*hand.ranges.T)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for joint, angle in zip(hand.joints, angles, strict=True):
        data.joint(joint.name).qpos = angle
    mujoco.mj_forward(model, data)
    base = data.body("base")
    true = [base.xmat.reshape(3, 3).T @ (data.site(f"s{n}").xpos - base.xpos) for n in range(4)]
    assert places(hand, angles).tips[0] == pytest.approx(np.array(true), abs=1e-9)


BLOCKS = {
    "box": BOX,
    "mesh": ("mesh", 'mesh="tip"'),  # a wedge: its ball is well inside of it
    "cylinder": ("cylinder", 'pos="0 0 0.02" size="0.008 0.02"'),
}
WEDGE = ('<asset><mesh name="tip" vertex="-.008 -.009 0  .008 -.009 0  -.008 .009 0  .008 .009 0 '
         '-.008 -.009 .04  -.008 .009 .04"/></asset>')  # fmt: skip


@pytest.mark.parametrize("kind", BLOCKS)
def test_a_fingertip_that_is_no_ball_is_free_where_it_is_said_to_be(kind, tmp_path):
    """MuJoCo has the file's own geoms: none is in the object by more than 0.1 mm, and boxes and
    meshes touch it."""
    path = written(tmp_path, gripper(BLOCKS[kind], extra=WEDGE))
    hand = scenes.hand_from_file(path, [f"p{n}" for n in range(4)])
    body, seen = scaled("box", 0.02), 0
    simulated = Beside(path, body)
    for grasp in grasps("box", 0.02, 12):
        found = gc.reach_with(hand, body, grasp, FRICTION)
        if not found.reached:
            continue
        seen += 1
        simulated.stand(hand, found)
        gaps = [simulated.apart(f"p{n}") for n in range(4)]
        assert min(gaps) > -1e-4
        assert kind == "cylinder" or max(gaps) < 3e-4
    assert seen >= 2


BAD = {
    "no tips": (gripper(), (), "name 3 to 5 fingertips"),
    "unknown tip": (gripper(), ("s0", "s1", "s2", "nose"), "no site, geom or body 'nose'"),
    "same finger twice": (gripper(), ("s0", "s0", "s2", "s3"), "no joint moves|share"),
    "palm as a tip": (gripper(), ("s0", "s1", "s2", "base"), "no joint moves"),
    "no xml": ("hello", ("a", "b", "c"), "no XML"),
    "entities": ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', ("a", "b", "c"), "entities"),
    "include": (gripper(extra='<include file="x.xml"/>'), ("s0", "s1", "s2"), "<include>"),
    "replicate": (gripper(extra="<worldbody><replicate count='9'/></worldbody>"),
                  ("s0", "s1", "s2"), "<replicate>"),
    "plugin": (gripper(extra="<extension><plugin plugin='a'/></extension>"), ("s0", "s1", "s2"),
               "<extension>|<plugin>"),
    "mesh outside": (
        gripper(("mesh", 'mesh="secret"'), '<asset><mesh file="../secret.stl"/></asset>'),
        ("s0", "s1", "s2"), "not in the folder",
    ),
    "huge field": (
        gripper(extra='<asset><hfield nrow="90000" ncol="9" size="1 1 1 1"/></asset>'),
        ("s0", "s1", "s2"), "nrow of <hfield>",
    ),
    "slide": (gripper().replace('axis="0 0 1"', 'type="slide" axis="0 0 1"'),
              ("s0", "s1", "s2", "s3"), "must be a hinge"),
    "too large": (gripper() + " " * (4 * 2**20), ("s0", "s1", "s2"), "4 MiB"),
    "refused by MuJoCo": (gripper(extra="<nonsense/>"), ("s0", "s1", "s2"), "cannot compile"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_hand_is_refused_with_what_to_do(case, tmp_path):
    text, tips, said = BAD[case]
    (tmp_path / "secret.stl").write_bytes(b"x")
    with pytest.raises(InputError, match=said):
        scenes.hand_from_file(written(tmp_path / "hands", text), tips)


def test_meshes_in_the_folder_of_the_compiler_are_read_and_taken_as_boxes(tmp_path):
    written(tmp_path / "meshes", box_obj(0.01, 0.02, 0.03), "palm.obj")
    extra = '<compiler meshdir="meshes"/><asset><mesh file="palm.obj"/></asset>'
    cylinder = 'type="cylinder" size="0.05 0.005"'
    text = gripper(extra=extra).replace(cylinder, 'type="mesh" mesh="palm"')
    hand = scenes.hand_from_file(written(tmp_path, text), ("s0", "s1", "s2", "s3"))
    assert sorted(hand.palm[0].half_sizes) == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)
