"""A hand is drawn where it stands, and its fingertips touch where the contacts are."""

import math
from dataclasses import replace

import numpy as np
import pytest

import scenes
from grasp_core.errors import InputError
from scenes.drawing.hands import (
    STEPS,
    hand_shapes,
)
from scenes.drawing.pictures import write_picture
from tests.scenes.drawing.standing import ROUNDING, held, standing


def tips_of(shapes):
    return [shape for shape in shapes if shape.role == "fingertip"]


def test_fingertips_touch_their_contacts():
    """A coarse ball lies inside the true one, by 1 - cos(a / 2)^2 of its radius at most."""
    one = held()
    gaps = np.linalg.norm(one.tips - one.positions, axis=1) - one.tip_radii
    np.testing.assert_allclose(gaps, 0.0, atol=ROUNDING)
    coarse = 1.0 - math.cos(0.25 * math.pi / STEPS) ** 2
    shapes = tips_of(hand_shapes(one))
    assert [shape.finger for shape in shapes] == [2, 3, 1, 0]  # first, middle, ring, thumb
    for shape in shapes:
        contact, radius = one.contacts[shape.finger], one.tip_radii[shape.finger]
        heights = (shape.vertices() - contact.position) @ -contact.normal
        assert -ROUNDING <= heights.min() <= coarse * radius + ROUNDING


def test_every_part_of_the_hand_is_drawn_in_its_place():
    """Corners are on the surfaces of the boxes, placed by plain kinematics along each chain."""
    one = held()
    frames = [one.palm_pose]
    places = [(one.palm_pose, shape) for shape in one.hand.palm]
    angles = iter(one.joints.tolist())
    for finger in one.hand.fingers:
        frame = frames[0]
        for link in finger.links:
            frame = frame @ turned(link.joint, next(angles))
            places += [(frame, shape) for shape in link.shapes]
    gaps = np.array([surface_gaps(frame, shape, corners_of(hand_shapes(one)))
                     for frame, shape in places])  # fmt: skip
    assert len(places) == 21
    assert np.abs(gaps).min(axis=0).max() < 1e-9  # each corner is on a part
    assert (gaps.min(axis=1) < 1e-9).all()


def turned(joint, angle):
    x, y, z = joint.axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    pose = np.eye(4)
    turn = np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K
    pose[:3, :3], pose[:3, 3] = joint.rotation @ turn, joint.position
    return pose


def corners_of(shapes):
    return np.vstack([shape.vertices() for shape in shapes])


def surface_gaps(frame, shape, points):
    """Distances of points from the surface of a rounded box; within it as far as to its sides."""
    local = (points - frame[:3, 3]) @ frame[:3, :3]
    local = np.abs((local - shape.position) @ shape.rotation) - shape.half_sizes
    outside = np.linalg.norm(np.maximum(local, 0.0), axis=1)
    return outside + np.minimum(local.max(axis=1), 0.0) - shape.radius


def test_users_give_a_hand_and_what_was_found(tmp_path):
    body, grasp, hand, reach = standing()
    path = write_picture(body, grasp, tmp_path / "a.svg", hand=hand, reach=reach)
    assert "with the hand allegro" in path.read_text()
    assert '"role":"hand"' in scenes.show(body, grasp, hand=hand, reach=reach).page
    assert '"role":"hand"' not in scenes.show(body, grasp).page


def test_a_result_about_something_else_is_refused():
    body, grasp, hand, reach = standing()
    for change in ({"hand": "leap"}, {"grasp": "c-0-1-2-4"}, {"joints": None}):
        with pytest.raises(InputError):
            scenes.show(body, grasp, hand=hand, reach=replace(reach, **change))
