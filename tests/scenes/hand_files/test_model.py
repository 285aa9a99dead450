"""Links without a mass, or with moments that no body has, are read."""

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from scenes.hand_files.model import compiled_hand
from scenes.hand_files.model_text import model_text
from sim_validate.closure.validate import Agenda
from sim_validate.hands.validate import validate_hand
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled
from tests.scenes.hand_files.grippers import CAPSULE, gripper, loaded, written
from tests.scenes.hand_files.test_published_kinds import BALL_KG, TIPS, robot
from tests.scenes.meshes import box_obj

SITES = ("s0", "s1", "s2", "s3")
MOMENTS = {
    "none": (0, 0, 0, 0, 0, 0),
    "one axis none": (1e-6, 0, 1e-6, 0, 0, 0),
    "two axes none": (0, 0, 1e-6, 0, 0, 0),
    "one axis negative": (1e-6, -1e-6, 1e-6, 0, 0, 0),
    "products too large": (1e-6, 1e-6, 1e-6, 1e-3, 0, 0),
}
AXES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def weighed(mass, moments):
    """The robot with other masses and moments of all links but the fingertips."""
    own = "".join(f' {axis}="{moment}"' for axis, moment in zip(AXES, moments, strict=False))
    odd = robot(odd=True).split("<inertial>")
    return odd[0] + "".join(
        f'<inertial><mass value="{mass}"/>{f"<inertia{own}/>" if moments else ""}</inertial>'
        + part.split("</inertial>", 1)[1]
        for part in odd[1:]
    )


@pytest.mark.parametrize("case", MOMENTS)
def test_of_moments_that_no_body_has_only_masses_count(case, tmp_path):
    hand = loaded(tmp_path, weighed(0.02, MOMENTS[case]), TIPS)
    (note,) = (note for note in hand.notes if "count by their masses alone" in note)
    assert {"a0", "a1", "b0", "b1"} <= set(note.split(": ")[1].replace(" and", ",").split(", "))
    assert [each.mass_kg for each in hand.links] == pytest.approx([0.02, 0.02 + BALL_KG] * 3)


@pytest.mark.parametrize("moments", [(1e-6, 1e-6, 1e-6, 0, 0, 0), (0,) * 6])
def test_links_without_a_mass_weigh_nothing(moments, tmp_path):
    hand = loaded(tmp_path, weighed(0, moments), TIPS)
    assert "links without a mass weigh nothing: a0, a1, a2" in hand.notes
    assert not any("masses alone" in note for note in hand.notes)
    assert [each.mass_kg for each in hand.links] == pytest.approx([0.0, BALL_KG] * 3)


def test_a_missing_moment_is_none(tmp_path):
    hand = loaded(tmp_path, weighed(0.02, ()), TIPS)
    assert [each.mass_kg for each in hand.links] == pytest.approx([0.02, 0.02 + BALL_KG] * 3)


@pytest.mark.parametrize(
    ("change", "kept"),
    [
        ('<inertial mass="0" pos="0 0 0" diaginertia="0 0 0"/>', 0.0),
        ('<inertial mass="0.1" pos="0 0 0" diaginertia="0 1e-5 1e-5"/>', 0.1),
        ('<inertial mass="0.1" pos="0 0 0" fullinertia="0 1e-5 1e-5 0 0 0"/>', 0.1),
    ],
)
def test_bodies_of_mjcf_may_be_frames_as_well(change, kept, tmp_path):
    text = gripper().replace('<joint name="c', change + '<joint name="c')
    hand = scenes.hand_from_file(written(tmp_path, text), SITES)
    assert [finger.links[-1].mass_kg for finger in hand.fingers] == [kept] * 4


def test_shapes_without_a_mass_are_ends_of_chains(tmp_path):
    light = CAPSULE[1] + ' mass="0"'
    hand = scenes.hand_from_file(written(tmp_path, gripper((CAPSULE[0], light))), SITES)
    assert [finger.links[-1].mass_kg for finger in hand.fingers] == [0.0] * 4


def test_a_negative_mass_is_refused(tmp_path):
    with pytest.raises(InputError, match="the mass of palm must not be negative, got -1"):
        loaded(tmp_path, weighed(-1, (1e-6, 1e-6, 1e-6, 0, 0, 0)), TIPS)


