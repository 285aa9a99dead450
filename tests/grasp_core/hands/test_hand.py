"""Hands as values: what they refuse, and what the built-in ones state."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.files.records import from_record, record_of
from grasp_core.hands.hand import Fingertip, Hand, Joint, LinkShape
from tests.grasp_core.hands.gripping import plain_hand


@pytest.mark.parametrize(("name", "torque_n_m"), [("allegro", None), ("leap", 0.2196)])
def test_a_built_in_hand_has_sixteen_joints_with_limits_where_a_source_has_them(name, torque_n_m):
    hand = gc.load_hand(name)
    assert hand == gc.load_hand(name)
    assert (len(hand.fingers), len(hand.joints)) == (4, 16)
    assert (hand.ranges[:, 0] < hand.ranges[:, 1]).all()
    assert {joint.torque_limit_n_m for joint in hand.joints} == {torque_n_m}


def test_torque_limits_can_be_given_with_their_source():
    hand = gc.load_hand("allegro").with_torque_limits(np.linspace(0.1, 0.7, 16), "my bench")
    assert hand.torque_source == "my bench"
    assert [j.torque_limit_n_m for j in hand.joints] == pytest.approx(np.linspace(0.1, 0.7, 16))
    assert hand.ranges == pytest.approx(gc.load_hand("allegro").ranges)


def test_allegro_ends_where_the_source_that_is_chosen_has_it():
    """Menagerie's capsules end 2.3 mm beyond the URDF's balls, the thumb's 0.7 mm."""
    ours, urdf = gc.load_hand("allegro"), gc.load_hand("allegro-urdf")
    for one, other in zip(ours.fingers, urdf.fingers, strict=True):
        shorter = one.tip.center - other.tip.center
        assert shorter == pytest.approx([0.0, 0.0, 0.0007 if one.name == "thumb" else 0.0023])
        capsule = other.links[-1].shapes[-1]
        end = capsule.position + capsule.half_sizes
        assert end == pytest.approx(other.tip.center, abs=1e-9)
    assert [joint.name for joint in urdf.joints] == [joint.name for joint in ours.joints]


def test_a_fingertip_that_is_a_block_is_covered_by_the_last_shape():
    hand = plain_hand()
    first, corners = hand.fingers[0], 0.005 * np.vstack([np.eye(3), -np.eye(3)])
    tip = Fingertip(np.zeros(3), 0.006, corners + np.array([0.0, 0.0, 0.02]), 1e-4)
    assert replace(first, tip=tip).tip.core[1] == 1e-4
    with pytest.raises(InputError, match="last shape of the last link of finger f0 must cover"):
        replace(first, tip=replace(tip, corners=corners))
    with pytest.raises(InputError, match=r"corners .*at least 2"):
        replace(tip, corners=corners[:1])
    with pytest.raises(InputError, match="rounding"):
        replace(tip, rounding=0.0)
    with pytest.raises(InputError, match="rounding"):
        Fingertip(np.zeros(3), 0.006, rounding=1e-4)


def test_a_hand_with_blocks_is_kept_in_files():
    hand = gc.load_hand("leap")
    assert from_record(Hand, record_of(hand)) == hand


ZERO, UNIT, PLAIN = np.zeros(3), np.eye(3), plain_hand()
NO_HANDS = [
    (lambda: LinkShape(ZERO, np.diag([1.0, 1.0, -1.0]), np.ones(3), 0.0), "rotation matrix"),
    (lambda: LinkShape(ZERO, UNIT, ZERO, 0.0), "half_sizes"),
    (lambda: Joint("j", ZERO, UNIT, [0.0, 0.0, 1.0], 1.0, 0.5), "highest"),
    (lambda: Joint("j", ZERO, UNIT, [0.0, 0.0, 2.0], 0.0, 0.5), "length 1"),
    (lambda: Fingertip(ZERO, 0.0), "radius"),
    (lambda: Hand("two", PLAIN.palm, PLAIN.fingers[:2]), "3 to 5"),
    (lambda: Hand("same", PLAIN.palm, PLAIN.fingers[:1] * 3), "must differ"),
    (lambda: replace(PLAIN, ignored_pairs=(("palm", "tail"),)), "names of links"),
]


@pytest.mark.parametrize(("made", "said"), NO_HANDS)
def test_values_refuse_what_makes_no_hand(made, said):
    with pytest.raises(InputError, match=said):
        made()
