"""Files of the kinds that makers publish: fixed links, packages, odd inertias, coupled joints."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from tests.scenes.hand_files.grippers import gripper, loaded
from tests.scenes.meshes import box_obj

INERTIA = '<inertia ixx="{0}" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/>'
SPHERE = '<geometry><sphere radius="0.008"/></geometry>'
BALL_KG = 1000.0 * 4.0 / 3.0 * np.pi * 0.008**3
"""Mass of a fingertip, which has no inertia in the file, at the density of water."""
TIPS = ("t0", "t1", "t2")


def link(name, shapes="", odd=False):
    weight = f'<inertial><mass value="0.02"/>{INERTIA.format("5e-6" if odd else "1e-6")}</inertial>'
    return f'<link name="{name}">{weight}{shapes}</link>'


def box(tag="collision", length=0.05):
    return (f'<{tag}><origin xyz="0 0 {0.5 * length}"/><geometry><box size="0.01 0.01 {length}"/>'
            f"</geometry></{tag}>")  # fmt: skip


def joint(name, ends, place, turn="0 0 0", kind="revolute", extra=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/>'
        f'<origin xyz="{place}" rpy="{turn}"/><axis xyz="0 1 0"/>'
        f'<limit lower="-1.2" upper="0.9" effort="0.5" velocity="1"/>{extra}</joint>'
    )


def robot(tip=f"<collision>{SPHERE}</collision>", middle=None, follows="", odd=False, more=""):
    """Three fingers of two joints, with fingertips on fixed joints."""
    parts = [link("palm", box(length=0.01)), more]
    for n in range(3):
        turn = 2.0 * np.pi * n / 3.0
        root = f"{0.04 * np.cos(turn)} {0.04 * np.sin(turn)} 0.01"
        parts += [
            link(f"a{n}", box()), link(f"b{n}", box() if middle is None else middle, odd=odd),
            f'<link name="t{n}">{tip}</link>',
            joint(f"ja{n}", ("palm", f"a{n}"), root, f"0 0 {turn}"),
            joint(f"jb{n}", (f"a{n}", f"b{n}"), "0 0 0.055", extra=follows.format(n=n)),
            joint(f"jt{n}", (f"b{n}", f"t{n}"), "0.003 0 0.06", "0.1 0.2 0.3", kind="fixed"),
        ]  # fmt: skip
    return f'<robot name="r">{"".join(parts)}</robot>'


def numbers(element, key):
    return np.array([float(each) for each in element.get(key, "0 0 0").split()])


def in_robot(text, name, angles):
    """Pose of a link in the root's frame, by plain products along the joints of the text."""
    root = ET.fromstring(text)  # noqa: S314 - the test's own text
    above = {each.find("child").get("link"): each for each in root.findall("joint")}
    R, p = np.eye(3), np.zeros(3)
    while name in above:
        each = above[name]
        frame = Rotation.from_euler("xyz", numbers(each.find("origin"), "rpy")).as_matrix()
        if each.get("type") == "revolute":
            turn = angles[each.get("name")] * numbers(each.find("axis"), "xyz")
            frame = frame @ Rotation.from_rotvec(turn).as_matrix()
        R, p = frame @ R, frame @ p + numbers(each.find("origin"), "xyz")
        name = each.find("parent").get("link")
    return R, p