def test_a_hand_without_masses_is_simulated(tmp_path):
    text = gripper((CAPSULE[0], CAPSULE[1] + ' mass="0"'))
    hand = scenes.hand_from_file(written(tmp_path, text), SITES).with_torque_limits(0.4, "a test")
    tried = (
        (body, gc.reach_with(hand, body, grasp, FRICTION))
        for name in ("octahedron", "dodecahedron", "wedge")
        for body in [scaled(name, 0.03)]
        for grasp in grasps(name, 0.03)
    )
    body, reach = next((body, found) for body, found in tried if found.reached)
    assert np.all([finger.links[-1].mass_kg == 0.0 for finger in hand.fingers])
    found = validate_hand(hand, body, reach, FRICTION, agenda=Agenda(random_wrenches=0))
    assert found.held


SHELL = '<geom type="mesh" mesh="shell" contype="0" conaffinity="0" {}/>'
CLASS = (
    '<default><default class="shown"><geom contype="0" conaffinity="0" mass="0"/></default>'
    "</default>"
)
ASSET = '<asset><mesh name="shell" file="{}"/></asset>'
LEFT_OUT = "meshes that only show and cannot be read are left out: shell"
WEIGHED = '<inertial pos="0 0 0" mass="0.3" diaginertia="1e-4 1e-4 1e-4"/>'
SHOWN = {
    "without density": SHELL.format('density="0"'),
    "without mass": SHELL.format('mass="0"'),
    "by its class": '<geom class="shown" type="mesh" mesh="shell"/>',
    "beside a stated mass": WEIGHED + SHELL.format(""),
    "of nothing": "",
}


def shelled(folder, on_palm, file="gone.obj"):
    """The gripper with more on its palm, compiled."""
    text = gripper(extra=ASSET.format(file) + CLASS, on_palm=on_palm)
    return compiled_hand(model_text(written(folder, text)))


@pytest.mark.parametrize("case", SHOWN)
@pytest.mark.parametrize("file", ["gone.obj", "shell.stl"])
def test_a_mesh_that_only_shows_may_be_missing_or_broken(file, case, tmp_path):
    written(tmp_path, "no mesh", "shell.stl")
    written(tmp_path, box_obj(0.01, 0.01, 0.01), "whole.obj")
    model = shelled(tmp_path, SHOWN[case], file)
    whole = shelled(tmp_path, SHOWN[case], "whole.obj")
    assert model.notes == (LEFT_OUT,)
    assert whole.notes == ()
    assert model.raw.body_mass == pytest.approx(whole.raw.body_mass, rel=1e-12)
    assert [name for name in model.geom_names if name] == [n for n in whole.geom_names if n]
    assert model.positions == pytest.approx(whole.positions)


def test_of_meshes_that_show_those_stay_that_can_be_read(tmp_path):
    written(tmp_path, "no mesh", "shell.stl")
    written(tmp_path, box_obj(0.01, 0.01, 0.01), "whole.obj")
    more = '<mesh name="whole" file="whole.obj"/><mesh name="gone" file="gone.stl"/></asset>'
    geoms = "".join(
        SHELL.format('mass="0"').replace("shell", n) for n in ("shell", "whole", "gone")
    )
    text = gripper(extra=ASSET.format("shell.stl").replace("</asset>", more), on_palm=geoms)
    model = compiled_hand(model_text(written(tmp_path, text)))
    assert model.notes == (LEFT_OUT.replace("shell", "gone"), LEFT_OUT)
    assert [model.raw.mesh(i).name for i in range(model.raw.nmesh)] == ["whole"]
    assert model.geom_kinds.count("mesh") == 1


def test_a_body_that_had_such_a_mesh_alone_is_said_to_touch_nothing(tmp_path):
    model = shelled(tmp_path, f'<body name="cap">{WEIGHED}{SHELL.format("")}</body>')
    assert model.notes == (LEFT_OUT, "bodies that have only such meshes touch nothing: cap")
    assert "cap" in model.body_names


NEEDED = {
    "collides": '<geom type="mesh" mesh="shell" conaffinity="0" mass="0"/>',
    "gives a body its mass": SHELL.format(""),
    "both": '<geom type="mesh" mesh="shell"/>',
    "shapes one that collides": '<geom type="capsule" mesh="shell" mass="0"/>',
}


@pytest.mark.parametrize("case", NEEDED)
def test_a_mesh_that_a_hand_needs_must_be_there(case, tmp_path):
    with pytest.raises(InputError, match=r"names the file 'gone\.obj', which is not in the folder"):
        shelled(tmp_path, NEEDED[case])
    written(tmp_path, "no mesh", "shell.stl")
    with pytest.raises(InputError, match="MuJoCo cannot compile the file"):
        shelled(tmp_path, NEEDED[case], "shell.stl")


