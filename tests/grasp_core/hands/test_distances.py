"""Distances of boxes against points strewn over them, a quadratic program and trimesh."""

from functools import cache

import numpy as np
import pytest
import scipy.optimize
import trimesh

import grasp_core as gc
import scenes
from grasp_core.compiled import compiled
from grasp_core.hands.collisions import COLLISIONS as HANDS
from grasp_core.hands.collisions import surface_tree
from grasp_core.hands.hand_arrays import hand_arrays
from tests.judges import random_rotation

COLLISIONS = "grasp_core.hands.distances_kernel"
EXACT = 1e-7
"""Accuracy of the program that judges: its own tolerance is 1e-15 on squares."""


def test_hulls_are_as_far_apart_as_the_program_says():
    """Also hulls that are flat, alike or a point, and such that overlap."""
    kernel, rng, seen = compiled(COLLISIONS), np.random.default_rng(20), 0
    for n in range(150):
        A = rng.normal(size=(int(rng.integers(1, 30)), 3))
        B = rng.normal(size=(int(rng.integers(1, 9)), 3)) * 10.0 ** rng.uniform(-3, 0)
        B += rng.normal(size=3) * 2.0
        if n % 3 == 0:
            A[:, 2] = 0.0
        if n % 5 == 0:
            B[:] = B[0]
        near, other = np.empty(3), np.empty(3)
        apart, true = kernel.hull_hull(A, B, np.inf, near, other), hulls_apart(A, B)
        assert apart == pytest.approx(true, abs=EXACT)
        if apart > 0.0:
            seen += 1
            assert np.linalg.norm(other - near) == pytest.approx(apart, abs=1e-12)
            way = (other - near) / apart  # the planes across it separate the hulls
            assert (A @ way).max() <= near @ way + 1e-9
            assert (B @ way).min() >= other @ way - 1e-9
            bound = kernel.hull_hull(A, B, 0.5 * apart, near, other)
            assert 0.5 * apart < bound <= apart + 1e-12
    assert seen > 50


def test_a_hull_is_as_far_from_a_surface_as_from_its_nearest_triangle():
    kernel, rng = compiled(COLLISIONS), np.random.default_rng(21)
    body = scenes.example_object("l-bracket")
    tree = surface_tree(body)
    for _ in range(20):
        points = rng.normal(size=(12, 3)) * 0.01 + rng.normal(size=3) * 0.06
        near, other, buffers = np.empty(3), np.empty(3), np.empty((2, 3))
        found = kernel.hull_surface(points, np.inf, tree, near, other)
        each = [kernel.hull_hull(points, t, np.inf, *buffers) for t in tree.corners]
        assert found == pytest.approx(min(each), abs=1e-12)
        limit = 0.5 * found
        farther = kernel.hull_surface(points, limit, tree, near, other)
        assert farther == (0.0 if found == 0.0 else np.inf)


def hulls_apart(A, B):
    """Distance of the hulls of two sets of points: non-negative least squares on their weights.

    Weights of one sum to one by a row that weighs heavily; a second run without rounding is not
    needed at these sizes.
    """
    heavy = 1e4
    ones, none = np.ones((1, len(A))), np.zeros((1, len(A)))
    others, zeros = np.ones((1, len(B))), np.zeros((1, len(B)))
    rows = np.block([[A.T, -B.T], [heavy * ones, zeros], [none, heavy * others]])
    weights, _ = scipy.optimize.nnls(rows, np.array([0.0, 0.0, 0.0, heavy, heavy]))
    a, b = weights[: len(A)] / weights[: len(A)].sum(), weights[len(A) :] / weights[len(A) :].sum()
    return float(np.linalg.norm(a @ A - b @ B))


def corners(h, R, middle):
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return middle + (signs * h) @ R.T


@cache
def allegro():
    return hand_arrays(gc.load_hand("allegro"))


