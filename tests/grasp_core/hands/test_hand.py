"""Hands as values: what they refuse, and what the built-in ones state."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.hands.hand import Fingertip, Hand, Joint, LinkShape
from tests.grasp_core.hands.gripping import plain_hand

HANDS = ["allegro", "leap"]


@pytest.mark.parametrize("name", HANDS)
def test_a_built_in_hand_states_sources_and_sixteen_joints(name):
    hand = gc.load_hand(name)
    assert hand == gc.load_hand(name)
    assert len(hand.fingers) == 4
    assert len(hand.joints) == 16
    assert hand.sources
    assert all("BSD" in line or "MIT" in line for line in hand.sources)
    assert (hand.ranges[:, 0] < hand.ranges[:, 1]).all()


def test_torque_limits_are_stated_only_where_a_source_has_them():
    assert {joint.torque_limit_n_m for joint in gc.load_hand("allegro").joints} == {None}
    assert {joint.torque_limit_n_m for joint in gc.load_hand("leap").joints} == {0.2196}


def test_torque_limits_can_be_given_with_their_source():
    hand = gc.load_hand("allegro").with_torque_limits(np.linspace(0.1, 0.7, 16), "my bench")
    assert hand.torque_source == "my bench"
    assert [j.torque_limit_n_m for j in hand.joints] == pytest.approx(np.linspace(0.1, 0.7, 16))
    assert hand.ranges == pytest.approx(gc.load_hand("allegro").ranges)
    with pytest.raises(InputError, match="torque_limit_n_m"):
        hand.with_torque_limits(-1.0, "nonsense")


def test_an_unknown_hand_names_the_known_ones():
    with pytest.raises(InputError, match="allegro or leap"):
        gc.load_hand("shadow")


def test_values_refuse_what_makes_no_hand():
    with pytest.raises(InputError, match="rotation matrix"):
        LinkShape(np.zeros(3), np.diag([1.0, 1.0, -1.0]), np.ones(3), 0.0)
    with pytest.raises(InputError, match="half_sizes"):
        LinkShape(np.zeros(3), np.eye(3), np.zeros(3), 0.0)
    with pytest.raises(InputError, match="highest"):
        Joint("j", np.zeros(3), np.eye(3), [0.0, 0.0, 1.0], 1.0, 0.5)
    with pytest.raises(InputError, match="length 1"):
        Joint("j", np.zeros(3), np.eye(3), [0.0, 0.0, 2.0], 0.0, 0.5)
    with pytest.raises(InputError, match="radius"):
        Fingertip(np.zeros(3), 0.0)
    hand = plain_hand()
    with pytest.raises(InputError, match="3 to 5"):
        Hand("two", hand.palm, hand.fingers[:2])
    with pytest.raises(InputError, match="must differ"):
        Hand("same", hand.palm, (hand.fingers[0], *hand.fingers[:2]))
    with pytest.raises(InputError, match="names of links"):
        replace(hand, ignored_pairs=(("palm", "tail"),))
