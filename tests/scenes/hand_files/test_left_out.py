"""What says nothing about a hand, or is of other releases of MuJoCo, is left out with a note."""

import pytest

import scenes
from grasp_core.errors import InputError
from scenes.hand_files.model import compiled_hand
from scenes.hand_files.model_text import model_text
from tests.scenes.hand_files.grippers import gripper, written
from tests.scenes.hand_files.test_published_kinds import TIPS, loaded, robot

SITES = ("s0", "s1", "s2", "s3")
OLD = """
<compiler convexhull="false" exactmeshinertia="true"/>
<option apirate="200" collision="dynamic" mpr_iterations="50" mpr_tolerance="1e-6">
  <flag passive="disable" sensornoise="enable"/>
</option>
<size njmax="500" nconmax="100" nstack="600000" nuser_jnt="1"/>
"""
CAPS = """
<asset>
  <texture name="sky" type="skybox" file="gone.png"/>
  <texture name="skin" builtin="flat" width="90000" height="90000"/>
  <material name="skin" texture="skin" rgba="1 0 0 1"/>
</asset>
<sensor><jointpos joint="gone"/><touch site="s0"/></sensor>
<keyframe><key qpos="0 0 0"/></keyframe>
<custom><tuple name="t"><element objtype="body" objname="gone"/></tuple></custom>
"""


@pytest.fixture
def plain(tmp_path):
    return scenes.hand_from_file(written(tmp_path, gripper(), "gripper.xml"), SITES)


def hand_with(tmp_path, extra):
    return scenes.hand_from_file(written(tmp_path / "other", gripper(extra=extra)), SITES)


def test_attributes_of_older_releases_are_left_out_and_named_once(tmp_path, plain):
    hand = hand_with(tmp_path, OLD + OLD)
    assert hand.notes == (
        "attributes that MuJoCo no longer has are left out: convexhull, exactmeshinertia, apirate, "
        "collision, mpr_iterations, mpr_tolerance, passive, sensornoise",
        *plain.notes,
    )
    assert (hand.fingers, hand.palm, hand.ignored_pairs) == (
        plain.fingers, plain.palm, plain.ignored_pairs,
    )  # fmt: skip


def test_attributes_that_no_release_had_are_refused(tmp_path):
    with pytest.raises(InputError, match="unrecognized attribute: 'apirated'"):
        hand_with(tmp_path, '<option apirated="200"/>')


def test_pictures_sensors_and_keyframes_are_left_out_without_a_word(tmp_path, plain):
    assert hand_with(tmp_path, CAPS) == plain


def test_pictures_of_urdf_are_not_looked_for(tmp_path):
    paint = '<material name="paint"><texture filename="gone.png"/></material>'
    assert loaded(tmp_path, robot(more=paint), TIPS) == loaded(tmp_path, robot(), TIPS)


MISSING = {
    "joint": '<actuator><motor name="x" joint="gone"/></actuator>',
    "tendon": '<actuator><position name="x" tendon="gone"/></actuator>',
    "body": '<actuator><adhesion name="x" body="gone" ctrlrange="0 1"/></actuator>',
    "site": '<actuator><general name="x" site="s0" refsite="gone"/></actuator>',
    "joint of a sum": '<tendon><fixed name="x"><joint joint="a0" coef="1"/>'
    '<joint joint="gone" coef="1"/></fixed></tendon>',
    "site of a cable": '<tendon><spatial name="x"><site site="s0"/><site site="gone"/></spatial>'
    "</tendon>",
    "geom": '<contact><pair name="x" geom1="g0" geom2="gone"/></contact>',
    "excluded body": '<contact><exclude name="x" body1="gone" body2="f0"/></contact>',
    "a body called like a joint": '<actuator><motor name="x" joint="f0"/></actuator>',
}


@pytest.mark.parametrize("case", MISSING)
def test_what_needs_a_missing_part_is_left_out_and_named(case, tmp_path, plain):
    hand = hand_with(tmp_path, MISSING[case])
    said = "motors, tendons and contacts of parts that the file lacks are left out: x"
    assert hand.notes == (said, *plain.notes)
    assert (hand.fingers, hand.ignored_pairs) == (plain.fingers, plain.ignored_pairs)


def test_motors_of_tendons_that_are_left_out_are_left_out_too_and_others_stay(tmp_path):
    extra = (
        '<actuator><motor tendon="pull"/><motor name="kept" joint="a0" forcerange="-2 2"/>'
        '<motor name="too" tendon="sound"/></actuator><contact><pair geom1="gone" geom2="g0"/>'
        '<exclude body1="f0" body2="f1"/><exclude body1="world" body2="f1"/></contact>'
        '<tendon><fixed name="pull"><joint joint="gone" coef="1"/></fixed>'
        '<fixed name="sound"><joint joint="c0" coef="1"/></fixed></tendon>'
    )
    model = compiled_hand(text := model_text(written(tmp_path, gripper(extra=extra))))
    assert text.notes[0].endswith("left out: pull, pair of gone, motor of pull")
    assert [model.raw.actuator(i).name for i in range(model.raw.nu)] == ["kept", "too"]
    assert [tendon.name for tendon in model.tendons] == ["sound"]
    assert len(model.raw.exclude_signature) == 2
    assert model.torques[model.joint_names.index("a0")] == 2.0


def test_a_rule_of_a_missing_joint_is_refused(tmp_path):
    with pytest.raises(InputError, match="gone"):
        hand_with(tmp_path, '<equality><joint joint1="a0" joint2="gone"/></equality>')
