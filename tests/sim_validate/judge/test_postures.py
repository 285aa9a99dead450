"""How hands open and squeeze where records do not say so, by what contacts do."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError
from grasp_core.objects.convex_pieces import pieced_object
from scenes.mujoco.hand_contacts import ContactFinder
from scenes.mujoco.published_tests import TestedObject
from scenes.mujoco_options import PhysicsSettings
from sim_validate.judge.postures import OPENED_M, completed, placed, pushes
from sim_validate.judge.records import HandRecord, Posture
from tests.scenes.mujoco.test_filed_hand import filed
from tests.scenes.mujoco.test_hand_contacts import ONE

SLIDES = """<mujoco><compiler angle="radian"/><worldbody><geom size=".01" pos="0 0 .03"/>
<body name="left" pos="-.05 0 0"><joint name="left" type="slide" axis="1 0 0" range="-.1 .1"/>
  <geom size=".01"/><geom size=".01" pos="0 .02 0"/></body>
<body name="right" pos=".05 0 0"><joint name="right" type="slide" axis="-1 0 0" range="{low} .1"/>
  <geom size=".01"/></body>
</worldbody>
<actuator><position joint="left" kp="200" ctrlrange="-.1 {most}"/></actuator></mujoco>"""
"""A palm on top of the block of 80, 80 and 40 mm, and fingers on two of its sides."""
HINGES = """<mujoco><default><geom size=".01" pos="0 0 -.06"/></default><worldbody>
<body name="left" pos="-.05 0 .06"><joint name="left" axis="0 1 0"/><geom/></body>
<body name="right" pos=".05 0 .06"><joint name="right" axis="0 1 0"/><geom/></body>
</worldbody></mujoco>"""


def record(joints=(0.0, 0.0), names=(), root=None, **others):
    root = np.eye(4) if root is None else root
    told = {"pregrasp": None, "squeeze": None, "axes": np.eye(3)} | others
    return HandRecord("r", "block", 1.0, names, Posture(root, np.array(joints)), **told)


def standing(folder, text, joints=(0.0, 0.0)):
    """A hand at the block, its finder, and its contacts."""
    hand, made = filed(folder, text), pieced_object(ONE)
    tested = TestedObject(made.body, 0.5, 0.1, PhysicsSettings(), made.pieces)
    finder = ContactFinder(tested.by_filed_hand(hand), hand, made.body, 0.009)
    at = placed(record(joints), hand)
    return hand, finder, at, finder.stood(*at.grasp).contacts


def opened(hand, finder, at, contacts):
    """The contacts of the hand once it has opened."""
    found = completed(at, hand, contacts, finder.levers(contacts), None, 1.0)
    stood = finder.stood(found.roots[0], found.joints[0]).contacts
    return found, {(each.link, each.contact.position[1] > 0.01): each.distance_m for each in stood}


@pytest.mark.parametrize("overlap", [-0.001, 0.0, 0.002])
def test_fingers_open_by_the_gap_and_what_no_joint_moves_stays(overlap, tmp_path):
    text = SLIDES.format(low=-0.1, most=0.1)
    hand, finder, at, contacts = standing(tmp_path, text, (overlap, overlap))
    assert len(contacts) == 4
    found, gaps = opened(hand, finder, at, contacts)
    expected = OPENED_M if overlap > 0.0 else OPENED_M - overlap
    assert gaps == pytest.approx(
        {("hand/world", False): 0.0} | dict.fromkeys(
            [("hand/left", False), ("hand/left", True), ("hand/right", False)], expected
        ), abs=1e-7,
    )  # fmt: skip
    np.testing.assert_array_equal(found.joints[1], at.joints[1])
    np.testing.assert_array_equal(found.roots, at.roots)


def test_joints_open_no_farther_than_their_ranges_let_them(tmp_path):
    stood = standing(tmp_path, SLIDES.format(low=-0.002, most=0.1))
    _, gaps = opened(*stood)
    assert gaps["hand/right", False] == pytest.approx(0.002, abs=1e-7)
    assert gaps["hand/left", False] == pytest.approx(OPENED_M, abs=1e-7)
    # a joint that is beyond its range stays where it is
    stood = standing(tmp_path, SLIDES.format(low=0.001, most=0.1))
    assert opened(*stood)[0].joints[0, 1] == 0.0


def test_hinges_open_nearly_by_the_gap(tmp_path):
    _, gaps = opened(*standing(tmp_path, HINGES))
    assert gaps == pytest.approx(
        dict.fromkeys([("hand/left", False), ("hand/right", False)], OPENED_M), rel=0.1
    )


def test_squeezing_servos_have_the_torques_of_the_forces(tmp_path):
    """Two fingers and the palm on three sides of a block: the forces are those of the proof."""
    hand, finder, at, contacts = standing(tmp_path, SLIDES.format(low=-0.1, most=0.1))
    side = [each for each in contacts if each.link != "hand/world"]
    proof = force_closure([each.contact for each in side], friction=0.5)
    assert proof.closed
    found = completed(at, hand, side, finder.levers(side), proof, 3.0)
    forces = pushes([each.contact for each in side], proof, 3.0)
    normals = np.array([each.contact.normal for each in side])
    assert np.einsum("ki,ki->k", forces, normals).max() == pytest.approx(3.0)
    np.testing.assert_allclose(forces / forces[0, 0], proof.forces / proof.forces[0, 0])
    along = {"hand/left": 1.0, "hand/right": -1.0}
    for place, (name, way) in enumerate(along.items()):
        own = sum(
            force[0] * way for each, force in zip(side, forces, strict=True) if each.link == name
        )
        told = hand.servos.stiffness[place] * (found.joints[2, place] - found.joints[1, place])
        assert own > 0.0
        assert told == pytest.approx(own)


def test_commands_stay_in_their_spans(tmp_path):
    hand, finder, at, contacts = standing(tmp_path, SLIDES.format(low=-0.1, most=0.001))
    found = completed(at, hand, contacts, finder.levers(contacts), None, 3.0)
    assert found.joints[2, 0] == 0.001
    assert found.joints[2, 1] == pytest.approx(3.0 / hand.servos.stiffness[1])


def test_without_a_proof_every_contact_pushes_along_its_normal(tmp_path):
    *_, contacts = standing(tmp_path, SLIDES.format(low=-0.1, most=0.1))
    own = [each.contact for each in contacts]
    np.testing.assert_allclose(pushes(own, None, 2.0), [2.0 * each.normal for each in own])
    assert pushes([], None, 2.0).shape == (0, 3)


def test_what_a_record_states_is_kept_in_the_order_of_the_hand(tmp_path):
    hand, finder, _, contacts = standing(tmp_path, SLIDES.format(low=-0.1, most=0.1))
    away = np.eye(4)
    away[:3, 3] = 0.0, 0.0, 0.1
    given = record(
        (0.02, 0.01), ("right", "left"), pregrasp=Posture(away, np.array([-0.02, -0.01])),
        squeeze=Posture(np.eye(4), np.array([0.04, 0.03])),
    )  # fmt: skip
    at = placed(given, hand)
    expected = [[-0.01, -0.02], [0.01, 0.02], [0.03, 0.04]]
    np.testing.assert_array_equal(at.joints, expected)
    np.testing.assert_array_equal(at.roots[:, 2, 3], [0.1, 0.0, 0.0])
    found = completed(at, hand, contacts, finder.levers(contacts), None, 1.0)
    np.testing.assert_array_equal(found.joints, expected)


@pytest.mark.parametrize(
    ("joints", "names", "said"),
    [
        ((0.0, 0.0), ("left", "thumb"), "it lacks right and the hand has no thumb"),
        ((0.0,), ("left",), "but it lacks right; complete it"),
        ((0.0,) * 3, ("left", "right", "thumb"), "but the hand has no thumb; complete"),
        ((0.0,) * 3, (), "must have the 2 joints of the hand, got 3"),
    ],
)
def test_records_of_other_joints_are_refused(joints, names, said, tmp_path):
    hand = filed(tmp_path, SLIDES.format(low=-0.1, most=0.1))
    with pytest.raises(InputError, match=said):
        placed(record(joints, names), hand)


def test_commands_turn_the_root_the_short_way(tmp_path):
    hand = filed(tmp_path, SLIDES.format(low=-0.1, most=0.1))
    roots = np.tile(np.eye(4), (3, 1, 1))
    for root, degrees in zip(roots, (170.0, 180.0, 190.0), strict=True):
        root[:3, :3] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    stages = [Posture(root, np.zeros(2)) for root in roots]
    given = record(root=roots[1], pregrasp=stages[0], squeeze=stages[2])
    told = placed(given, hand).commands(np.array([0.0, 0.0, 0.01]))
    assert told.shape == (3, 9)
    np.testing.assert_allclose(told[:, 2], -0.01)
    assert (told[:, 3:7] @ told[1, 3:7] > 0.99).all()
