"""Isaac grasp files, read by their published format, put the hand where its fingertips touch."""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import REACHES
from sim_validate.commands.exit_codes import Exit
from sim_validate.hands.isaac import isaac_text, reached_grasps
from sim_validate.hands.reaches import Reaches
from sim_validate.main import main
from tests.isaac_files import last_link, read_isaac
from tests.three_fingers import THREE_TIPS, three_fingers_mjcf

pytest.importorskip("yaml")
TOUCHING = 1e-6
"""Farthest that a fingertip may be from its contact [m]; poses from a search are nearer by far."""
ROUNDING = 1e-14
"""Rounding of a rotation that becomes a quaternion and a rotation again: a few dozen of 1e-16."""
CURLS = {"thumb": (-0.1, 1.2), "left": (-0.2, 0.8), "right": (-0.2, 0.8)}
RULES = "".join(
    f'<joint joint1="{finger}_curl" joint2="{finger}_bend" polycoef="{offset} {ratio} 0 0 0"/>'
    for finger, (offset, ratio) in CURLS.items()
)
YOKE = (
    '<body name="yoke"><joint name="yoke" axis="0 0 1" range="-20 20"/>'
    '<inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>'
)


def coupled_fingers():
    """The gripper with three fingers that curl as they bend."""
    return three_fingers_mjcf().replace("</mujoco>", f"<equality>{RULES}</equality></mujoco>")


def yoked_fingers():
    """The gripper with two of its fingers on one part that turns, on a palm that is elsewhere."""
    text = three_fingers_mjcf().replace('<body name="left"', f'{YOKE}<body name="left"')
    text = text.replace("</body>\n  </worldbody>", "</body></body>\n  </worldbody>")
    return text.replace('<body name="palm">', '<body name="plate" pos=".1 0 .2" euler="20 0 30">')


FILES = {"coupled": coupled_fingers, "yoked": yoked_fingers}
JOINTS = {
    "coupled": ["thumb_bend", "thumb_curl", "left_spread", "left_bend", "left_curl",
                "right_spread", "right_bend", "right_curl"],
    "yoked": ["thumb_bend", "thumb_curl", "yoke", "left_spread", "left_bend", "left_curl",
              "right_spread", "right_bend", "right_curl"],
}  # fmt: skip


@pytest.fixture(scope="module")
def small_box(tmp_path_factory):
    """Grasps of a box of 35 mm radius."""
    box = scenes.example_object("box")
    body = gc.Polyhedron.from_mesh(0.035 / box.radius * box.vertices, box.triangles, name="box")
    path = tmp_path_factory.mktemp("box") / "grasps.json"
    gc.save_grasps(path, gc.plan(body, 0.5, limit=4))
    return path


@pytest.fixture(scope="module")
def bracket(bracket_plan, tmp_path_factory):
    """A folder with grasps, where Allegro stands in them, and its file for Isaac."""
    return exported(tmp_path_factory.mktemp("allegro"), bracket_plan, "allegro")


def exported(folder, grasps, *hand):
    shutil.copy(grasps, folder / "grasps.json")
    words = ["reach", str(folder / "grasps.json"), "--out", str(folder), "--jobs", "1", "-q"]
    assert main([*words, "--hand", *hand]) in {Exit.GOOD, Exit.NEGATIVE}
    assert export(folder) == Exit.GOOD
    return folder


def export(folder, *flags, out="grasps.yaml"):
    words = ["export", str(folder / "grasps.json"), "--to", "isaac", "-o", str(folder / out), "-q"]
    return main([*words, *flags])


def reached(folder):
    """The poses of a `reaches.json`, as JSON says them."""
    found = json.loads((folder / REACHES).read_text())["reaches"]
    return {each["id"]: each for each in found if each["reached"]}


def contacts_by_finger(pose):
    return [
        (finger, np.array(each["position_m"]), np.array(each["normal"]))
        for finger, each in zip(pose["fingers"], pose["contacts"], strict=True)
    ]


