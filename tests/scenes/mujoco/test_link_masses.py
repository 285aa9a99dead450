"""Masses and inertias of links follow from their shapes where no source states them."""

import numpy as np
import pytest

from grasp_core.hands.hand import PALM_NAME, Fingertip, Hand, HandFinger, Joint, Link, LinkShape
from scenes.mujoco.chains import hand_inertials

BOX = LinkShape([0.01, 0.0, 0.02], np.eye(3), [0.01, 0.02, 0.03], 0.0)
CAPSULE = LinkShape(np.zeros(3), np.eye(3), [0.0, 0.0, 0.02], 0.005)


def hand(*shapes, **known):
    """Three fingers of one link with some shapes."""
    return Hand("made", (BOX,), tuple(
        HandFinger(
            name, (Link(name, Joint(name, np.zeros(3), np.eye(3), [0.0, 0.0, 1.0], -1.0, 1.0),
                        shapes, **known),), Fingertip(np.zeros(3), 0.01))
        for name in ("a", "b", "c")
    ))  # fmt: skip


def test_a_box_has_the_mass_and_inertia_of_water():
    found = hand_inertials(hand(CAPSULE))[PALM_NAME]
    sides = 2.0 * BOX.half_sizes
    mass = 1000.0 * sides.prod()
    squares = sides**2 / 12.0
    assert found["mass"] == pytest.approx(mass)
    assert found["pos"] == pytest.approx(BOX.position)
    expected = mass * (squares.sum() - squares)
    assert found["fullinertia"] == pytest.approx([*expected, 0.0, 0.0, 0.0], abs=1e-12)


def test_a_known_mass_is_shared_by_volume_and_its_centre_is_kept():
    other = LinkShape([0.01, 0.0, 0.1], np.eye(3), [0.01, 0.02, 0.03], 0.0)
    shared = hand_inertials(hand(BOX, other, mass_kg=0.2))["a"]
    assert shared["mass"] == 0.2
    assert shared["pos"] == pytest.approx([0.01, 0.0, 0.06])
    moved = hand_inertials(hand(BOX, mass_kg=0.2, center_of_mass=[0.0, 0.0, 0.05]))["a"]
    assert moved["pos"] == pytest.approx([0.0, 0.0, 0.05])


def test_a_shape_without_a_mass_has_that_of_water_and_a_frame_next_to_none():
    light = {"mass_kg": 0.0, "center_of_mass": [0.0, 0.0, 0.0]}
    box, alike = (hand_inertials(each)["a"] for each in (hand(BOX, **light), hand(BOX)))
    assert all(np.array_equal(box[name], alike[name]) for name in ("mass", "pos", "fullinertia"))
    assert 0.0 < hand_inertials(hand(**light))["a"]["mass"] < 1e-5
