"""Quadruples of vectors decided together beside those decided one by one."""

import numpy as np
import pytest

from grasp_core.cones.spanning import (
    each_cones_positively_span,
    positively_span,
    span_angle,
    span_angles,
)

MANY = 2000


def quadruples(rng):
    """Random unit vectors, and some in planes, doubled, or opposite to each other."""
    vectors = rng.normal(size=(MANY, 4, 3))
    vectors[::10, :, 2] = 0.0
    vectors[1::10, 1] = vectors[1::10, 0]
    vectors[2::10, 1] = -vectors[2::10, 0]
    vectors[3::10, 3] = -vectors[3::10, :3].sum(axis=1)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_span_angles_are_those_of_one_quadruple():
    units = quadruples(np.random.default_rng(1))
    found, spans = span_angles(units), positively_span(units)
    for each, angle in zip(units, found, strict=True):
        assert angle == pytest.approx(span_angle(each), rel=1e-12, abs=1e-15)
    assert 200 <= spans.sum() <= MANY - 200
    assert span_angles(units[:0]).shape == (0,)


def test_cones_of_equal_width_span_below_the_span_angle():
    rng = np.random.default_rng(2)
    units = quadruples(rng)
    units = units[positively_span(units)]
    shares = rng.choice([0.5, 0.999999, 1.000001, 1.5], size=len(units))
    angles = (span_angles(units) * shares)[:, None] * np.ones(4)
    assert (each_cones_positively_span(units, angles) == (shares < 1.0)).all()
    flat = quadruples(rng)[::10]
    assert not each_cones_positively_span(flat, np.full((len(flat), 4), 0.01)).any()
