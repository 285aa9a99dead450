"""Compiled nearest points by the conditions of optimality, and what becomes of wrong ones."""

import numpy as np
import pytest
from scipy.optimize import nnls

from grasp_core.compiled import compiled
from grasp_core.solvers.qp import NEAREST, NEAREST_POINT_KERNEL, least_distance

NEAR = 1e-9
CLOSE = 1e-10
"""Ten times what is accepted of the conditions of optimality."""


def polyhedra(count):
    """Polyhedra that do not hold the origin, with a point of each: (C, D, points).

    With fewer rows than variables and more, with double rows, rows of zeros, and points at which
    some rows hold with equality.
    """
    rng = np.random.default_rng(5)
    for trial in range(count):
        v, m = 1 + trial % 12, int(rng.integers(1, 80))
        C = rng.normal(size=(m, v))
        if trial % 3 == 0:
            C = np.vstack([C, C[: m // 2 + 1], np.zeros((1, v))])
        points = 3.0 * rng.normal(size=(10, v))
        slack = rng.uniform(size=(10, len(C))) * (rng.uniform(size=(10, len(C))) < 0.7)
        yield C, points @ C.T + slack, points


def unmet(C, d, x):
    """How far x is from being nearest: x = -C'u with u >= 0 on the rows that hold with equality."""
    slack = d - C @ x
    size = max(np.abs(x).max(), 1.0)
    active = C[slack <= NEAR * size]
    off = nnls(active.T, -x)[1] if len(active) else np.linalg.norm(x)
    return max(off, -slack.min()) / size


def test_points_are_nearest():
    moved = 0
    for C, D, points in polyhedra(240):
        for d, known in zip(D, points, strict=True):
            x = least_distance(C, d)
            assert unmet(C, d, x) <= CLOSE
            assert np.linalg.norm(x) <= np.linalg.norm(known) * (1.0 + NEAR)
            moved += x.any()
    assert moved >= 2000


def test_where_nothing_is_feasible_no_point_is_found():
    """Two rows that contradict each other among others, and a row of zeros that cannot hold."""
    rng = np.random.default_rng(6)
    for trial in range(40):
        C = rng.normal(size=(12, 4))
        C[1] = 0.0 if trial % 2 else -C[0]
        D = rng.uniform(0.5, 1.0, size=(3, 12))
        D[1, 0], D[1, 1] = -1.0, -0.5
        found = np.array([least_distance(C, d) for d in D])
        assert np.isnan(found[1]).all()
        assert not np.isnan(found[[0, 2]]).any()


def test_without_variables_rows_hold_or_nothing_is_found():
    assert least_distance(np.empty((3, 0)), np.ones(3)).shape == (0,)
    kernel, none = compiled(NEAREST_POINT_KERNEL), np.empty(0)
    assert kernel.nearest(np.empty((3, 0)), -np.ones(3), none) == (np.inf, np.inf)


@pytest.mark.parametrize("factor", [1.0 + 1e-9, 0.0, -1.0, np.nan])
@pytest.mark.parametrize("which", ["point", "multipliers"])
def test_wrong_answers_are_not_taken(factor, which):
    """The kernel scales polyhedra so that their farthest row is at one, as these are."""
    missed, kernel = compiled(NEAREST_POINT_KERNEL)._unmet, compiled(NEAREST_POINT_KERNEL)
    for C, D, _ in polyhedra(12):
        for d in D[D.min(axis=1) < 0.0]:
            x, d = np.empty(C.shape[1]), d / -d.min()
            off, excess = kernel.nearest(C, d, x)
            assert max(off, excess) <= NEAREST
            slack, u = d - C @ x, np.zeros(len(d))
            active = np.flatnonzero(slack <= NEAR * max(np.abs(x).max(), 1.0))
            u[active] = nnls(C[active].T, -x)[0]
            assert missed(C, d, x, u)[0] <= NEAR
            x, u = (factor * x, u) if which == "point" else (x, factor * u)
            assert not missed(C, d, x, u)[0] <= NEAREST * max(np.abs(x).max(), 1.0)
