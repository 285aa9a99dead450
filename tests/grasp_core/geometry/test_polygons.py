import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasp_core.geometry.polygons import (
    area_and_centroid,
    clip,
    convex_hull,
    edge_rows,
    is_convex,
    merge_into_convex_pieces,
    plane_frame,
    signed_area,
    without_straight_corners,
)
from grasp_core.objects.booleans import triangulate

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
L_SHAPE = np.array([[0.0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])


@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_a_plane_frame_is_orthonormal_and_right_handed(vector):
    normal = np.array(vector) / np.linalg.norm(vector)
    full = np.column_stack([plane_frame(normal), normal])
    np.testing.assert_allclose(full.T @ full, np.eye(3), atol=1e-14)
    assert np.linalg.det(full) == pytest.approx(1.0, abs=1e-14)


def test_areas_and_centroid_of_a_square_with_a_hole():
    hole = 0.25 + 0.5 * SQUARE[::-1] + np.array([0.0, 0.1])
    area, centroid = area_and_centroid([SQUARE, hole])
    assert signed_area(SQUARE) == 1.0
    assert area == pytest.approx(0.75, rel=1e-14)
    np.testing.assert_allclose(centroid, [0.5, (0.5 - 0.25 * 0.6) / 0.75], rtol=1e-14)


def test_edge_rows_hold_inside_and_fail_outside():
    E, b = edge_rows(SQUARE)
    assert (b - E @ [0.5, 0.5] > 0).all()
    assert (b - E @ [1.5, 0.5] < 0).sum() == 1
    np.testing.assert_allclose(np.linalg.norm(E, axis=1), 1.0)


def test_a_hull_begins_at_the_first_of_its_corners_however_often_points_are_given():
    points = np.vstack([[[0.5, 0.5]], np.repeat(SQUARE[[2, 0, 3, 1]], 3, axis=0), [[0.2, 0.1]]])
    np.testing.assert_array_equal(convex_hull(points), SQUARE[[2, 3, 0, 1]])
    assert (convex_hull(np.ones((5, 2))) == 1.0).all()


def test_clipping_keeps_the_part_below_each_row():
    half = clip(SQUARE, np.array([[1.0, 0.0]]), np.array([0.25]))
    assert signed_area(half) == pytest.approx(0.25, rel=1e-14)
    assert clip(SQUARE, np.array([[1.0, 0.0]]), np.array([-1.0])).shape == (0, 2)


def test_straight_corners_are_dropped_and_others_kept():
    dense = np.array([[0.0, 0], [0.5, 0], [1, 0], [1, 1], [0.5, 1 + 1e-9], [0, 1]])
    np.testing.assert_array_equal(without_straight_corners(dense, 1e-6), SQUARE)
    assert len(without_straight_corners(L_SHAPE, 1e-6)) == 6


def test_an_l_shape_falls_into_two_convex_pieces():
    pieces = merge_into_convex_pieces(L_SHAPE, triangulate([L_SHAPE]))
    assert len(pieces) == 2
    assert all(is_convex(piece) for piece in pieces)
    assert sum(signed_area(piece) for piece in pieces) == pytest.approx(3.0, rel=1e-14)


def test_random_star_polygons_are_tiled_by_convex_pieces():
    """The pieces' areas add up, and random points lie in exactly one of them (but for the few
    that fall on a cut).
    """
    rng = np.random.default_rng(1)
    tried = 0
    for _ in range(100):
        corners = int(rng.integers(4, 14))
        angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
        if np.diff(angles, append=angles[0] + 2 * np.pi).max() > 3.0:
            continue
        radii = rng.uniform(0.3, 1.0, corners)
        polygon = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
        pieces = merge_into_convex_pieces(polygon, triangulate([polygon]))
        assert all(is_convex(piece) for piece in pieces)
        area = sum(signed_area(piece) for piece in pieces)
        assert area == pytest.approx(signed_area(polygon), rel=1e-9)
        mixed = rng.dirichlet(np.ones(2), 40)
        corner = rng.integers(corners, size=40)
        ends = np.stack([polygon[corner], polygon[(corner + 1) % corners]], axis=1)
        points = rng.uniform(0.05, 0.95, (40, 1)) * np.einsum("pe,pei->pi", mixed, ends)
        inside = np.array([_inside(piece, points) for piece in pieces]).sum(axis=0)
        assert (inside == 1).mean() > 0.99
        tried += 1
    assert tried >= 50


def _inside(piece, points):
    E, b = edge_rows(piece)
    return (points @ E.T < b).all(axis=1)
