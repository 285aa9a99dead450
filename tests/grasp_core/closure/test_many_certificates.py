"""Certificates of many sets of contacts beside those of one set at a time."""

import math

import numpy as np
import pytest

from grasp_core.closure.force_closure import certificates, closing_margins, force_closure
from grasp_core.errors import UndecidedError

SETS = 120


def contacts(count, rng, fingers=4):
    """Contacts around the origin whose normals lean up to a radian away from it."""
    points = rng.normal(size=(count, fingers, 3))
    points /= np.linalg.norm(points, axis=-1, keepdims=True)
    normals = -points + 0.6 * rng.normal(size=points.shape)
    return 0.04 * points + 0.1, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


@pytest.mark.parametrize(("fingers", "friction"), [(4, 0.2), (4, 0.7), (4, 2.0), (15, 0.3)])
def test_many_certificates_are_those_of_one_set_at_a_time(fingers, friction):
    points, normals = contacts(SETS, np.random.default_rng(3), fingers)
    found = certificates(points, normals, friction)
    margins = closing_margins(points, normals, friction)
    closed = decided = 0
    for x, n, known, margin in zip(points, normals, found, margins, strict=True):
        alone = force_closure(x, n, friction)
        assert math.isnan(margin) or (alone.closed and margin > 0.0)
        if known is None:
            continue
        decided += 1
        closed += known.closed
        assert known.verify()
        assert known.closed is alone.closed
        assert known.margin == pytest.approx(alone.margin, rel=1e-9, abs=1e-12)
        for name in ("forces", "separating_wrench"):
            one, other = getattr(known, name), getattr(alone, name)
            assert (one is None) is (other is None)
            if one is not None:
                np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * np.abs(other).max())
                assert not one.flags.writeable
        if known.closed:
            assert margin == known.margin
    assert decided >= 0.97 * SETS
    assert closed >= 1
    assert closed < decided or fingers > 4


def test_contacts_on_the_border_of_closure_are_left_or_decided_alike():
    """Two contacts face each other, and two more on a line: rank five, or margins of zero."""
    points = np.array([[[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]] * 3, dtype=float)
    normals = -points.copy()
    points[1, 2:] = [[2, 0, 0], [-2, 0, 0]]
    points[2] = 0.0
    found = certificates(points, normals, 0.5)
    for x, n, known in zip(points, normals, found, strict=True):
        try:
            alone = force_closure(x, n, 0.5).closed
        except UndecidedError:
            alone = None
        assert known is None or known.closed is alone
    assert math.isnan(closing_margins(points, normals, 0.5)[1])


def test_no_sets_and_no_friction_decide_nothing():
    points, normals = contacts(5, np.random.default_rng(0))
    assert certificates(points[:0], normals[:0], 0.5) == []
    assert certificates(points, normals, 0.0) == [None] * 5
    assert np.isnan(closing_margins(points, normals, 0.0)).all()
    assert np.isnan(closing_margins(points, 1.1 * normals, 0.5)).all()
