import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tests.grasp_core.quality.reference_growing_hull import GrowingHull, spread_simplex


def grown(points):
    hull = GrowingHull(points[spread_simplex(points)])
    for point in points:
        hull.add(point)
    return hull


@pytest.mark.parametrize("dimension", [2, 3, 4, 6])
def test_it_finds_the_facets_that_qhull_finds(dimension):
    rng = np.random.default_rng(dimension)
    for _ in range(5):
        points = rng.normal(size=(24, dimension))
        normals, corners = grown(points).simplices()
        expected = ConvexHull(points).equations
        assert len(corners) == len(expected)
        nearest = np.abs(normals[:, None] - expected[None, :, :-1]).max(axis=2).min(axis=1)
        assert nearest.max() < 1e-9


def test_many_points_on_common_planes_stay_below_them():
    """The grid of a cube: coplanar and collinear points everywhere."""
    axis = np.linspace(-1.0, 1.0, 5)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    points = points[np.random.default_rng(0).permutation(len(points))]
    hull = grown(points)
    normals, _ = hull.simplices()
    assert (points @ normals.T).max() <= 1.0 + 1e-9
    assert hull.lowest()[1] == pytest.approx(1.0, abs=1e-9)


def test_a_point_inside_changes_nothing():
    hull = grown(np.vstack([np.eye(3), -np.eye(3)]))
    before = hull.simplices()[1]
    assert not hull.add(np.array([0.1, 0.1, 0.1]))
    np.testing.assert_array_equal(hull.simplices()[1], before)


def test_points_of_a_plane_hold_no_simplex():
    points = np.random.default_rng(1).normal(size=(20, 2)) @ np.ones((2, 3))
    assert spread_simplex(points) is None


def test_lattices_with_ties_everywhere_are_closed_and_convex():
    """Corners and middles of cubes: every ridge keeps two sides, and no point is left out."""
    rng, tested = np.random.default_rng(2), 0
    for dimension in (3, 4, 5, 6):
        for _ in range(20):
            points = rng.integers(-1, 2, size=(40, dimension)).astype(float)
            hull = grown(points)
            normals, corners = hull.simplices()
            offsets = np.einsum("mj,mj->m", normals, np.array(hull.points)[corners[:, 0]])
            assert (normals @ points.T <= offsets[:, None] + 1e-9).all()
            ordered = np.sort(corners, axis=1)
            ridges = np.concatenate([np.delete(ordered, j, axis=1) for j in range(dimension)])
            _, counts = np.unique(ridges, axis=0, return_counts=True)
            assert (counts % 2 == 0).all()
            expected = ConvexHull(points, qhull_options="QJ Pp").equations[:, -1]
            assert hull.lowest()[1] == pytest.approx(-expected.max(), abs=1e-6)
            tested += 1
    assert tested == 80
