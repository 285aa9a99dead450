"""Hands of files are drawn with every shape in its place, and contacts over all."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import grasp_core as gc
import scenes
from grasp_core.geometry.polygons import convex_hull, signed_area
from grasp_core.objects.convex_pieces import pieced_object
from grasp_core.values import Contact
from scenes.drawing.filed_hands import (
    NORMAL_LENGTH,
    filed_hand_shapes,
    filed_hand_sheet,
    parts_of_shapes,
)
from scenes.drawing.hands import QUARTER_SIDES, view_of_parts
from scenes.drawing.painting import Camera, Window, painted
from scenes.drawing.pictures import finger_size
from scenes.drawing.sheets import BAD_HEX, INK_HEX, Area, Dots, Line
from scenes.mujoco.hand_contacts import LinkContact
from scenes.mujoco.placed_shapes import PlacedShape

SIZES = {
    "box": (0.02, 0.01, 0.03), "sphere": (0.015, 0.0, 0.0), "capsule": (0.008, 0.03, 0.0),
    "cylinder": (0.012, 0.03, 0.0), "ellipsoid": (0.02, 0.01, 0.03), "mesh": (0.0, 0.0, 0.0),
}  # fmt: skip
MESH = np.array([(0, 0, 0), (0.06, 0, 0), (0, 0.03, 0), (0, 0, 0.03)], dtype=float)
COARSE = math.cos(0.25 * math.pi / QUARTER_SIDES) ** 2
"""What a coarse ball reaches at least in any direction, over its radius."""
INK_PAIR = (INK_HEX, BAD_HEX)

NO_LEVER = np.zeros((0, 3))


@pytest.fixture(scope="module")
def body():
    box = scenes.example_object("box")
    return gc.Polyhedron.from_mesh(0.5 * box.vertices, box.triangles, name="small box")


def shape(kind, place=(0.0, 0.0, 0.0), link="hand/a"):
    turn = Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_matrix()
    corners = MESH if kind == "mesh" else np.empty((0, 3))
    return PlacedShape(link, kind, np.array(SIZES[kind]), np.array(place), turn, corners)


def farthest(one, ways):
    """How far a shape reaches along unit directions, (n,): its support function, by definition."""
    size, local = one.size, ways @ one.rotation
    round_part = np.hypot(local[:, 0], local[:, 1])
    reach = {
        "box": np.abs(local) @ size,
        "sphere": np.full(len(ways), size[0]),
        "capsule": size[0] + size[1] * np.abs(local[:, 2]),
        "cylinder": size[0] * round_part + size[1] * np.abs(local[:, 2]),
        "ellipsoid": np.linalg.norm(local * size, axis=1),
        "mesh": (local @ MESH.T).max(axis=1),
    }[one.kind]
    return reach + ways @ one.position


@pytest.mark.parametrize("kind", SIZES)
def test_every_kind_of_shape_is_drawn_as_it_is(kind, body):
    one = shape(kind, (0.1, -0.2, 0.05))
    drawn = filed_hand_shapes(parts_of_shapes([one], ["hand/a"]), body)
    corners = np.vstack([each.vertices() for each in drawn])
    ways = Rotation.random(300, random_state=1).as_matrix()[:, 0]
    middle = ways @ one.position
    right, found = farthest(one, ways) - middle, (corners @ ways.T).max(axis=0) - middle
    assert (found <= right + 1e-12).all()
    assert (found >= COARSE * right - 1e-12).all()
    if kind in {"box", "mesh"}:
        np.testing.assert_allclose(found, right, atol=1e-12)
    assert {each.role for each in drawn} == {"link in contact"}


def test_a_capsule_covers_its_outline_in_the_picture(body):
    one = shape("capsule")
    drawn = filed_hand_shapes(parts_of_shapes([one], []), body)
    view = Camera.of_angles(40.0, 20.0, body)
    window = Window.around(drawn, np.empty((0, 3)), body, view, 400)
    areas = [mark for mark in painted(drawn, window) if isinstance(mark, Area)]
    seen = convex_hull(np.vstack([loop for area in areas for loop in area.loops]))
    ball = one.size[0] * Rotation.random(4000, random_state=2).as_matrix()[:, 0]
    ends = [one.position + side * one.size[1] * one.rotation[:, 2] for side in (-1.0, 1.0)]
    true = convex_hull(window.seen(np.vstack([end + ball for end in ends]))[0])
    assert abs(signed_area(seen)) == pytest.approx(abs(signed_area(true)), rel=0.06)
    np.testing.assert_allclose(seen.min(axis=0), true.min(axis=0), atol=4.0)
    np.testing.assert_allclose(seen.max(axis=0), true.max(axis=0), atol=4.0)
    assert np.ptp(true, axis=0).max() > 300.0  # so that four pixels are little


def fingers():
    places = {"hand/a": (0.05, 0.0, 0.0), "hand/b": (-0.05, 0.0, 0.0), "hand/c": (0.0, 0.0, 0.09)}
    return [shape("capsule", place, link) for link, place in places.items()]


def touching():
    """Contacts on two opposite sides of the box; the second is too deep."""
    found = []
    for link, place, apart in (
        ("hand/a", (0.025, 0.004, 0.0), 1e-3),
        ("hand/b", (-0.025, 0.0, 0.006), -1.1e-3),
        ("hand/b", (-0.025, -0.006, -0.004), -0.9e-3),
    ):
        normal = np.array([-np.sign(place[0]), 0.0, 0.0])
        found.append(LinkContact(link, Contact(np.array(place), normal), apart, NO_LEVER))
    return found


def dots_of(sheet):
    """The dots of contacts, by their colour, without their rims."""
    return {mark.colour: mark.points for mark in sheet.marks
            if isinstance(mark, Dots) and mark.colour in INK_PAIR}  # fmt: skip


def test_contacts_and_normals_are_drawn_over_all_in_their_places(body):
    sheet = filed_hand_sheet(fingers(), touching(), body, "a hand")
    found = dots_of(sheet)
    assert {colour: len(points) for colour, points in found.items()} == {INK_HEX: 2, BAD_HEX: 1}
    points = np.array([each.contact.position for each in touching()])
    normals = np.array([each.contact.normal for each in touching()])
    ends = points + NORMAL_LENGTH * finger_size(body) * normals
    parts = parts_of_shapes(fingers(), [each.link for each in touching()])
    view = view_of_parts(body, parts, points, ends)
    drawn = np.array([found[INK_HEX][0], found[BAD_HEX][0], found[INK_HEX][1]])
    flat = view.seen(points)[0] * (1.0, -1.0)  # pixels count downwards

    def gaps(places):
        return np.linalg.norm(places[:, None] - places, axis=2)

    scale = gaps(drawn)[0, 1] / gaps(flat)[0, 1]
    np.testing.assert_allclose(drawn - drawn[0], scale * (flat - flat[0]), atol=1e-6)
    last = [mark for mark in sheet.marks[-6:] if isinstance(mark, Line)]  # all after the hand
    lines = [line for mark in last for line in mark.lines]
    assert len(lines) == 6
    for line in lines:  # from a contact, along its normal
        assert np.linalg.norm(drawn - line[0], axis=1).min() < 1e-9
    ways = view.seen(ends)[0] * (1.0, -1.0) - flat
    own = next(line for line in lines if np.allclose(line[0], drawn[1]))
    assert (own[1] - own[0]) @ ways[1] > 0.99 * math.dist(*own) * np.linalg.norm(ways[1])


def test_links_in_contact_have_another_colour(body):
    drawn = filed_hand_shapes(parts_of_shapes(fingers(), ["hand/b"]), body)
    middles = {each.role: [] for each in drawn}
    for each in drawn:
        middles[each.role].append(each.vertices().mean(axis=0))
    assert np.max(middles["link in contact"], axis=0)[0] < 0.0  # b alone
    assert np.max(middles["hand"], axis=0)[0] > 0.0


def test_nothing_is_cut_off_and_no_contacts_are_needed(body):
    pieced = pieced_object([body.vertices, body.vertices + np.array([0.05, 0.0, 0.0])]).body
    assert not pieced.faces
    sheet = filed_hand_sheet(fingers(), [], pieced, "a hand")
    loops = [loop for mark in sheet.marks if isinstance(mark, Area) for loop in mark.loops]
    corners = np.vstack(loops)
    assert corners.min() >= 0.0
    assert (corners <= (sheet.width, sheet.height)).all()
    assert sheet.width == 440
    assert np.ptp(corners[:, 1]) > sheet.height - 30.0  # no empty border is left
    assert not dots_of(sheet)
