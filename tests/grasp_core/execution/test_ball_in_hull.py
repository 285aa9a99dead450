"""Triangles show a ball in a hull only if they are closed around the origin."""

import numpy as np
import pytest

from grasp_core.execution.carried_mass import ball_in, nearest_facet

OCTAHEDRON = np.vstack([np.eye(3), -np.eye(3)])
INSIDE = 1.0 / np.sqrt(3.0)
"""Distance of the origin from the faces of an octahedron with corners at unit distance."""


def faces():
    return nearest_facet(OCTAHEDRON)[2]


def test_the_ball_in_an_octahedron_touches_its_faces():
    normal, distance, triangles = nearest_facet(OCTAHEDRON)
    assert distance == pytest.approx(INSIDE, rel=1e-12)
    assert np.abs(normal) == pytest.approx(INSIDE, rel=1e-12)
    assert len(triangles) == 8
    assert ball_in(OCTAHEDRON, faces()) == pytest.approx(INSIDE, rel=1e-12)


def test_triangles_that_are_not_closed_around_the_origin_show_no_ball():
    good = faces()
    far = OCTAHEDRON + np.array([2.0, 0.0, 0.0])
    twice = np.vstack([good, good])
    flat = OCTAHEDRON * np.array([1.0, 1.0, 0.0])
    for points, triangles in (
        (OCTAHEDRON, good[1:]), (OCTAHEDRON, twice), (OCTAHEDRON, good + 1),
        (OCTAHEDRON, good - 1), (OCTAHEDRON, good[:0]), (far, good), (flat, good),
        (OCTAHEDRON, np.vstack([good[:1], good[1:, ::-1], good[:1, ::-1]])),
    ):  # fmt: skip
        assert not ball_in(points, triangles) > 0.0


def test_corners_nearly_in_line_show_no_ball():
    """Their normals are rounding, whatever side the origin seems to be on."""
    rng = np.random.default_rng(0)
    four = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    for _ in range(200):
        way = rng.normal(size=3)
        points = rng.uniform(1.0, 3.0, (4, 1)) * way + 1e-16 * rng.normal(size=(4, 3))
        assert not ball_in(points, four) > 0.0
        assert not ball_in(points, four[:, ::-1]) > 0.0
