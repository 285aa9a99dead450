"""A gripper with three fingers stands at three contacts of a grasp, and MuJoCo agrees."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.hands.collisions import overlapping_pairs
from grasp_core.hands.pose_search import TIP_TOUCHING
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled
from tests.scenes.hand_files.grippers import Beside
from tests.three_fingers import THREE_TIPS, three_fingers_file

OBJECTS = ("box", "dodecahedron")
RADIUS = 0.035
CLEARANCE = 5e-4
MUJOCO_SLACK = 2e-6
"""Twice the tolerance of MuJoCo's own distances of convex bodies [m]."""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return three_fingers_file(tmp_path_factory.mktemp("hand"))


@pytest.fixture(scope="module")
def hand(file):
    return scenes.hand_from_file(file, THREE_TIPS)


@pytest.fixture(scope="module")
def reached(hand):
    tried = [(name, grasp) for name in OBJECTS for grasp in grasps(name, RADIUS)]
    found = [(name, grasp, gc.reach_with(hand, scaled(name, RADIUS), grasp, FRICTION))
             for name, grasp in tried]  # fmt: skip
    return [(scaled(name, RADIUS), grasp, each) for name, grasp, each in found if each.reached]


def test_most_grasps_are_reached_at_three_contacts_that_close(hand, reached):
    assert len(reached) >= 5
    for _, grasp, found in reached:
        assert len(found.used) == len(found.fingers) == len(found.contacts) == 3
        assert sorted(found.fingers) == [0, 1, 2]
        assert (np.diff(found.used) > 0).all()
        low, high = hand.ranges.T
        assert ((low <= found.joints) & (found.joints <= high)).all()
        planned = grasp.positions[found.used], grasp.normals[found.used]
        assert gc.force_closure(*planned, FRICTION).closed
        points = np.array([contact.position for contact in found.contacts])
        normals = np.array([contact.normal for contact in found.contacts])
        again = gc.force_closure(points, normals, FRICTION)
        assert again.closed
        assert again.verify()
        assert found.certificate.verify()
        assert gc.critical_friction(points, normals) < FRICTION
        assert normals == pytest.approx(planned[1], abs=1e-6)  # flat faces, and the same ones


def test_mujoco_has_fingertips_on_the_object_and_all_else_apart(file, hand, reached):
    seen = 0
    for body, _, found in reached:
        simulated = Beside(file, body)
        simulated.stand(hand, found, "palm")
        model, solid = simulated.model, simulated.model.geom("object").id
        tips = {model.geom(name).id for name in THREE_TIPS}
        for geom in set(range(model.ngeom)) - {solid}:
            if geom in tips:
                assert simulated.apart(geom) == pytest.approx(0.0, abs=TIP_TOUCHING + MUJOCO_SLACK)
            else:
                assert simulated.apart(geom) >= CLEARANCE - MUJOCO_SLACK
        for i, j in combinations(sorted(set(range(model.ngeom)) - {solid}), 2):
            one, other = int(model.geom_bodyid[i]), int(model.geom_bodyid[j])
            if other not in {one, model.body_parentid[one]} and model.body_parentid[other] != one:
                assert simulated.apart(i, j) >= CLEARANCE - MUJOCO_SLACK
                seen += 1
    assert seen >= 5 * len(reached) > 0


def test_where_no_three_contacts_close_each_choice_has_a_proof(hand):
    body, grasp = scaled("dodecahedron", RADIUS), grasps("dodecahedron", RADIUS)[0]
    found = gc.reach_with(hand, body, grasp, 0.05)
    assert gc.force_closure(grasp, friction=0.05).closed  # it is the fourth contact that is missed
    assert (found.reached, found.reason, found.starts) == (False, "no closure", 0)
    assert "no 3 of the grasp's 4 contacts alone are in force closure" in found.explanation
    assert len(found.open_choices) == 4
    for chosen, proof in zip(combinations(range(4), 3), found.open_choices, strict=True):
        assert proof.positions == pytest.approx(grasp.positions[list(chosen)], abs=0.0)
        assert not proof.closed
        assert proof.verify()


def test_fingers_that_meet_in_the_middle_of_their_ranges_may_not_overlap(tmp_path):
    """Closed there, all three tips are in one place; the thumb and its base are built together."""
    text = Path(three_fingers_file(tmp_path)).read_text()
    closed = tmp_path / "closed.xml"
    closed.write_text(text.replace('range="-70 70"', 'range="-140 0"'))
    hand = scenes.hand_from_file(closed, THREE_TIPS)
    owner = {link.name: finger.name for finger in hand.fingers for link in finger.links}
    middle = overlapping_pairs(hand, 0.5 * hand.ranges.sum(axis=1))
    across = [pair for pair in middle if len({owner.get(name, "palm") for name in pair}) == 2]
    met = [pair for pair in across if "palm" not in pair]
    assert met, middle
    assert not set(met) & set(hand.ignored_pairs)
