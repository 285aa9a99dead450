"""Links without a mass, or with moments that no body has, are read."""

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from sim_validate.closure.validate import Agenda
from sim_validate.hands.validate import validate_hand
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled
from tests.scenes.hand_files.grippers import CAPSULE, gripper, loaded, written
from tests.scenes.hand_files.test_published_kinds import BALL_KG, TIPS, robot

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
