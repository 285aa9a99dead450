"""Hands from files: the same as MuJoCo has them, and refusals of what is not a hand."""

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.hands.kinematics import places, tip_jacobians
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled
from tests.hand_models import hand_mjcf

TABLES = ["allegro", "leap"]
FINGER = """
<body name="f{n}" pos="{x} {y} 0.01">
  <joint name="f{n}a" axis="0 0 1" range="-40 40"/>
  <joint name="f{n}b" axis="{ax} {ay} 0" range="-90 60" ref="10" pos="0 0 0.005"/>
  <geom name="g{n}" type="capsule" fromto="0 0 0 0 0 0.04" size="0.006"/>
  <body name="d{n}" pos="0 0 0.045">
    <joint name="f{n}c" axis="{ax} {ay} 0" range="-90 60" actuatorfrcrange="-0.4 0.4"/>
    <geom name="p{n}" type="{kind}" {size}/>
    <site name="s{n}" pos="0 0 0.04" size="0.007"/>
  </body>
</body>"""
CAPSULE = ("capsule", 'fromto="0 0 0 0 0 0.04" size="0.007"')
BOX = ("box", 'pos="0 0 0.02" size="0.008 0.009 0.02"')


def gripper(kind=CAPSULE, extra="", fingers=4):
    """A gripper with fingers around a palm, in degrees, drawn with one joint at 10 degrees."""
    turns = [0.5 * np.pi * n for n in range(fingers)]
    bodies = "".join(
        FINGER.format(n=n, x=0.04 * np.cos(a), y=0.04 * np.sin(a), ax=-np.sin(a), ay=np.cos(a),
                      kind=kind[0], size=kind[1])
        for n, a in enumerate(turns)
    )  # fmt: skip
    return (
        '<mujoco model="gripper"><worldbody><geom type="plane" size="1 1 1"/>'
        f'<body name="base" pos="0 0 0.3"><geom name="base" type="cylinder" size="0.05 0.005"/>'
        f"{bodies}</body></worldbody>{extra}</mujoco>"
    )


URDF_FINGER = """
<link name="f{n}"><collision><origin xyz="0 0 0.02"/><geometry>
<box size="0.01 0.01 0.03"/></geometry></collision><inertial><mass value="0.05"/>
<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0"
iyz="0"/></inertial></link>
<joint name="j{n}" type="revolute"><origin xyz="{x} {y} 0" rpy="0 0 {a}"/><axis xyz="0 1 0"/>
<parent link="base"/><child link="f{n}"/>
<limit lower="-1" upper="1" effort="0.5" velocity="1"/></joint>
<link name="d{n}"><collision><origin xyz="0 0 0.03"/><geometry><sphere radius="0.008"/></geometry>
</collision><inertial><mass value="0.02"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0"
iyz="0"/></inertial></link>
<joint name="k{n}" type="revolute"><origin xyz="0 0 0.05"/><axis xyz="0 1 0"/><parent link="f{n}"/>
<child link="d{n}"/><limit lower="-1" upper="1.5" effort="0.3" velocity="1"/></joint>"""


def urdf_gripper():
    fingers = "".join(
        URDF_FINGER.format(n=n, x=0.03 * np.cos(a), y=0.03 * np.sin(a), a=a)
        for n, a in enumerate(0.5 * np.pi * np.arange(4))
    )
    return (
        '<robot name="gripper"><link name="base"><collision><geometry><cylinder radius="0.05" '
        'length="0.01"/></geometry></collision><inertial><mass value="0.2"/><inertia ixx="1e-4" '
        'iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>' + fingers + "</robot>"
    )


