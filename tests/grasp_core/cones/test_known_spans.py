"""Normals whose span angle is known in closed form."""

import math
from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.regular_solids import SOLIDS, quadruples, units
from tests.judges import TETRA_NORMALS


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("tetrahedron", {19.4712: 1}),
        ("cube", {0.0: 15}),
        ("octahedron", {19.4712: 2, 0.0: 68}),
        ("dodecahedron", {10.8123: 30, 0.0: 465}),
        ("icosahedron", {19.4712: 10, 10.8123: 80, 5.4547: 330, 0.0: 4425}),
    ],
)
def test_span_angles_of_all_quadruples_of_a_regular_solid(name, expected):
    angles = [math.degrees(gc.span_angle(normals)) for normals in quadruples(SOLIDS[name])]
    assert Counter(round(angle, 4) for angle in angles) == expected


def test_the_dodecahedron_spans_at_ten_degrees_but_not_at_eleven():
    angles = np.array([gc.span_angle(normals) for normals in quadruples(SOLIDS["dodecahedron"])])
    assert (angles > math.radians(10.0)).sum() == 30
    assert not (angles > math.radians(11.0)).any()
    assert math.tan(angles.max()) == pytest.approx((3.0 - math.sqrt(5.0)) / 4.0, abs=1e-12)


def test_the_one_parameter_family_contains_the_regular_tetrahedron():
    phi = math.atan(math.sqrt(2.0))
    c, s = math.cos(phi), math.sin(phi)
    normals = [[c, s, 0], [c, -s, 0], [-c, 0, s], [-c, 0, -s]]
    assert gc.span_angle(normals) == pytest.approx(math.asin(1.0 / 3.0), abs=1e-12)


@pytest.mark.parametrize("slope", [0.1, 0.5, 1.0, 3.0, 20.0])
def test_square_pyramids_never_span(slope):
    """Two opposite sides and the base have normals in one plane."""
    sides = [[1, 0, -slope], [-1, 0, -slope], [0, 1, -slope], [0, -1, -slope]]
    normals = units([*sides, [0, 0, 1]])
    assert [gc.span_angle(chosen) for chosen in quadruples(normals)] == [0.0] * 5


@pytest.mark.parametrize("sides", [3, 4, 5, 6, 7, 8])
def test_right_prisms_never_span(sides):
    """A spanning quadruple needs both ends, and the other two are in a plane with them."""
    turns = 2.0 * np.pi * np.arange(sides) / sides
    around = np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])
    angles = [gc.span_angle(q) for q in quadruples(np.vstack([around, [[0, 0, 1], [0, 0, -1]]]))]
    assert not any(angles)
    assert len(angles) == math.comb(sides + 2, 4)


def test_no_four_directions_span_at_more_than_those_of_the_regular_tetrahedron():
    rng, spanning, widest = np.random.default_rng(0), 0, 0.0
    for _ in range(3000):
        normals = units(rng.normal(size=(4, 3)))
        near = units(TETRA_NORMALS + 0.05 * rng.normal(size=(4, 3)))
        for angle in (gc.span_angle(normals), gc.span_angle(near)):
            assert angle <= math.asin(1.0 / 3.0) + 1e-12
            spanning += angle > 0.0
            widest = max(widest, angle)
    assert spanning >= 3300
    assert widest > math.radians(19.0)
