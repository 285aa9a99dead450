import math
from itertools import combinations

import numpy as np
import pytest

from grasp_core.cones.spanning import cones_positively_span
from grasp_core.cones.tilting import tilted_cones, toward
from scenes.example_objects import example_object
from tests.judges import TETRA_NORMALS, random_rotation


def quadruples(name):
    normals = example_object(name).normals
    return normals[np.array(list(combinations(range(len(normals)), 4)))]


@pytest.mark.parametrize("friction", [0.2, 0.5, 0.8])
def test_cones_lie_inside_the_friction_cones_and_positively_span(friction):
    theta, tested = math.atan(friction), 0
    for name in ("box", "prism", "wedge", "random-10-1"):
        normals = quadruples(name)
        found = tilted_cones(normals, np.full((len(normals), 4), theta))
        for units, axes, psi in zip(normals, found.axes, found.half_angles, strict=True):
            if psi <= 1e-3:
                continue
            leaning = np.arccos(np.clip(np.einsum("ki,ki->k", axes, units), -1.0, 1.0))
            assert (leaning + psi <= theta + 1e-7).all()
            assert cones_positively_span(axes, [0.999 * psi] * 4)
            tested += 1
    assert tested >= 100


def test_the_sides_of_a_box_get_nearly_the_widest_cones_there_are():
    """Friction 0.5, tilts of 14.036 degrees: psi is 12.529 degrees by the closed form."""
    normals = np.array([[[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]])
    found = tilted_cones(normals, np.full((1, 4), math.atan(0.5)))
    assert 11.5 < math.degrees(found.half_angles[0]) <= 12.53


def test_normals_that_span_as_widely_as_any_are_kept():
    found = tilted_cones(TETRA_NORMALS[None], np.full((1, 4), math.atan(0.8)))
    assert math.degrees(found.half_angles[0]) == pytest.approx(19.4712, abs=0.01)


def test_turned_normals_get_turned_cones():
    rng = np.random.default_rng(5)
    for name in ("box", "octahedron", "wedge"):
        normals, R = quadruples(name), random_rotation(rng)
        thetas = np.full((len(normals), 4), 0.3)
        here, there = tilted_cones(normals, thetas), tilted_cones(normals @ R.T, thetas)
        np.testing.assert_allclose(there.half_angles, here.half_angles, atol=1e-6)
        np.testing.assert_allclose(there.axes, here.axes @ R.T, atol=1e-6)


def test_axes_lean_the_same_way_where_the_point_is_in_a_face_but_for_rounding():
    normals = quadruples("l-bracket")[:40]
    rng = np.random.default_rng(3)
    positions, thetas = rng.normal(size=normals.shape), np.full(normals.shape[:2], math.atan(0.5))
    ahead = rng.normal(size=(len(normals), 3))
    ahead -= np.einsum("qi,qi->q", ahead, normals[:, 0])[:, None] * normals[:, 0]
    points = positions[:, 0] + ahead
    above, below = (
        toward(points + side * 1e-9 * normals[:, 0], positions, normals, thetas)
        for side in (1.0, -1.0)
    )
    assert (above.half_angles > 0.0).sum() >= 20
    np.testing.assert_allclose(above.half_angles, below.half_angles, atol=1e-6)
    np.testing.assert_allclose(above.axes, below.axes, atol=1e-5)
