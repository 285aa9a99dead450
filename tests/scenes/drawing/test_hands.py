"""A hand is drawn where it stands, and its fingertips touch where the contacts are."""

import math
from dataclasses import replace

import numpy as np
import pytest

import scenes
from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from grasp_core.objects.convex_pieces import pieced_object
from scenes.drawing.hands import QUARTER_SIDES, hand_shapes, view_of_hand
from scenes.drawing.pictures import write_picture
from tests.scenes.drawing.standing import ROUNDING, held, standing


def test_fingertips_touch_their_contacts():
    """A coarse ball lies inside the true one, by 1 - cos(a / 2)^2 of its radius at most."""
    one = held()
    gaps = np.linalg.norm(one.tips - one.positions, axis=1) - one.tip_radii
    np.testing.assert_allclose(gaps, 0.0, atol=ROUNDING)
    coarse = 1.0 - math.cos(0.25 * math.pi / QUARTER_SIDES) ** 2
    shapes = [shape for shape in hand_shapes(one) if shape.role == "fingertip"]
    assert [shape.finger for shape in shapes] == [2, 3, 1, 0]  # first, middle, ring, thumb
    for shape in shapes:
        contact, radius = one.contacts[shape.finger], one.tip_radii[shape.finger]
        heights = (shape.vertices() - contact.position) @ -contact.normal
        assert -ROUNDING <= heights.min() <= coarse * radius + ROUNDING


def test_every_part_of_the_hand_is_drawn_in_its_place():
    one = held()
    at = places(one.hand, one.joints, one.palm_pose)
    palm = one.palm_pose[:3, 3], one.palm_pose[:3, :3]
    parts = [(*palm, shape) for shape in one.hand.palm]
    for link, *frame in zip(
        one.hand.links, at.link_positions[0], at.link_rotations[0], strict=True
    ):
        parts += [(*frame, shape) for shape in link.shapes]
    corners = np.vstack([shape.vertices() for shape in hand_shapes(one)])
    gaps = np.array([surface_gaps(*part, corners) for part in parts])
    assert len(parts) == 21
    assert np.abs(gaps).min(axis=0).max() < 1e-9  # each corner is on a part
    assert (gaps.min(axis=1) < 1e-9).all()


def surface_gaps(place, turn, shape, points):
    """Distances of points from the surface of a rounded box; within it as far as to its sides."""
    local = (points - place) @ turn
    local = np.abs((local - shape.position) @ shape.rotation) - shape.half_sizes
    outside = np.linalg.norm(np.maximum(local, 0.0), axis=1)
    return outside + np.minimum(local.max(axis=1), 0.0) - shape.radius


def test_a_body_without_faces_is_seen_from_where_the_same_box_is():
    box, one = standing()[0], held()
    body = pieced_object([box.vertices]).body
    assert not body.faces
    np.testing.assert_array_equal(view_of_hand(body, one).axes, view_of_hand(box, one).axes)


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
