"""Quadruples of vectors decided together beside those decided one by one."""

import numpy as np
import pytest

from grasp_core.cones.spanning import (
    cones_positively_span,
    each_cones_positively_span,
    each_positively_spans,
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
    found, spans = span_angles(units), each_positively_spans(units)
    for each, angle, span in zip(units, found, spans, strict=True):
        assert angle == pytest.approx(span_angle(each), rel=1e-12, abs=1e-15)
        assert bool(span) is positively_span(each)
    assert 200 <= spans.sum() <= MANY - 200
    assert span_angles(units[:0]).shape == (0,)


def test_cones_span_together_as_they_do_one_by_one():
    """Half-angles on either side of the span angle, and four that differ."""
    rng = np.random.default_rng(2)
    units = quadruples(rng)
    units = units[each_positively_spans(units)]
    shares = rng.choice([0.5, 0.999999, 1.000001, 1.5], size=(len(units), 1))
    angles = span_angles(units)[:, None] * shares * np.ones(4)
    angles[::3] *= rng.uniform(0.5, 1.5, size=angles[::3].shape)
    found = each_cones_positively_span(units, angles)
    for axes, four, spans in zip(units, angles, found, strict=True):
        assert bool(spans) is cones_positively_span(axes, four)
    assert 100 <= found.sum() <= len(found) - 100
    flat = quadruples(rng)[::10]
    assert not each_cones_positively_span(flat, np.full((len(flat), 4), 0.01)).any()
