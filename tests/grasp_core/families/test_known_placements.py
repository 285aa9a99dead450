"""Faces whose grasps are known in closed form, or to all digits."""

import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.families.placing import CELL_A, CONSTRUCTIONS
from grasp_core.objects.booleans import hull
from grasp_core.objects.face_pieces import unit_pieces
from grasp_core.values import ForceCone
from tests.grasp_core.families.disc_borders import on_borders
from tests.grasp_core.quadruples import tilted_side_cones
from tests.grasp_core.regular_solids import TOLERANCE, all_signs


def bar(length):
    """A double-wedge bar with ends at +-(length + 1), and the four pieces of its ends."""
    tips = [[-length - 1.0, 0, s] for s in (-1, 1)] + [[length + 1.0, s, 0] for s in (-1, 1)]
    solid = hull(np.vstack([tips, all_signs(3) * (length, 1.0, 1.0)]))
    body = gc.Polyhedron.from_mesh(solid.vertices, solid.triangles)
    ends = [p for s in (-1, 1) for p in unit_pieces(body) if s * p.normal[0] < -0.5]
    return body, ends


def half_angle_cones(pieces, theta_deg):
    return [ForceCone(piece.normal, math.radians(theta_deg)) for piece in pieces]


@pytest.mark.parametrize("theta_deg", [5.0, 10.0, 15.0])
@pytest.mark.parametrize("length", [1.0, 3.0, 7.0])
def test_pencils_on_the_ends_of_a_bar_do_not_depend_on_its_length(theta_deg, length):
    """r = sqrt(2) t / (1 + t), t = tan(theta / 2), from length (1 - t) / (1 + t) on."""
    body, ends = bar(length)
    t = math.tan(math.radians(theta_deg) / 2.0)
    assert length > (1.0 - t) / (1.0 + t)
    cones = half_angle_cones(ends, theta_deg)
    construction = replace(CONSTRUCTIONS["pencil"], patterns=CELL_A[None])
    placed = construction.place(ends, cones, LEAST_RADIUS)
    assert placed is not None
    expected = math.sqrt(2.0) * t / (1.0 + t)
    assert body.radius * placed.merit == pytest.approx(expected, abs=body.radius * TOLERANCE)


def test_a_focus_serves_both_ends_of_a_bar_only_up_to_a_known_length():
    """2 / (1 - q) - 1, where q is tan(10 deg) for cones; pyramids of sixteen sides stand between
    cones and cos(pi / 16) of them: 1.4182 to 1.4281.
    """
    q = math.tan(math.radians(10.0))
    longest = [2.0 / (1.0 - share * q) - 1.0 for share in (math.cos(math.pi / 16.0), 1.0)]
    assert longest == pytest.approx([1.4182, 1.4281], abs=5e-5)
    for length, held in ((longest[0] - 1e-3, True), (longest[1] + 1e-3, False)):
        _, ends = bar(length)
        cones = half_angle_cones(ends, 10.0)
        assert bool(CONSTRUCTIONS["concurrent"].place(ends, cones, 0.0)) is held


@pytest.mark.parametrize(
    ("friction", "tilt_deg", "half_angle_deg", "radius"),
    [
        (0.5, 14.036, 12.529, 0.2284),
        (0.3, 8.531, 8.168, 0.1445),
        (0.8, 21.801, 16.858, 0.3273),
        (1.0, 26.565, 18.435, 0.3765),
    ],
)
def test_tilted_cones_hold_a_cube_by_its_four_sides(friction, tilt_deg, half_angle_deg, radius):
    """The best tilt leaves the half-angle theta - tilt at which the axes just span. The radii are
    of pyramids of 32 sides, which reach 0.5 % less than cones and 1.5 % farther than those of 16.
    """
    solid = hull(all_signs(3))
    body = gc.Polyhedron.from_mesh(solid.vertices, solid.triangles)
    sides = [piece for piece in unit_pieces(body) if abs(piece.normal[2]) < 0.5]
    cones = tilted_side_cones(sides, math.radians(tilt_deg), math.radians(half_angle_deg))
    spans = math.degrees(gc.span_angle([cone.axis for cone in cones]))
    assert spans == pytest.approx(half_angle_deg, abs=1e-3)
    assert math.degrees(math.atan(friction)) - tilt_deg == pytest.approx(spans, abs=1e-3)
    placed = CONSTRUCTIONS["concurrent"].place(sides, cones, 1e-4)
    assert placed is not None
    assert 0.983 * radius < body.radius * placed.merit < 1.005 * radius
    rng = np.random.default_rng(4)
    for turns in rng.uniform(0, 2 * np.pi, (10, 4)):
        points = on_borders(sides, placed.positions, placed.radii, turns)
        assert gc.force_closure(points, [p.normal for p in sides], friction + 1e-5).closed
