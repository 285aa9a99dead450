import itertools
from fractions import Fraction

import numpy as np
import pytest

from grasp_core.geometry.polygons import edge_rows, is_convex, signed_area
from grasp_core.objects.curved_patches import clearest_point, clearing

GAP = 1e-6


def fence(rng, corners=40, stretch=1.0):
    """A closed border of segments around zero, with teeth, and some loose segments inside."""
    turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    away = rng.uniform(0.5, 1.0, corners)
    points = away[:, None] * np.column_stack([stretch * np.cos(turns), np.sin(turns)])
    border = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    ends = rng.uniform(-1.0, 1.0, (6, 1, 2))
    return np.concatenate([border, ends + rng.uniform(-0.1, 0.1, (6, 2, 2))])


@pytest.mark.parametrize("stretch", [1.0, 6.0])
def test_no_segment_enters_a_clearing(stretch):
    rng, made = np.random.default_rng(1), 0
    for _ in range(40):
        segments = fence(rng, stretch=stretch)
        start, room = clearest_point(rng.uniform(-0.3, 0.3, (50, 2)), segments)
        polygon = clearing(start, segments, GAP)
        assert is_convex(polygon)
        E, b = edge_rows(polygon)
        assert (E @ start < b).all()
        shares = np.linspace(0.0, 1.0, 200)[:, None, None]
        points = (segments[:, 0] + shares * (segments[:, 1] - segments[:, 0])).reshape(-1, 2)
        assert (b[:, None] < E @ points.T).any(axis=0).all()
        assert signed_area(polygon) > 0.9 * np.pi * room**2
        made += 1
    assert made == 40


def test_a_long_clearing_grows_long():
    """Between two parallel fences it fills the lane, not a square around the middle."""
    ticks = np.linspace(-5.0, 5.0, 41)
    lanes = [np.column_stack([ticks, np.full(41, side)]) for side in (-0.5, 0.5)]
    ends = [np.array([[end, -0.5], [end, 0.5]]) for end in (-5.0, 5.0)]
    segments = np.array([[a, b] for line in (*lanes, *ends) for a, b in itertools.pairwise(line)])
    polygon = clearing(np.array([0.3, 0.1]), segments, GAP)
    assert signed_area(polygon) == pytest.approx(10.0, rel=1e-3)


def enters(polygon, segment):
    """Whether a segment has a point strictly inside a convex polygon, in rational arithmetic."""
    ends = [[Fraction(float(number)) for number in end] for end in segment]
    corners = [[Fraction(float(number)) for number in corner] for corner in polygon]
    low, high = Fraction(0), Fraction(1)
    for (x, y), (u, v) in itertools.pairwise([*corners, corners[0]]):
        here, there = ((u - x) * (q - y) - (v - y) * (p - x) for p, q in ends)
        if max(here, there) <= 0:
            return False
        if here < 0:
            low = max(low, here / (here - there))
        if there < 0:
            high = min(high, here / (here - there))
    return low < high


def lane(rng, width):
    """Border of a turned rectangle of length one, its long sides in pieces, and a point inside."""
    ticks = np.linspace(-0.5, 0.5, int(rng.integers(2, 9)))
    sides = [np.column_stack([s * ticks, np.full(len(ticks), -0.5 * s * width)]) for s in (1, -1)]
    turn = rng.uniform(0.0, 2.0 * np.pi)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    corners = np.concatenate(sides) @ axes.T
    start = axes @ [rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3) * width]
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1), start


@pytest.mark.timeout(120)  # it never ended once
@pytest.mark.parametrize("digits", range(1, 10))
def test_no_segment_enters_the_clearing_of_a_lane_however_narrow(digits):
    """Ordinary ones are filled; 1e-5 wide and narrower, the polygon may be smaller, never wrong."""
    rng, gap = np.random.default_rng(digits), 1e-9
    for _ in range(20):
        width = 10.0**-digits * rng.uniform(0.5, 1.0)
        segments, start = lane(rng, width)
        polygon = clearing(start, segments, gap)
        if polygon is None:
            assert width < 1e-7
            continue
        assert not any(enters(polygon, segment) for segment in segments)
        if width > 1e-4:
            assert signed_area(polygon) == pytest.approx(width, rel=1e-3)


@pytest.mark.timeout(120)  # it never ended once
@pytest.mark.parametrize("stretch", [1e2, 1e4])
def test_no_segment_enters_a_clearing_between_teeth_far_apart(stretch):
    rng = np.random.default_rng(2)
    for _ in range(30):
        segments = fence(rng, stretch=stretch)
        start, _ = clearest_point(rng.uniform(-0.3, 0.3, (50, 2)), segments)
        polygon = clearing(start, segments, GAP)
        assert not any(enters(polygon, segment) for segment in segments)


def test_the_clearest_point_is_the_farthest_of_the_candidates():
    square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    segments = np.stack([square, np.roll(square, -1, axis=0)], axis=1)
    point, room = clearest_point(np.array([[0.5, 0.0], [0.1, 0.0], [0.0, -0.9]]), segments)
    np.testing.assert_array_equal(point, [0.1, 0.0])
    assert room == pytest.approx(0.9)
