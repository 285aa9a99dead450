"""What is drawn of a grasp is where the grasp is."""

import math

import numpy as np
import pytest

from scenes.drawing.pictures import BALL_RADIUS, BAR_LENGTH, Drawing, finger_size, glass, rulings
from tests.sim_validate.rigs import grasps

FAMILIES = [
    ("wedge", 0.5, "concurrent"), ("double-wedge-bar", 0.3, "pencil"), ("wedge", 0.5, "pencil"),
    ("tetrahedron", 0.3, "regulus"), ("wedge", 0.5, "free"),
]  # fmt: skip


@pytest.fixture(scope="module", params=FAMILIES, ids=lambda case: f"{case[0]} {case[2]}")
def case(request):
    """A body, a grasp of a family, the friction, and what is drawn."""
    name, friction, family = request.param
    body, (grasp,) = grasps(name, friction, 1, (family,))
    return body, grasp, friction, Drawing(body, grasp, friction).shapes()


def of_role(shapes, role):
    return [shape for shape in shapes if shape.role == role]


def test_fingertips_touch_their_contacts_from_outside(case):
    body, grasp, _, shapes = case
    pins = of_role(shapes, "finger")
    assert [pin.finger for pin in pins] == [0, 0, 1, 1, 2, 2, 3, 3]
    for ball, bar, contact in zip(pins[::2], pins[1::2], grasp.contacts, strict=True):
        heights = (ball.vertices() - contact.position) @ -contact.normal
        # the ball has flat sides
        assert 0.0 <= heights.min() <= 0.1 * BALL_RADIUS * finger_size(body)
        heights = (bar.vertices() - contact.position) @ -contact.normal
        assert heights.max() == pytest.approx(BAR_LENGTH * finger_size(body))


def test_cones_have_the_angle_of_friction_or_less(case):
    _, grasp, friction, shapes = case
    cones, forces = of_role(shapes, "friction cone"), of_role(shapes, "force cone")
    assert len(cones) == len(forces) == 4
    for cone, force, contact in zip(cones, forces, grasp.contacts, strict=True):
        angles = []
        for points in (cone.lines[0], force.vertices()):
            arms = points - contact.position
            arms = arms[np.linalg.norm(arms, axis=1) > 0.0]
            angles.append(np.arccos(arms @ contact.normal / np.linalg.norm(arms, axis=1)))
        np.testing.assert_allclose(angles[0], math.atan(friction), rtol=1e-9)
        assert angles[1].max() <= math.atan(friction) + 1e-9


def test_lines_of_force_are_inside_the_cones_and_pass_the_foci(case):
    body, grasp, friction, shapes = case
    lines = of_role(shapes, "line of force")
    assert len(lines) == 4
    for finger, (line, contact) in enumerate(zip(lines, grasp.contacts, strict=True)):
        start, end = line.lines[0]
        np.testing.assert_array_equal(start, contact.position)
        way = (end - start) / np.linalg.norm(end - start)
        leaning = abs(float(way @ contact.normal))  # a focus may be behind the finger
        assert math.acos(min(leaning, 1.0)) <= math.atan(friction) + 1e-6
        if grasp.family != "regulus":
            focus = grasp.focus_points[finger * len(grasp.focus_points) // 4]
            assert np.linalg.norm(np.cross(focus - start, way)) < 1e-9 * body.radius


def test_planes_of_a_pencil_hold_both_contacts_and_both_foci():
    body, (grasp,) = grasps("double-wedge-bar", 0.3, 1, ("pencil",))
    (planes,) = of_role(Drawing(body, grasp, 0.3).shapes(), "plane")
    for first, plane in zip((0, 2), planes.polygons, strict=True):
        points = np.vstack([plane, grasp.focus_points, grasp.positions[first : first + 2]])
        flatness = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[2]
        assert flatness < 1e-9 * body.radius


@pytest.mark.parametrize(
    ("name", "method"), [("tetrahedron", "regulus"), ("mug", "regulus"), ("wedge", "free")]
)
def test_the_surface_of_a_regulus_holds_its_fourth_line(name, method):
    body, (grasp,) = grasps(name, 0.5, 1, (method,))
    ways = grasp.witness.directions
    segments = rulings(grasp.positions, ways, body.center_of_mass, body.radius)
    assert len(segments) >= 10
    for segment in segments:
        assert apart(segment, grasp.positions[3], ways[3]) < 1e-9 * body.radius
    other = np.cross(ways[3], ways[0])
    other /= np.linalg.norm(other)
    assert max(apart(each, grasp.positions[3], other) for each in segments) > 1e-3 * body.radius


def apart(segment, point, way):
    """Distance of a segment's line from another line, by their common normal."""
    along = segment[1] - segment[0]
    normal = np.cross(along, way)
    return abs(float((point - segment[0]) @ normal)) / np.linalg.norm(normal)


def test_the_glass_covers_the_surface(case):
    body, _, _, shapes = case
    surface, edges = glass(body)
    assert (surface.role, edges.role) == (shapes[0].role, shapes[1].role)
    area = sum(polygon_area(piece) for piece in surface.polygons)
    assert area == pytest.approx(sum(face.area for face in body.faces))


def polygon_area(corners):
    arms = corners[1:] - corners[0]
    return 0.5 * np.linalg.norm(np.cross(arms[:-1], arms[1:]).sum(axis=0))
