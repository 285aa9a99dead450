import math
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.cones.spanning import (
    count_spanning,
    each_cones_positively_span,
    positively_span,
    span_angles,
)
from scenes.example_objects import example_object
from tests.grasp_core.quadruples import spanning_quadruples
from tests.grasp_core.regular_solids import SOLIDS, quadruples
from tests.judges import TETRA_NORMALS, picks_positively_span


@pytest.mark.parametrize(
    ("phi_deg", "expected_deg"),
    [(45.0, 18.434949), (60.0, 19.106605), (math.degrees(math.atan(math.sqrt(2.0))), 19.471221)],
)
def test_a_one_parameter_family_matches_its_formula(phi_deg, expected_deg):
    c, s = math.cos(math.radians(phi_deg)), math.sin(math.radians(phi_deg))
    normals = np.array([[c, s, 0], [c, -s, 0], [-c, 0, s], [-c, 0, -s]])
    assert math.degrees(gc.span_angle(normals)) == pytest.approx(expected_deg, abs=1e-6)
    formula = s * c / math.sqrt(s * s + 4 * c * c)
    assert math.sin(gc.span_angle(normals)) == pytest.approx(formula, abs=1e-12)
    corner = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], -np.ones(3) / math.sqrt(3.0)])
    assert 1.0 / math.sin(gc.span_angle(corner)) ** 2 == pytest.approx(9.0 + 4.0 * math.sqrt(3.0))


@pytest.mark.parametrize(
    "name", ["random-14-1", "chamfered-box", "dodecahedron", "prism", "random-40-1"]
)
def test_the_enumeration_lists_exactly_the_quadruples_that_span(name):
    normals, least = example_object(name).normals, math.radians(0.5)
    every = np.array(list(combinations(range(len(normals)), 4)))
    angles = span_angles(normals[every])
    found = spanning_quadruples(normals, least)
    np.testing.assert_array_equal(found, every[angles > least])
    assert count_spanning(normals, least) == len(found)
    assert bool(len(found)) == (name != "prism")


def test_the_span_angle_agrees_with_definition_3_on_ten_thousand_face_quadruples():
    """Pyramids inscribed just below the angle span; those around it just above do not.

    For pyramids Definition 3 is decided exactly by their edges. The second ones contain
    the circular cones of 1.001 theta*, because tan grows by 1 / cos(pi / sides).
    """
    sides, tested = 8, 0
    for seed in range(1, 6):
        normals = example_object(f"random-30-{seed}").normals
        found = spanning_quadruples(normals, math.radians(0.5))
        for start in range(0, len(found), 500):
            rows = found[start : start + 500]
            axes, angles = normals[rows], span_angles(normals[rows])
            assert picks_positively_span(axes, 0.999 * angles, sides).all()
            around = np.arctan(np.tan(1.001 * angles) / math.cos(math.pi / sides))
            assert not picks_positively_span(axes, around, sides).any()
            tested += len(rows)
    assert tested >= 10_000


def test_cones_of_unequal_angles_generalise_the_span_angle():
    largest = math.asin(1 / 3)
    angles = [0.99 * largest] * 4
    assert gc.cones_positively_span(TETRA_NORMALS, angles)
    assert not gc.cones_positively_span(TETRA_NORMALS, [*angles[:3], 1.5 * largest])
    assert gc.cones_positively_span(TETRA_NORMALS, [*np.zeros(3), 1.5 * largest])
    assert not gc.cones_positively_span(TETRA_NORMALS[[0, 0, 1, 2]], np.zeros(4))


MANY = 2000


def vector_sets(rng):
    """Random unit vectors, and some in planes, doubled, or opposite to each other."""
    vectors = rng.normal(size=(MANY, 4, 3))
    vectors[::10, :, 2] = 0.0
    vectors[1::10, 1] = vectors[1::10, 0]
    vectors[2::10, 1] = -vectors[2::10, 0]
    vectors[3::10, 3] = -vectors[3::10, :3].sum(axis=1)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_cones_of_equal_width_span_below_the_span_angle():
    rng = np.random.default_rng(2)
    units = vector_sets(rng)
    units = units[positively_span(units)]
    shares = rng.choice([0.5, 0.999999, 1.000001, 1.5], size=len(units))
    angles = (span_angles(units) * shares)[:, None] * np.ones(4)
    assert (each_cones_positively_span(units, angles) == (shares < 1.0)).all()
    flat = vector_sets(rng)[::10]
    assert not each_cones_positively_span(flat, np.full((len(flat), 4), 0.01)).any()


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
    found = spanning_quadruples(SOLIDS[name], math.radians(0.1))
    listed = np.degrees(span_angles(np.asarray(SOLIDS[name])[found]))
    assert Counter(listed.round(4).tolist()) == {a: n for a, n in expected.items() if a > 0.0}