def test_where_no_shape_collides_all_are_needed(tmp_path):
    shown = '<default><geom contype="0" conaffinity="0"/></default>'
    text = gripper(extra=ASSET.format("gone.obj") + shown, on_palm=SHELL.format('mass="0"'))
    with pytest.raises(InputError, match="not in the folder"):
        compiled_hand(model_text(written(tmp_path, text)))


BASE = '<body name="base" pos="0 0 0.3">'
SLIDES = "".join(
    f'<joint name="WRJ{kind}{axis}" type="{kind_of}" axis="{way}" ref="{ref}"/>'
    for kind, kind_of, ref in (("T", "slide", 0.1), ("R", "hinge", 20))
    for axis, way in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
)
ROOTS = {
    "free": ("<freejoint/>", ["free"]),
    "six joints": (SLIDES, ["slide"] * 3 + ["hinge"] * 3),
    "ball": ('<joint type="ball"/>', ["ball"]),
}


@pytest.mark.parametrize("fingers", [1, 2, 3, 6])
@pytest.mark.parametrize("case", ROOTS)
def test_a_root_that_moves_is_where_the_file_draws_it(case, fingers, tmp_path):
    """Hands of any number of fingers compile without fingertips."""
    joints, kinds = ROOTS[case]
    plain = compiled_hand(model_text(written(tmp_path, gripper(fingers=fingers))))
    text = gripper(fingers=fingers).replace(BASE, BASE + joints)
    model = compiled_hand(model_text(written(tmp_path, text)))
    assert list(model.joint_kinds) == kinds + ["hinge"] * 3 * fingers
    assert model.joint_names[len(kinds) :] == plain.joint_names
    assert model.positions == pytest.approx(plain.positions, abs=1e-12)
    assert model.rotations == pytest.approx(plain.rotations, abs=1e-12)
    root = [np.deg2rad(20.0) if kind == "hinge" else np.nan for kind in kinds]
    assert model.references == pytest.approx([*root, *plain.references], nan_ok=True)
    assert np.isnan(model.joint_ranges[: len(kinds)]).all()


FOREARM = '<body name="forearm"><geom size="0.05"/>{}<body name="base" pos="0 0 0.3">'
WRIST = '<joint name="WRJ1" axis="0 1 0" range="-30 10" actuatorfrcrange="-5 5"/>'
ABOVE = {
    "free": BASE + "<freejoint/>",
    "six joints": BASE + SLIDES,
    "wrist": FOREARM.format("") + WRIST,
    "wrist of a forearm that moves": FOREARM.format("<freejoint/>") + WRIST,
}


@pytest.mark.parametrize("case", ABOVE)
def test_joints_before_the_palm_are_none_of_a_finger(case, tmp_path):
    plain = scenes.hand_from_file(written(tmp_path, gripper()), SITES)
    text = gripper().replace(BASE, ABOVE[case])
    text = text.replace("</worldbody>", "</body></worldbody>") if "forearm" in text else text
    hand = scenes.hand_from_file(written(tmp_path, text), SITES)
    for finger, wanted in zip(hand.fingers, plain.fingers, strict=True):
        assert [link.name for link in finger.links] == [link.name for link in wanted.links]
        for link, other in zip(finger.links, wanted.links, strict=True):
            assert link.joint.position == pytest.approx(other.joint.position, abs=1e-12)
            assert link.joint.rotation == pytest.approx(other.joint.rotation, abs=1e-12)
            assert link.mass_kg == pytest.approx(other.mass_kg)
    assert hand.ranges == pytest.approx(plain.ranges)
    assert hand.palm[-1].position == pytest.approx(plain.palm[-1].position, abs=1e-12)
    assert len(hand.palm) == len(plain.palm) + ("forearm" in text)


def test_a_joint_of_a_finger_that_follows_the_wrist_keeps_to_what_that_leaves(tmp_path):
    rule = '<equality><joint joint1="b0" joint2="WRJ1" polycoef="0 1 0 0 0"/></equality>'
    text = gripper(extra=rule).replace(BASE, BASE + WRIST)
    hand = scenes.hand_from_file(written(tmp_path, text), SITES)
    # b0 is drawn at 10 degrees, and the wrist at 0
    assert np.rad2deg(hand.ranges[1]) == pytest.approx([-20.0, 20.0])
    assert any("move no fingertip" in note and "WRJ1" in note for note in hand.notes)
