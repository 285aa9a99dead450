import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import grasp_core as gc
from grasp_core.closure.contacts import contact_frames
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, least_weight, random_contacts


def edge_wrenches(positions, normals, friction, edges):
    """Wrenches of n + mu (cos t1 + sin t2), about the origin, with the frames of the package."""
    rows = []
    for point, frame in zip(positions, contact_frames(normals), strict=True):
        for turn in 2.0 * np.pi * np.arange(edges) / edges:
            force = frame @ [1.0, friction * np.cos(turn), friction * np.sin(turn)]
            rows.append([*force, *np.cross(point, force)])
    return np.array(rows)


@pytest.mark.parametrize("edges", [4, 8])
def test_min_weight_is_what_its_definition_says(edges):
    rng = np.random.default_rng(edges)
    signs = {True: 0, False: 0}
    for _ in range(40):
        positions, normals = random_contacts(rng)
        here = gc.min_weight(positions, normals, 0.5, edges=edges)
        W = edge_wrenches(positions, normals, 0.5, edges)
        assert here == pytest.approx(least_weight(W), abs=1e-9)
        signs[here > 0.0] += 1
    assert min(signs.values()) >= 5
    one_way = np.tile([0.0, 0, 1], (4, 1))
    assert gc.min_weight(TETRA_CENTERS, one_way, 0.5, edges=edges) == -math.inf


def test_min_weight_of_generic_contacts_is_positive_only_with_closure():
    """Of generic ones: two opposite contacts have a positive weight, but no closure."""
    pair = np.array([[1.0, 0, 0], [-1, 0, 0]])
    assert gc.min_weight(pair, -pair, 0.5) == pytest.approx(1.0 / 16.0)
    assert not gc.force_closure(pair, -pair, 0.5).closed
    rng = np.random.default_rng(1)
    positive = 0
    for _ in range(40):
        positions, normals = random_contacts(rng)
        if gc.min_weight(positions, normals, 0.4) > 1e-9:
            assert gc.force_closure(positions, normals, 0.4).closed
            positive += 1
    assert positive >= 6


def test_hull_volume_is_that_of_qhull_on_the_edges():
    rng = np.random.default_rng(3)
    for _ in range(4):
        positions, normals = random_contacts(rng)
        center, scale = rng.normal(size=3), 0.7
        W = edge_wrenches((positions - center) / scale, normals, 0.5, 8)
        volume = gc.hull_volume(positions, normals, 0.5, center=center, torque_scale=scale)
        assert volume > 0.0
        assert volume == pytest.approx(ConvexHull(W, qhull_options="QJ Pp").volume, rel=1e-6)


def test_the_volume_of_seven_pushes_is_that_of_their_simplex_and_that_of_four_zero():
    rng = np.random.default_rng(4)
    for _ in range(4):
        positions, normals = random_contacts(rng, 7)
        W = np.hstack([normals, np.cross(positions, normals)])
        exact = abs(np.linalg.det(W[1:] - W[0])) / math.factorial(6)
        volume = gc.hull_volume(positions, normals, 0.0, torque_scale=1.0)
        assert volume == pytest.approx(exact, rel=1e-6)
        longer = gc.hull_volume(positions, normals, 0.0, torque_scale=2.0)
        assert longer == pytest.approx(exact / 2.0**3, rel=1e-6)
    assert gc.hull_volume(TETRA_CENTERS, TETRA_NORMALS, 0.0, torque_scale=1.0) == 0.0


def test_the_singular_value_of_six_unit_contacts_is_known():
    """At +-1 on each axis: G G' is 6 for forces and 4 for torques."""
    positions = np.vstack([np.eye(3), -np.eye(3)])
    assert gc.smallest_singular_value(positions, torque_scale=1.0) == pytest.approx(2.0)
    assert gc.smallest_singular_value(positions, torque_scale=2.0) == pytest.approx(1.0)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_contacts_on_a_line_leave_a_turn_unopposed(count):
    positions = np.outer(np.arange(count), [1.0, 2.0, 3.0])
    value = gc.smallest_singular_value(positions, torque_scale=1.0)
    assert value == pytest.approx(0.0, abs=1e-12)
