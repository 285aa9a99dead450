"""Hands of records: built-in ones stand as everywhere, and files are read or refused."""

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from grasp_core.names import HANDS
from scenes.mujoco.filed_hand import FiledHand
from scenes.mujoco.hand_contacts import ContactFinder
from scenes.mujoco.published_tests import TestedObject
from scenes.mujoco_options import PhysicsSettings
from sim_validate.hands.dexgraspbench import dex_record, hand_file, write_dex_record
from sim_validate.judge.formats.reading import read_records
from sim_validate.judge.hands import judged_hand
from sim_validate.judge.postures import placed
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled
from tests.scenes.mujoco.compiled import compiled

RUBBING = (FRICTION, 0.0, 0.0)
BODY = scaled("dodecahedron", 0.035)
ROUNDING_M = {"allegro": 0.0, "leap": 1e-4}
"""How far blocks of fingertips reach beyond their corners, of which MuJoCo knows nothing [m]."""


def filed(name):
    hand = judged_hand(name)
    return FiledHand.of(hand.model, RUBBING, hand.servo_n_m_per_rad)


def scene_of(hand):
    return TestedObject(BODY, FRICTION, 0.1, PhysicsSettings()).by_filed_hand(hand)


@pytest.mark.parametrize("name", HANDS)
def test_links_of_built_in_hands_stand_as_everywhere(name):
    hand, known = filed(name), gc.load_hand(name)
    assert hand.joint_names == tuple(joint.name for joint in known.joints)
    np.testing.assert_allclose(
        hand.ranges, [(joint.lowest, joint.highest) for joint in known.joints]
    )
    np.testing.assert_allclose(hand.servos.stiffness, hand_file(known).stiffness_n_m_per_rad)
    assert [len(finger) for finger in hand.fingers] == [len(f.links) for f in known.fingers]
    model, data = compiled(scene_of(hand))
    rng, root = np.random.default_rng(0), hand_file(known).root
    for _ in range(5):
        joints = rng.uniform(*hand.ranges.T)
        for joint, angle in zip(hand.joint_names, joints, strict=True):
            data.joint(f"hand/{joint}").qpos[0] = angle
        mujoco.mj_kinematics(model, data)
        expected = places(known, joints, root)
        for number, link in enumerate(known.links):
            body = data.body(f"hand/{link.name}")
            np.testing.assert_allclose(body.xpos, expected.link_positions[0, number], atol=1e-9)
            np.testing.assert_allclose(
                body.xmat.reshape(3, 3), expected.link_rotations[0, number], atol=1e-9
            )


@pytest.mark.parametrize("name", ["allegro", "leap"])
def test_fingertips_of_a_record_of_dexgraspbench_touch_where_they_reached(name, tmp_path):
    known = gc.load_hand(name)
    reach = next(each for each in reaches(name, "dodecahedron", 0.035) if each.reached)
    write_dex_record(dex_record(known, reach, "objects/dodecahedron"), tmp_path / "0.npy")
    (record,) = read_records([tmp_path])
    hand = filed(name)
    at = placed(record, hand)
    stood = ContactFinder(scene_of(hand), hand, BODY, 0.001).stood(*at.grasp)
    for finger, contact in zip(reach.fingers, reach.contacts, strict=True):
        tip = f"hand/{known.fingers[finger].links[-1].name}"
        own = [each for each in stood.contacts if each.link == tip]
        nearest = min(
            own, key=lambda each: np.linalg.norm(each.contact.position - contact.position)
        )
        assert nearest.contact.position == pytest.approx(contact.position, abs=2e-5)
        assert nearest.contact.normal == pytest.approx(contact.normal, abs=1e-4)
        assert nearest.distance_m == pytest.approx(ROUNDING_M[name], abs=1e-6)


LEFT = '<body name="left"><joint name="a" axis="1 0 0"/><geom size=".01"{shown}/></body>'
RIGHT = (
    '<body name="right" pos="0 .1 0"><joint name="b" axis="1 0 0"/><geom size=".01"{shown}/></body>'
)
SHOWN = ' contype="0" conaffinity="0"'


def written(folder, left="", right="", rules=""):
    path = folder / "own.xml"
    bodies = LEFT.format(shown=left) + RIGHT.format(shown=right)
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody>{rules}</mujoco>")
    return path


@pytest.mark.parametrize("shown", [(), ("left",), ("left", "right")])
def test_links_that_the_file_lets_touch_nothing_do_so_unless_all_do(shown, tmp_path):
    path = written(tmp_path, *(SHOWN if link in shown else "" for link in ("left", "right")))
    hand = judged_hand(path)
    model, _ = compiled(scene_of(FiledHand.of(hand.model, RUBBING, hand.servo_n_m_per_rad)))
    touching = {model.body(int(model.geom_bodyid[geom])).name for geom in range(model.ngeom)}
    left = {"hand/left"} if shown == ("left",) else set()
    assert touching == {"object", "hand/left", "hand/right"} - left
    said = "bodies without shapes that collide do so with all they have: left, right"
    assert (hand.name, hand.notes) == ("own", (said,) if len(shown) == 2 else ())


TENDON = """<tendon><fixed name="cable">
<joint joint="a" coef="1"/><joint joint="b" coef="1"/></fixed></tendon>"""
OTHER = '<tendon><fixed name="other"><joint joint="b" coef="2"/></fixed></tendon>'
ROPE = '<tendon><spatial name="rope"><site site="one"/><site site="two"/></spatial></tendon>'
SITES = ('/><site name="one"', '/><site name="two"')


def test_tendons_that_no_motor_pulls_are_noted(tmp_path):
    hand = judged_hand(written(tmp_path, rules=TENDON))
    said = "tendons are left out: no motor pulls them, or joints have motors, too: cable"
    assert hand.notes == (said,)
    motor = '<actuator><position tendon="cable"/></actuator>'
    pulled = judged_hand(written(tmp_path, rules=TENDON + motor))
    assert pulled.notes == ()
    assert pulled.filed.servos.names == ("cable",)


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ('<equality><connect body1="left" body2="right" anchor="0 0 0"/></equality>',
         "left and right are in a loop that a connect closes, which is not simulated here"),
        ('<equality><weld body1="left"/></equality>', "are in a loop that a weld closes"),
        (f'{TENDON}{OTHER}<equality><tendon tendon1="cable" tendon2="other"/></equality>',
         "joints are coupled by the length of tendon cable, which is not simulated"),
        (f'{ROPE}<actuator><position tendon="rope"/></actuator>',
         "a motor pulls tendon rope, which is a cable, which is not simulated"),
    ],
)  # fmt: skip
def test_ties_that_are_not_simulated_are_refused(rules, said, tmp_path):
    with pytest.raises(InputError, match=f"own.xml: .*{said}"):
        judged_hand(written(tmp_path, *SITES, rules=rules))


def test_what_is_no_hand_is_refused_with_what_is(tmp_path):
    with pytest.raises(
        InputError, match=r"hand must be allegro, .* or a file that ends with .*\.xml"
    ):
        judged_hand("shadow")
    with pytest.raises(InputError, match=r"missing\.xml"):
        judged_hand(tmp_path / "missing.xml")
