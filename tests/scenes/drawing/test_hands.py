"""A hand is drawn where it stands, and its fingertips touch where the contacts are."""

import math
from dataclasses import replace

import numpy as np
import pytest

import scenes
from grasp_core.errors import InputError
from grasp_core.values import Contact
from scenes.drawing.hands import (
    STEPS,
    PosedHand,
    extent_with,
    hand_shapes,
    numbers_behind,
    parts_of,
    view_of_hand,
)
from scenes.drawing.pictures import Drawing, write_picture
from scenes.drawing.sheets import Dots, Words
from tests.grasp_core.hands.gripping import plain_hand
from tests.scenes.drawing.standing import FRICTION, ROUNDING, held, standing
from tests.scenes.drawing.whole import assert_whole


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


def three():
    """A hand of four fingers of which three touch."""
    hand = plain_hand()
    pose = PosedHand(hand, np.zeros(8), np.eye(4), (), ())
    used = (3, 0, 1)
    tips = replace(pose, fingers=used, contacts=tuple(
        Contact([0.0, 0.0, float(n)], [0.0, 0.0, 1.0]) for n in range(3)
    )).tips  # fmt: skip
    contacts = tuple(Contact(tip + np.array([0.008, 0.0, 0.0]), [1.0, 0.0, 0.0]) for tip in tips)
    return PosedHand(hand, np.zeros(8), np.eye(4), used, contacts)


def test_fingers_that_do_not_touch_look_like_links():
    one = three()
    shapes = hand_shapes(one)
    assert sorted(shape.finger for shape in tips_of(shapes)) == [0, 1, 2]
    (idle,) = [n for n in range(4) if n not in one.fingers]
    balls = [shape for shape in shapes if shape.role == "hand" and len(shape.polygons) > 50]
    (ball,) = balls
    middle = [0.0, 0.04 * idle, 0.07]
    distances = np.linalg.norm(ball.vertices() - middle, axis=1)
    np.testing.assert_allclose(distances, 0.008, atol=1e-12)
    assert numbers_behind(one).shape == (3, 3)


def test_the_extent_holds_object_and_hand():
    body, one = standing()[0], held()
    extent = extent_with(body, parts_of(one))
    points = np.vstack([corners_of(hand_shapes(one)), body.vertices])
    far = np.linalg.norm(points - extent.center_of_mass, axis=1)
    assert 0.9 * extent.radius < far.max() <= (1.0 + 1e-9) * extent.radius
    assert extent.radius > 2.0 * body.radius


def test_the_view_shows_every_contact_of_this_grasp():
    """No point between the camera and a contact is deep in a part: in nine tenths of a box in it.

    Such a box reaches radius / sqrt(3) beyond the box that is rounded.
    """
    body, one = standing()[0], held()
    view, parts = view_of_hand(body, one), parts_of(one)
    sizes = parts.half_sizes + parts.radii[:, None] / math.sqrt(3.0)
    for contact in one.contacts:
        way = np.linspace(0.0, 1.0, 4000)[:, None] * (view.camera - contact.position)
        for middle, axes, half in zip(parts.middles, parts.axes, sizes, strict=True):
            local = np.abs((contact.position + way - middle) @ axes)
            assert ((local - 0.9 * half).max(axis=1) >= -1e-9).all()


def test_the_picture_is_whole_and_holds_the_hand():
    body, grasp, _, _ = standing()
    sheet = Drawing(body, grasp, FRICTION, held()).sheet(legend=True)
    assert_whole(sheet)
    points = np.vstack([
        loop for mark in sheet.marks if not isinstance(mark, Words | Dots)
        for loop in getattr(mark, "loops", ()) or getattr(mark, "lines", ())
    ])  # fmt: skip
    assert points.min() >= 0.0
    assert points.max() <= sheet.height
    assert np.ptp(points[:, 0]) > 0.6 * sheet.width
    said = {words.text for words in sheet.words()}
    assert {"hand", "friction cone", "0", "1", "2", "3"} <= said
    assert "finger" not in said
    assert sheet.name == "Grasp c-0-1-4-5 of small box with the hand allegro"


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