def check_places(hand, text, tips=TIPS, local=(0.0, 0.0, 0.0)):
    """Compare fingertips with points of the named links at random angles."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        angles = hand.drives.obeyed(rng.uniform(*hand.ranges.T)[None])[0]
        named = {j.name: angle for j, angle in zip(hand.joints, angles, strict=True)}
        found = places(hand, angles).tips[0]
        for f, tip in enumerate(tips):
            R, p = in_robot(text, tip, named)
            assert found[f] == pytest.approx(p + R @ local, abs=1e-9)


def test_links_on_fixed_joints_keep_their_names(tmp_path):
    text = robot()
    hand = loaded(tmp_path, text, TIPS)
    assert [finger.name for finger in hand.fingers] == list(TIPS)
    assert [finger.tip.radius for finger in hand.fingers] == pytest.approx([0.008] * 3)
    assert hand.notes == ()
    assert {each.torque_limit_n_m for each in hand.joints} == {0.5}
    check_places(hand, text)


def test_inertias_that_no_body_can_have_are_said_and_masses_stay(tmp_path):
    hand = loaded(tmp_path, robot(odd=True), TIPS)
    assert any("masses alone: b0, b1, b2" in note for note in hand.notes)
    assert [each.mass_kg for each in hand.links] == pytest.approx([0.02, 0.02 + BALL_KG] * 3)


def meshed(name, tag="collision"):
    return f'<{tag}><geometry><mesh filename="{name}"/></geometry></{tag}>'


def test_a_package_is_looked_for_above_the_file_by_its_folder_or_its_own_name(tmp_path):
    root = tmp_path / "my_hand"
    (root / "meshes").mkdir(parents=True)
    (root / "meshes" / "middle.obj").write_text(box_obj(0.005, 0.005, 0.005))
    text = robot(middle=meshed("package://my_hand/meshes/middle.obj"))
    hand = loaded(root / "models" / "urdf", text, TIPS)
    assert hand.links[1].shapes[0].half_sizes == pytest.approx([0.005] * 3)
    assert loaded(root, text, TIPS).links[1] == hand.links[1]
    other = root.rename(tmp_path / "checkout")
    with pytest.raises(InputError, match="package my_hand around it"):
        loaded(other / "models" / "urdf", text, TIPS)
    (other / "package.xml").write_text("<package><name>my_hand</name></package>")
    assert loaded(other / "models" / "urdf", text, TIPS).links[1] == hand.links[1]


OUTSIDE = {
    "another": "package://other/meshes/secret.obj",
    "climbing": "package://my_hand/../other/meshes/secret.obj",
    "link": "package://my_hand/meshes/link.obj",
    "root": "package:///etc/passwd",
    "dots": "package://../other/meshes/secret.obj",
}


@pytest.mark.parametrize("case", OUTSIDE)
def test_nothing_is_read_outside_the_package(case, tmp_path):
    for name in ("my_hand", "other"):
        (tmp_path / name / "meshes").mkdir(parents=True)
    secret = tmp_path / "other" / "meshes" / "secret.obj"
    secret.write_text(box_obj(0.005, 0.005, 0.005))
    (tmp_path / "my_hand" / "meshes" / "link.obj").symlink_to(secret)
    with pytest.raises(InputError, match="not in the folder of the model"):
        loaded(tmp_path / "my_hand" / "urdf", robot(middle=meshed(OUTSIDE[case])), TIPS)


VISUAL = {
    "no others": (box("visual"), "collide with their visual ones: b0, b1, b2", [1, 2] * 3),
    "others": (box() + meshed("missing.glb", "visual"), None, [1, 2] * 3),
    "pictures alone": (meshed("missing.dae", "visual"), "touch nothing: b0, b1, b2", [1, 1] * 3),
}


@pytest.mark.parametrize("case", VISUAL)
def test_visual_shapes_are_read_only_where_a_link_has_no_others(case, tmp_path):
    middle, noted, counts = VISUAL[case]
    hand = loaded(tmp_path, robot(middle=middle), TIPS)
    assert [len(each.shapes) for each in hand.links] == counts
    assert [finger.tip.radius for finger in hand.fingers] == pytest.approx([0.008] * 3)
    assert not hand.notes if noted is None else any(noted in note for note in hand.notes)


def test_a_fingertip_without_shape_is_the_nearest_of_its_link(tmp_path):
    ball = '<collision><origin xyz="0 0 0.055"/><geometry><sphere radius="0.006"/></geometry>'
    text = robot(tip="", middle=f"{ball}</collision>{box(length=0.04)}")
    hand = loaded(tmp_path, text, TIPS)
    assert [finger.tip.radius for finger in hand.fingers] == pytest.approx([0.006] * 3)
    assert any("nearest shape of their link: t0, t1, t2" in note for note in hand.notes)
    check_places(hand, text, ("b0", "b1", "b2"), (0.0, 0.0, 0.055))


def test_what_simulators_add_to_urdf_is_left_out_and_what_is_no_finger_is_refused(tmp_path):
    more = '<gazebo><plugin filename="libx.so" name="x"/></gazebo><transmission name="t"/>'
    assert loaded(tmp_path, robot(more=more), TIPS) == loaded(tmp_path, robot(), TIPS)
    for text, said in (
        (robot(tip="", middle=""), "a sphere of the fingertip's radius"),
        (robot(follows='<mimic joint="jt{n}"/>'),
         "jb0 must follow a joint that moves, got <mimic> of jt0"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=said):
            loaded(tmp_path, text, TIPS)


def test_joints_of_urdf_follow_others(tmp_path):
    text = robot(follows='<mimic joint="ja{n}" multiplier="1.5" offset="0.1"/>')
    hand = loaded(tmp_path, text, TIPS)
    assert [(c.joint, c.driver) for c in hand.couplings] == [(f"jb{n}", f"ja{n}") for n in range(3)]
    assert [(c.ratio, c.offset) for c in hand.couplings] == [pytest.approx((1.5, 0.1))] * 3
    # -1.2 <= 1.5 q + 0.1 <= 0.9
    assert hand.ranges[0] == pytest.approx([-1.3 / 1.5, 0.8 / 1.5])
    check_places(hand, text)


CRANK = (
    '<body name="crank" pos="0 0 -0.03"><joint name="crank" axis="1 0 0" range="-10 10"/>'
    '<geom type="box" size="0.01 0.01 0.01"/></body>'
)


def rule(one, other, coefficients="0 1 0 0 0"):
    return f'<joint joint1="{one}" joint2="{other}" polycoef="{coefficients}"/>'


def coupled(tmp_path, equality, tendon=""):
    """A gripper of three fingers, drawn bent by ten degrees, beside a crank on the palm."""
    extra = f"<tendon>{tendon}</tendon><equality>{equality}</equality>"
    text = gripper(extra=extra, fingers=3, on_palm=CRANK)
    motors = ' actuatorfrcrange="-0.4 0.4"'  # joints that have them would drive the others
    return loaded(tmp_path, text.replace(motors, ""), ("d0", "d1", "d2"), "hand.xml")


TEN = np.deg2rad(10.0)
TIE = '<fixed name="tie"><joint joint="b0" coef="2"/><joint joint="c0" coef="1"/></fixed>'
COUPLED = {
    "one": (rule("c0", "b0", "0.2 0.5 0 0 0"), [("c0", "b0", 0.5, 0.2 - 0.5 * TEN)]),
    "a chain": (
        rule("c0", "b0", "0 0.5 0 0 0") + rule("b0", "a0", "0 -2 0 0 0"),
        [("b0", "a0", -2.0, TEN), ("c0", "a0", -1.0, 0.0)],
    ),
    "off": ('<joint joint1="c0" joint2="b0" active="false"/>', []),
    "a tendon": (
        '<tendon tendon1="tie" polycoef="0.3 0 0 0 0"/>',
        [("b0", "c0", -0.5, 0.15 + TEN)],  # 2 (b0 - 10 degrees) + c0 = 0.3
    ),
}


@pytest.mark.parametrize("case", COUPLED)
def test_equalities_are_about_the_angles_in_which_a_file_is_drawn(case, tmp_path):
    """The rule is c - 0 = 0.2 + 0.5 (b - 10 degrees), and a chain of rules ends at a free joint."""
    rules, wanted = COUPLED[case]
    hand = coupled(tmp_path, rules, TIE if "tie" in rules else "")
    found = [(c.joint, c.driver, c.ratio, c.offset) for c in hand.couplings]
    assert [each[:2] for each in found] == [each[:2] for each in wanted]
    for one, other in zip(found, wanted, strict=True):
        assert one[2:] == pytest.approx(other[2:], abs=1e-12)


def test_joints_that_follow_one_that_moves_no_fingertip_follow_each_other(tmp_path):
    """b0 = 4 k + 10 degrees and c1 = -2 k, with k from -10 to 10 degrees."""
    hand = coupled(tmp_path, rule("b0", "crank", "0 4 0 0 0") + rule("c1", "crank", "0 -2 0 0 0"))
    (coupling,) = hand.couplings
    assert (coupling.joint, coupling.driver, coupling.ratio) == ("c1", "b0", -0.5)
    names = [joint.name for joint in hand.joints]
    assert np.rad2deg(hand.ranges[names.index("b0")]) == pytest.approx([-30.0, 50.0])
    assert np.rad2deg(hand.ranges[names.index("c1")]) == pytest.approx([-20.0, 20.0])
    assert any("crank" in note for note in hand.notes)


def test_a_joint_that_is_held_at_an_angle_has_no_other(tmp_path):
    hand = coupled(tmp_path, '<joint joint1="b0" polycoef="0.3 0 0 0 0"/>')
    names = [joint.name for joint in hand.joints]
    assert hand.ranges[names.index("b0")] == pytest.approx([0.3 + np.deg2rad(10.0)] * 2)


TENDON = '<fixed name="pull"><joint joint="b0" coef="1"/><joint joint="c0" coef="1"/></fixed>'


def test_tendons_without_rules_leave_joints_free_with_a_note(tmp_path):
    hand = coupled(tmp_path, "", TENDON)
    assert hand.couplings == ()
    assert "tendons that no motor pulls are left out: pull" in hand.notes


def test_a_tendon_that_keeps_two_joints_together_couples_them(tmp_path):
    """2 b + c is from -0.1 to 0.3, so that b follows c in the middle, where b has no motor."""
    tie = TIE.replace("<fixed ", '<fixed limited="true" range="-0.1 0.3" ')
    hand = coupled(tmp_path, "", tie)
    found = [(c.joint, c.driver, c.ratio, c.offset) for c in hand.couplings]
    assert found == [("b0", "c0", -0.5, pytest.approx(0.05))]
    assert any("follow each other, without play: tie" in note for note in hand.notes)
    loose = coupled(tmp_path, "", tie.replace("-0.1", "-1.1"))
    assert loose.couplings == ()


def test_motors_of_several_joints_are_told(tmp_path):
    motor = '<actuator><position tendon="pull" kp="1"/></actuator>'
    hand = coupled(tmp_path, f"</equality>{motor}<equality>", TENDON)
    assert hand.couplings == ()
    assert hand.shared_motors == ("one motor pulls tendon pull, which turns b0, c0",)


REFUSED = {
    "curve": (rule("c0", "b0", "0 1 0.5 0 0"), "joints b0, c0 are on a curve"),
    "circle": (rule("c0", "b0") + rule("b0", "c0"), "joints b0, c0 follow each other in a circle"),
    "two": (rule("c0", "b0") + rule("c0", "a0"), "joints c0 follow two others"),
    "loop": ('<connect body1="d0" body2="crank" anchor="0 0 0"/>',
             "joints a0, b0, c0 are in a loop that a connect closes"),
    "weld": ('<weld body1="d0" body2="d1"/>', "joints a0, b0, c0, a1, b1, c1 are in a loop"),
    "tendon": ('<tendon tendon1="pull" tendon2="tie"/>',
               "joints b0, c0 are coupled by the length of tendon"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_other_rules_are_refused_with_their_joints(case, tmp_path):
    equality, said = REFUSED[case]
    with pytest.raises(InputError, match=said):
        coupled(tmp_path, equality, TENDON + TIE if case == "tendon" else "")


def test_a_weld_that_holds_the_palm_is_no_loop(tmp_path):
    base = '<body name="base" pos="0 0 0.3">'
    text = gripper(extra='<equality><weld body1="base"/></equality>', fingers=3)
    text = text.replace(base, f"{base}<freejoint/>")
    assert len(loaded(tmp_path, text, ("d0", "d1", "d2"), "hand.xml").joints) == 9


def test_fingers_with_joints_in_common_move_as_one(tmp_path):
    """Fingers 1 and 2 stand on a link of the palm, as ring and little finger of some hands do."""
    text = robot(more=link("arch", box(length=0.02)) + joint("arch", ("palm", "arch"), "0 0 0.01"))
    for n in (1, 2):
        text = text.replace(f'"palm"/><child link="a{n}"', f'"arch"/><child link="a{n}"')
    hand = loaded(tmp_path, text, TIPS)
    assert [j.name for j in hand.fingers[1].links[0:1]] == ["arch"]
    (coupling,) = hand.couplings
    assert (coupling.joint, coupling.driver, coupling.ratio) == ("arch of t2", "arch", 1.0)
    assert hand.file_joints[2:4] == ("arch", "ja1")
    assert hand.file_joints[5:7] == ("arch", "ja2")
    assert sum(len(each.shapes) for each in hand.links) == 10
    assert sum(each.mass_kg for each in hand.links) == pytest.approx(7 * 0.02 + 3 * BALL_KG)
    check_places(hand, text)
    with pytest.raises(InputError, match="arch moves arch and another fingertip"):
        loaded(tmp_path, text, ("t0", "t1", "arch"))