def test_a_built_in_hand_touches_where_its_joints_in_the_file_say(bracket):
    record = json.loads((bracket / REACHES).read_text())["hand"]
    known, (of, palm, grasps) = reached(bracket), read_isaac(bracket / "grasps.yaml")
    assert (of, palm) == ("l-bracket", "palm")
    assert list(grasps) == [name for name in known if known[name]["opens"]]
    assert len(grasps) >= 2
    joints = [link["joint"] for finger in record["fingers"] for link in finger["links"]]
    for name, grasp in grasps.items():
        pose = known[name]
        assert list(grasp.joints) == [joint["name"] for joint in joints]
        assert [*grasp.joints.values()] == pose["joints_rad"]
        assert [*grasp.open_joints.values()] == pose["pregrasp_joints_rad"]
        assert grasp.pose[:3, 3].tolist() == [row[3] for row in pose["palm_pose"][:3]]
        np.testing.assert_allclose(grasp.pose, pose["palm_pose"], rtol=0.0, atol=ROUNDING)
        for joint in joints:
            for angles in (grasp.joints, grasp.open_joints):
                assert joint["lowest_rad"] <= angles[joint["name"]] <= joint["highest_rad"]
        touching = contacts_by_finger(pose)
        assert len(touching) == 4
        for finger, point, normal in touching:
            tip, link = record["fingers"][finger]["tip"], last_link(record, finger, grasp)
            center = link[:3, :3] @ tip["center_m"] + link[:3, 3]
            assert center + tip["radius_m"] * normal == pytest.approx(point, abs=TOUCHING)


@pytest.mark.parametrize("kind", FILES)
def test_mujoco_has_the_tips_of_a_file_at_the_contacts(kind, small_box, tmp_path):
    """The joints that the Isaac file names are set in the hand's own file, no others."""
    path = tmp_path / f"{kind}.xml"
    path.write_text(FILES[kind]())
    folder = exported(tmp_path, small_box, str(path), "--fingertips", ",".join(THREE_TIPS))
    model = mujoco.MjModel.from_xml_path(str(path))
    data, known = mujoco.MjData(model), reached(folder)
    _, palm, grasps = read_isaac(folder / "grasps.yaml")
    assert palm == {"coupled": "palm", "yoked": "plate"}[kind]
    assert len(grasps) >= 2
    for name, grasp in grasps.items():
        assert list(grasp.joints) == JOINTS[kind]
        for angles in (grasp.open_joints, grasp.joints):
            for joint, angle in angles.items():
                low, high = model.joint(joint).range
                assert low - 1e-12 <= angle <= high + 1e-12
                data.joint(joint).qpos = angle
            for finger, (offset, ratio) in CURLS.items() if kind == "coupled" else ():
                followed = offset + ratio * angles[f"{finger}_bend"]
                assert angles[f"{finger}_curl"] == pytest.approx(followed, abs=1e-12)
        mujoco.mj_kinematics(model, data)
        base = data.body(palm)
        for finger, point, normal in contacts_by_finger(known[name]):
            end = data.body(f"{('thumb', 'left', 'right')[finger]}_end")
            at = end.xpos + 0.04 * end.xmat.reshape(3, 3)[:, 2]
            center = grasp.pose[:3, :3] @ base.xmat.reshape(3, 3).T @ (at - base.xpos)
            center += grasp.pose[:3, 3]
            assert center + 0.008 * normal == pytest.approx(point, abs=TOUCHING)
    if kind == "yoked":
        assert max(abs(grasp.joints["yoke"]) for grasp in grasps.values()) > 0.01


def test_the_same_poses_give_the_same_bytes_and_fewer_are_chosen(bracket):
    assert export(bracket, out="again.yaml") == Exit.GOOD
    assert (bracket / "again.yaml").read_bytes() == (bracket / "grasps.yaml").read_bytes()
    _, _, grasps = read_isaac(bracket / "grasps.yaml")
    last = [*grasps][-1]
    assert export(bracket, "--grasp", last, out="one.yml") == Exit.GOOD
    assert [*read_isaac(bracket / "one.yml")[2]] == [last]
    assert export(bracket, "--limit", "1", out="first.yaml") in {Exit.GOOD, Exit.NONE}