def written(tmp_path, text, name="gripper.xml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def simulated_tips(path, hand, angles, read):
    """Where MuJoCo has the tips, in the palm's frame, for angles given by the joints' names."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for joint, angle in zip(hand.joints, angles, strict=True):
        data.joint(joint.name).qpos = angle
    mujoco.mj_forward(model, data)
    return read(data)


@pytest.mark.parametrize("name", TABLES)
def test_the_hands_of_tables_are_where_mujoco_has_them(name):
    hand, rng = gc.load_hand(name), np.random.default_rng(8)
    model = mujoco.MjModel.from_xml_string(hand_mjcf(hand))
    data = mujoco.MjData(model)
    for _ in range(5):
        angles = rng.uniform(*hand.ranges.T)
        for joint, angle in zip(hand.joints, angles, strict=True):
            data.joint(joint.name).qpos = angle
        mujoco.mj_forward(model, data)
        found = places(hand, angles)
        for k, link in enumerate(hand.links):
            assert data.body(link.name).xpos == pytest.approx(found.link_positions[0, k], abs=1e-9)
        for f, finger in enumerate(hand.fingers):
            geom, tip = data.geom(f"{finger.name}_tip"), found.tips[0, f]
            last = hand.links.index(finger.links[-1])
            if finger.tip.corners is None:
                assert tip == pytest.approx(geom.xpos, abs=1e-9)
            else:
                corners = model.mesh_vert[model.mesh(f"{finger.name}_tip").vertadr[0] :]
                placed = corners[: len(finger.tip.corners)] @ geom.xmat.reshape(3, 3).T + geom.xpos
                own = found.link_positions[0, last] + (
                    finger.tip.corners @ found.link_rotations[0, last].T
                )
                assert placed == pytest.approx(own, abs=1e-8)
            jacobian = np.zeros((3, model.nv))
            body = model.body(finger.links[-1].name).id
            mujoco.mj_jac(model, data, jacobian, None, tip, body)
            assert tip_jacobians(hand, angles)[0, f] == pytest.approx(jacobian, abs=1e-9)


@pytest.mark.parametrize("name", TABLES)
def test_a_table_written_as_mjcf_is_read_back_as_it_was(name, tmp_path):
    hand = gc.load_hand(name)
    path = written(tmp_path, hand_mjcf(hand), f"{name}.xml")
    read = scenes.load_hand(path, [f"{finger.name}_tip" for finger in hand.fingers])
    assert [j.name for j in read.joints] == [j.name for j in hand.joints]
    assert read.ranges == pytest.approx(hand.ranges)
    angles = np.random.default_rng(9).uniform(*hand.ranges.T)
    ours, theirs = places(hand, angles), places(read, angles)
    ends = np.cumsum([len(finger.links) for finger in hand.fingers]) - 1
    ways = np.random.default_rng(10).normal(size=(50, 3))
    for end, own, other in zip(ends, hand.fingers, read.fingers, strict=True):
        heights = [
            ((p.link_positions[0, end] + tip.core[0] @ p.link_rotations[0, end].T) @ ways.T).max(0)
            for p, tip in ((ours, own.tip), (theirs, other.tip))
        ]
        assert heights[1] == pytest.approx(heights[0], abs=5e-8)
        assert other.tip.core[1] == own.tip.core[1]
    assert [j.torque_limit_n_m for j in read.joints] == [j.torque_limit_n_m for j in hand.joints]
    assert {frozenset(p) for p in hand.ignored_pairs} <= {frozenset(p) for p in read.ignored_pairs}


@pytest.mark.parametrize("tips", ["s{}", "p{}", "d{}"])
def test_fingertips_are_named_by_site_geom_or_body(tips, tmp_path):
    path = written(tmp_path, gripper())
    hand = scenes.load_hand(path, [tips.format(n) for n in range(4)])
    assert len(hand.joints) == 12
    assert [f.tip.radius for f in hand.fingers] == pytest.approx([0.007] * 4)
    assert hand.joints[1].lowest == pytest.approx(-0.5 * np.pi)
    assert [j.torque_limit_n_m for j in hand.joints[:3]] == [None, None, 0.4]
    angles = np.random.default_rng(10).uniform(*hand.ranges.T)
    true = simulated_tips(path, hand, angles, lambda data: [
        data.body("base").xmat.reshape(3, 3).T @ (data.site(f"s{n}").xpos - data.body("base").xpos)
        for n in range(4)
    ])  # fmt: skip
    assert places(hand, angles).tips[0] == pytest.approx(np.array(true), abs=1e-9)


def test_a_box_as_a_fingertip_is_a_block_with_a_ball_in_it(tmp_path):
    hand = scenes.load_hand(written(tmp_path, gripper(BOX)), [f"p{n}" for n in range(4)])
    tip = hand.fingers[0].tip
    assert tip.radius == pytest.approx(0.008)
    assert tip.center == pytest.approx([0.0, 0.0, 0.032], abs=1e-12)
    assert np.abs(tip.corners - [0.0, 0.0, 0.02]) == pytest.approx(
        np.tile([0.008, 0.009, 0.02], (8, 1)), abs=1e-12
    )
    assert tip.rounding == 1e-4
    (shape,) = hand.fingers[0].links[-1].shapes
    assert shape.half_sizes == pytest.approx(np.array([0.008, 0.009, 0.02]) + 1e-4, abs=1e-8)


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
    hand, body, seen = scenes.load_hand(path, [f"p{n}" for n in range(4)]), scaled("box", 0.02), 0
    spec = mujoco.MjSpec.from_file(str(path))
    mesh = spec.add_mesh(name="object")
    mesh.uservert = (body.vertices - body.center_of_mass).ravel()
    held = spec.worldbody.add_body(name="object", mocap=True)
    held.add_geom(name="object", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object")
    model = spec.compile()
    data = mujoco.MjData(model)
    object_geom = model.geom("object").id
    for grasp in grasps("box", 0.02, 12):
        found = gc.reach_with(hand, body, grasp, FRICTION)
        if not found.reached:
            continue
        seen += 1
        for joint, angle in zip(hand.joints, found.joints, strict=True):
            data.joint(joint.name).qpos = angle
        pose = found.palm_pose
        mujoco.mju_mat2Quat(data.mocap_quat[0], np.ascontiguousarray(pose[:3, :3].T).ravel())
        center = pose[:3, :3].T @ (body.center_of_mass - pose[:3, 3])
        data.mocap_pos[0] = center + np.array([0.0, 0.0, 0.3])
        mujoco.mj_forward(model, data)
        gaps = [mujoco.mj_geomDistance(model, data, model.geom(f"p{n}").id, object_geom, 1.0, None)
                for n in range(4)]  # fmt: skip
        assert min(gaps) > -1e-4
        assert kind == "cylinder" or max(gaps) < 3e-4
    assert seen >= 2


def test_a_urdf_gripper_is_read_with_efforts_and_masses(tmp_path):
    path = written(tmp_path, urdf_gripper(), "gripper.urdf")
    hand = scenes.load_hand(path, [f"d{n}" for n in range(4)])
    assert len(hand.joints) == 8
    assert [j.torque_limit_n_m for j in hand.joints[:2]] == [0.5, 0.3]
    assert [link.mass_kg for link in hand.links[:2]] == pytest.approx([0.05, 0.02])
    angles = np.random.default_rng(11).uniform(*hand.ranges.T)
    true = simulated_tips(path, hand, angles, lambda data: [
        data.body(f"d{n}").xpos + data.body(f"d{n}").xmat.reshape(3, 3) @ [0.0, 0.0, 0.03]
        for n in range(4)
    ])  # fmt: skip
    assert places(hand, angles).tips[0] == pytest.approx(np.array(true), abs=1e-9)


def test_built_in_names_give_the_tables():
    assert scenes.load_hand("allegro") == gc.load_hand("allegro")
    with pytest.raises(InputError, match="has its own fingertips"):
        scenes.load_hand("leap", ["tip"])


BAD = {
    "no tips": (gripper(), (), "name 3 to 5 fingertips"),
    "unknown tip": (gripper(), ("s0", "s1", "s2", "nose"), "no site, geom or body 'nose'"),
    "same finger twice": (gripper(), ("s0", "s0", "s2", "s3"), "no joint moves|share"),
    "palm as a tip": (gripper(), ("s0", "s1", "s2", "base"), "no joint moves"),
    "no xml": ("hello", ("a", "b", "c"), "no XML"),
    "another xml": ("<html/>", ("a", "b", "c"), "expected <mujoco> or <robot>"),
    "entities": ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', ("a", "b", "c"), "entities"),
    "include": (gripper(extra='<include file="x.xml"/>'), ("s0", "s1", "s2"), "<include>"),
    "replicate": (gripper(extra="<worldbody><replicate count='9'/></worldbody>"),
                  ("s0", "s1", "s2"), "<replicate>"),
    "plugin": (gripper(extra="<extension><plugin plugin='a'/></extension>"), ("s0", "s1", "s2"),
               "<extension>|<plugin>"),
    "mesh outside": (gripper(extra='<asset><mesh file="../secret.stl"/></asset>'),
                     ("s0", "s1", "s2"), "not in the folder"),
    "absolute mesh": (gripper(extra='<asset><mesh file="/etc/passwd"/></asset>'),
                      ("s0", "s1", "s2"), "not in the folder"),
    "huge texture": (
        gripper(extra='<asset><texture builtin="flat" width="90000" height="9"/></asset>'),
        ("s0", "s1", "s2"), "width of <texture>",
    ),
    "slide": (gripper().replace('axis="0 0 1"', 'type="slide" axis="0 0 1"'),
              ("s0", "s1", "s2", "s3"), "must be a hinge"),
    "refused by MuJoCo": (gripper(extra="<nonsense/>"), ("s0", "s1", "s2"), "cannot compile"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_hand_is_refused_with_what_to_do(case, tmp_path):
    text, tips, said = BAD[case]
    (tmp_path / "secret.stl").write_bytes(b"x")
    folder = tmp_path / "hands"
    folder.mkdir()
    with pytest.raises(InputError, match=said):
        scenes.load_hand(written(folder, text), tips)


def test_a_link_out_of_the_folder_is_refused(tmp_path):
    folder = tmp_path / "hands"
    folder.mkdir()
    (tmp_path / "secret.stl").write_bytes(b"x")
    (folder / "link.stl").symlink_to(tmp_path / "secret.stl")
    text = gripper(extra='<asset><mesh file="link.stl"/></asset>')
    with pytest.raises(InputError, match="not in the folder"):
        scenes.load_hand(written(folder, text), ("s0", "s1", "s2"))


def test_a_file_that_is_too_large_is_refused(tmp_path):
    path = written(tmp_path, gripper() + " " * (4 * 2**20))
    with pytest.raises(InputError, match="4 MiB"):
        scenes.load_hand(path, ("s0", "s1", "s2"))


def test_meshes_in_the_folder_are_read_and_taken_as_boxes(tmp_path):
    (tmp_path / "meshes").mkdir()
    corners = [(x, y, z) for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]
    lines = [f"v {0.01 * x} {0.01 * y} {0.01 * z}" for x, y, z in corners]
    faces = ["1 2 4", "1 4 3", "5 7 8", "5 8 6", "1 5 6", "1 6 2", "3 4 8", "3 8 7", "1 3 7",
             "1 7 5", "2 6 8", "2 8 4"]  # fmt: skip
    (tmp_path / "meshes" / "palm.obj").write_text("\n".join([*lines, *(f"f {f}" for f in faces)]))
    extra = '<compiler meshdir="meshes"/><asset><mesh file="palm.obj"/></asset>'
    text = gripper(extra=extra).replace(
        'type="cylinder" size="0.05 0.005"', 'type="mesh" mesh="palm"'
    )
    hand = scenes.load_hand(written(tmp_path, text), ("s0", "s1", "s2", "s3"))
    (shape,) = hand.palm
    assert sorted(shape.half_sizes) == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)


def test_a_file_of_another_kind_is_refused():
    with pytest.raises(InputError, match=r"a file that ends with \.xml"):
        scenes.load_hand("hand.step", ["a", "b", "c", "d"])
