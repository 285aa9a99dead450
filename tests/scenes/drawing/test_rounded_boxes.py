"""Sides of rounded boxes are flat, close without gaps, and are on the surface."""

import math
from collections import Counter

import numpy as np
import pytest

from scenes.drawing.hands import STEPS, rounded_box

WHOLE = np.ones((2, 3), dtype=bool)
HALF = np.array([0.03, 0.02, 0.01])
SHAPES = {
    "box": (HALF, 0.0), "rounded box": (HALF, 0.004), "plate": (HALF * [1, 1, 0], 0.004),
    "capsule": (HALF * [0, 0, 1], 0.005), "ball": (0.0 * HALF, 0.01),
}  # fmt: skip
FLAT = 1e-12
"""Rounding of coordinates of some centimetres [m]."""


def away(points, half, radius):
    """Signed distances from the surface of a rounded box, by its definition."""
    return np.linalg.norm(np.maximum(np.abs(points) - half, 0.0), axis=1) - radius


@pytest.mark.parametrize("name", SHAPES)
def test_corners_are_on_the_surface_and_sides_are_flat(name):
    half, radius = SHAPES[name]
    sides = rounded_box(-half, half, radius, WHOLE)
    assert len(sides) >= 6
    corners = np.vstack(sides)
    if radius:
        np.testing.assert_allclose(away(corners, half, radius), 0.0, atol=FLAT)
    else:
        np.testing.assert_allclose(np.abs(corners), np.tile(half, (len(corners), 1)), atol=FLAT)
    for side in sides:
        assert len(side) >= 3
        flatness = np.linalg.svd(side - side.mean(axis=0), compute_uv=False)[2]
        assert flatness < FLAT


@pytest.mark.parametrize("name", SHAPES)
def test_each_edge_lies_between_two_sides(name):
    """The surface is closed, and its sides are wound alike, since each way is taken once."""
    half, radius = SHAPES[name]
    ways = Counter()
    for side in rounded_box(-half, half, radius, WHOLE):
        rounded = [tuple(corner) for corner in np.rint(side / 1e-9).astype(int).tolist()]
        ways.update(zip(rounded, [*rounded[1:], rounded[0]], strict=True))
    assert len(ways) >= 24
    assert set(ways.values()) == {1}
    assert all((end, start) in ways for start, end in ways)


def test_a_box_has_six_sides_and_a_ball_is_as_coarse_as_it_says():
    assert len(rounded_box(-HALF, HALF, 0.0, WHOLE)) == 6
    ball = rounded_box(np.zeros(3), np.zeros(3), 1.0, WHOLE)
    assert len(ball) == 2 * STEPS * 4 * STEPS
    # a side that spans an angle a in both ways misses the ball by 1 - cos(a / 2)^2 at most
    middles = [np.linalg.norm(side.mean(axis=0)) for side in ball]
    assert min(middles) >= math.cos(0.25 * math.pi / STEPS) ** 2 - FLAT


def test_pieces_of_a_rounded_box_make_the_whole():
    """Two halves have the sides of the whole, each cut in two, and none where they were cut."""
    half, radius = SHAPES["rounded box"]
    cut = WHOLE.copy()
    cut[1, 0] = False
    low = rounded_box(-half, half * [0, 1, 1], radius, cut)
    high = rounded_box(-half * [0, 1, 1], half, radius, cut[::-1])
    whole = rounded_box(-half, half, radius, WHOLE)
    assert sum(map(area, [*low, *high])) == pytest.approx(sum(map(area, whole)))
    for side in (*low, *high):
        assert np.ptp(side[:, 0]) > 0.0 or np.abs(side[0, 0]) > half[0]


def area(side):
    arms = side[1:] - side[0]
    return 0.5 * np.linalg.norm(np.cross(arms[:-1], arms[1:]).sum(axis=0))