def boxes_apart(h, g, R, middle, way, point):
    """Signed distance of the box |x_i| <= h_i from another, as two shapes of a hand."""
    arrays = allegro()._replace(
        shape_sizes=np.array([h, g]), shape_radii=np.zeros(2), shape_tips=np.full(2, -1)
    )
    turned, middles = np.array([np.eye(3), R]), np.array([np.zeros(3), middle])
    return compiled(HANDS).pair_distance(arrays, turned, middles, 0, 1, 10.0, way, point)


def test_boxes_are_as_far_apart_as_a_program_says_and_the_way_and_point_lie_between():
    rng = np.random.default_rng(4)
    way, point, apart = np.empty(3), np.empty(3), 0
    for _ in range(100):
        h, g = rng.uniform(0.1, 1.0, (2, 3)) * rng.integers(0, 2, (2, 3))
        R, middle = random_rotation(rng), rng.normal(scale=1.2, size=3)
        found = boxes_apart(h, g, R, middle, way, point)
        true = hulls_apart(corners(h, np.eye(3), np.zeros(3)), corners(g, R, middle))
        assert max(found, 0.0) == pytest.approx(true, abs=1e-6)
        if found > 0.01:
            apart += 1
            assert np.linalg.norm(way) == pytest.approx(1.0)
            back = point - found * way  # a point of the first box
            assert (np.abs(back) <= h + EXACT).all()
            assert (np.abs(R.T @ (point - middle)) <= g + EXACT).all()
    assert 30 < apart < 100


def test_overlapping_boxes_come_apart_by_the_stated_way_and_no_shorter():
    rng = np.random.default_rng(5)
    way, point, other, seen = np.empty(3), np.empty(3), np.empty(3), 0
    for _ in range(100):
        h, g = rng.uniform(0.3, 1.0, (2, 3))
        R, middle = random_rotation(rng), rng.normal(scale=0.5, size=3)
        depth = -boxes_apart(h, g, R, middle, way, point)
        if depth <= 0.0:
            continue
        seen += 1
        moved = middle + 1.0001 * depth * way
        assert boxes_apart(h, g, R, moved, other, point) > 0.0
        for direction in rng.normal(size=(20, 3)):
            near = middle + 0.999 * depth * direction / np.linalg.norm(direction)
            assert boxes_apart(h, g, R, near, other, point) < 0.0
    assert seen > 25


def is_inside(place, body):
    """Whether a ray in an odd direction leaves the surface an odd number of times."""
    way = np.array([0.5772, 0.3141, 0.7549])
    a, b, c = np.moveaxis(body.vertices[body.triangles], 1, 0)
    across = np.cross(way, c - a)
    scale = np.einsum("ti,ti->t", b - a, across)
    u = np.einsum("ti,ti->t", place - a, across) / scale
    other = np.cross(place - a, b - a)
    v, t = other @ way / scale, np.einsum("ti,ti->t", c - a, other) / scale
    return bool(((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)).sum() % 2)


@pytest.mark.parametrize("name", ["cross", pytest.param("mug", marks=pytest.mark.slow)])
def test_nearest_points_are_those_of_trimesh(name):
    body, rng = scenes.example_object(name), np.random.default_rng(6)
    tree, kernel, near = surface_tree(body), compiled(COLLISIONS), np.empty(3)
    places = rng.uniform(-0.1, 0.1, (200, 3))
    mesh = trimesh.Trimesh(body.vertices, body.triangles, process=False)
    _, true, _ = trimesh.proximity.closest_point_naive(mesh, places)
    for i, place in enumerate(places):
        t = kernel.nearest(place, 1.0, tree, near)
        assert t >= 0
        assert np.linalg.norm(near - place) == pytest.approx(true[i], abs=1e-12)
        if true[i] > 1e-6:
            wound = kernel.windings(place, tree.corners)
            assert wound == pytest.approx(1.0 if is_inside(place, body) else 0.0, abs=1e-9)
    assert kernel.nearest(np.full(3, 9.0), 1.0, tree, near) == -1