def test_grasps_that_the_hand_does_not_reach_or_open_in_are_left_out(bracket, tmp_path, capsys):
    found = Reaches.read(bracket / REACHES)
    closed = [replace(each, reach=replace(each.reach, pregrasp=None)) for each in found]
    shutil.copy(bracket / "grasps.json", tmp_path)
    (tmp_path / REACHES).write_text(replace(found, reaches=(closed[0], *found.reaches[1:])).text())
    assert export(tmp_path) == Exit.GOOD
    _, _, grasps = read_isaac(tmp_path / "grasps.yaml")
    known = reached(bracket)
    assert [*grasps] == [name for name in known if known[name]["opens"] and name != closed[0].id]
    (tmp_path / REACHES).write_text(replace(found, reaches=tuple(closed)).text())
    words = ["export", str(tmp_path / "grasps.json"), "--to", "isaac", "-o", str(tmp_path / "no")]
    assert main([*words[:-1], str(tmp_path / "no.yaml")]) == Exit.NONE
    assert "and can open its fingers in 0" in capsys.readouterr().out
    assert not (tmp_path / "no.yaml").exists()


def test_confidence_is_what_simulations_of_the_hand_said(bracket):
    (first, *_) = Reaches.read(bracket / REACHES)

    def confidence(**said):
        stated = {"simulated": None, "executed": None, **said}
        (only,) = reached_grasps([SimpleNamespace(id=first.id, reach=first.reach, **stated)])
        return only.confidence

    assert confidence(good=True) == 0.5
    assert confidence(good=True, simulated="a verdict") == 1.0
    assert confidence(good=False, simulated="a verdict") == 0.0
    assert confidence(good=True, executed="an execution") == 1.0
    assert confidence(good=False, executed="an execution") == 0.0


def test_names_and_numbers_are_read_back_unchanged_by_yaml(bracket, tmp_path):
    """YAML takes 1e-07 and 0 for other things than a number with a fraction, and a name."""
    found = Reaches.read(bracket / REACHES)
    name = 'a: [b]\n"c" \\ !!python/object \x7f\u2028 \U0001f44b'
    finger = found.hand.fingers[0]
    first = replace(finger.links[0], joint=replace(finger.links[0].joint, name="0"))
    fingers = (replace(finger, links=(first, *finger.links[1:])), *found.hand.fingers[1:])
    hand = replace(found.hand, name=name, fingers=fingers, palm_link="yes")
    (grasp, *_) = reached_grasps(found)
    joints = np.array([1e-7, -2.5e-300, -0.0, *grasp.joints[3:]])
    text = isaac_text(hand, name, [replace(grasp, name=name, joints=joints)], "any")
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    of, palm, grasps = read_isaac(tmp_path / "a.yaml")
    assert (of, palm, *grasps) == (name, "yes", name)
    assert next(iter(grasps[name].joints)) == "0"
    assert [*grasps[name].joints.values()] == joints.tolist()


def test_copies_of_a_joint_must_agree(tmp_path):
    path = tmp_path / "yoked.xml"
    path.write_text(yoked_fingers())
    hand = scenes.hand_from_file(path, THREE_TIPS)
    names = [joint.name for joint in hand.joints]
    joints = np.zeros(len(names))
    joints[names.index("yoke of right_tip")] = 1e-3
    found = reached_grasps([SimpleNamespace(
        id="g", simulated=None, executed=None,
        reach=SimpleNamespace(palm_pose=np.eye(4), joints=joints, pregrasp=joints),
    )])  # fmt: skip
    with pytest.raises(InputError, match="g: joint yoke of yoked must have one angle, got 0 and"):
        isaac_text(hand, "box", found, "any")


def test_what_has_no_hand_is_refused_with_a_remedy(bracket_plan, tmp_path, capsys):
    shutil.copy(bracket_plan, tmp_path / "grasps.json")
    assert export(tmp_path) == Exit.INPUT
    assert "graspproof reach" in capsys.readouterr().err
    assert export(tmp_path, out="grasps.glb") == Exit.USAGE
    assert "--out must end in .yaml or .yml with --to isaac" in capsys.readouterr().err
    assert export(tmp_path, "--fingertip-radius-m", "0.01") == Exit.USAGE
    assert "--fingertip-radius-m is for fingertips without a hand" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["grasps.json"]
