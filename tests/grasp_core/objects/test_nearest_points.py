"""Nearest points of triangles of any size and shape, beside the definition in rational numbers."""

from fractions import Fraction

import numpy as np
import pytest

from grasp_core.objects.on_faces import nearest_on_triangles
from tests.grasp_core.exact_judges import exactly

ROUNDING = 2.0**-52


def squared_distance(triangle, point):
    """The square of a point's distance from a triangle, exactly."""
    (a, b, c), point = exactly(triangle), exactly(point)
    one, other, away = b - a, c - a, point - a
    g11, g12, g22 = one @ one, one @ other, other @ other
    det = g11 * g22 - g12 * g12
    if det > 0:
        v = (away @ one * g22 - away @ other * g12) / det
        w = (away @ other * g11 - away @ one * g12) / det
        if v >= 0 and w >= 0 and v + w <= 1:
            rest = away - v * one - w * other
            return rest @ rest
    return min(on_edge(p, q - p, point) for p, q in ((a, b), (b, c), (c, a)))


def on_edge(start, along, point):
    length = along @ along
    share = min(max((point - start) @ along / length, Fraction(0)), Fraction(1)) if length else 0
    rest = point - start - share * along
    return rest @ rest


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1e3])
@pytest.mark.parametrize("height", [1.0, 1e-3, 1e-7, 0.0])
def test_distances_are_those_of_rational_arithmetic(size, height):
    """Points are on, above, beside and far from triangles whose height is a share of their length.

    The bound is the module's: rounding divided by that share, and the share itself, in lengths; and
    rounding of the corners' own coordinates.
    """
    rng, inside = np.random.default_rng(7), 0
    for _ in range(20):
        a, b, c = rng.normal(size=(3, 3))
        c = a + rng.random() * (b - a) + height * (c - a)
        triangle = size * np.array([a, b, c])
        weights = rng.dirichlet([1.0, 1.0, 1.0])
        for point in (
            weights @ triangle,
            weights @ triangle + 1e-3 * size * rng.normal(size=3),
            size * rng.normal(size=3),
            30.0 * size * rng.normal(size=3),
        ):
            length = 4.0 * size + np.linalg.norm(point)
            slack = 16.0 * length * ROUNDING
            if height:
                slack += 4.0 * length * min(4.0 * ROUNDING / height, height)
            (found,) = nearest_on_triangles(triangle[None], point)
            truth = float(squared_distance(triangle, point)) ** 0.5
            assert np.linalg.norm(found - point) == pytest.approx(truth, abs=slack)
            assert float(squared_distance(triangle, found)) ** 0.5 <= slack
            inside += truth <= 4.0 * ROUNDING * size
    assert inside >= 10
