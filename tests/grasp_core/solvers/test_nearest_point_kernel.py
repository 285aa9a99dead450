"""The compiled nearest points beside those by least squares, and what becomes of wrong ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import nnls

import grasp_core as gc
from grasp_core.compiled import compiled
from grasp_core.solvers import nearest_point as module
from grasp_core.solvers.nearest_point import least_distance
from scenes.example_objects import example_object

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


def nothing_proved(C, D, _):
    nothing = np.zeros(len(D), dtype=bool)
    return np.zeros((len(D), C.shape[1])), nothing, nothing


def without_kernel(monkeypatch, run):
    with monkeypatch.context() as patch:
        patch.setattr(module, "_by_kernel", nothing_proved)
        return run()


def forbid_least_squares(monkeypatch):
    def refuse(*_):
        raise AssertionError("left to least squares")

    monkeypatch.setattr(module, "_by_least_squares", refuse)


def test_points_are_nearest_and_those_of_least_squares(monkeypatch):
    tested, moved, compared = 0, 0, 0
    for C, D, points in polyhedra(240):
        expected = without_kernel(monkeypatch, lambda C=C, D=D: least_distance(C, D))
        with monkeypatch.context() as patch:
            forbid_least_squares(patch)
            found = least_distance(C, D)
        for d, x, known, other in zip(D, found, points, expected, strict=True):
            assert unmet(C, d, x) <= CLOSE
            assert np.linalg.norm(x) <= np.linalg.norm(known) * (1.0 + NEAR)
            if not np.isnan(other[0]):
                np.testing.assert_allclose(x, other, rtol=0.0, atol=NEAR * np.abs(known).max())
                compared += 1
            moved += x.any()
            tested += 1
    assert tested == 2400
    assert moved >= 2000
    assert compared >= 2300


def test_a_corner_and_an_edge_by_hand():
    C = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]])
    D = np.array([[-3.0, -4.0, 8.0], [-3.0, 1.0, 8.0], [1.0, 1.0, -2.0], [1.0, 1.0, 0.0]])
    np.testing.assert_allclose(
        least_distance(C, D), [[3, 4], [3, 0], [-1, -1], [0, 0]], rtol=0.0, atol=1e-14
    )


def test_where_nothing_is_feasible_no_point_is_found(monkeypatch):
    """Two rows that contradict each other among others, and a row of zeros that cannot hold."""
    rng = np.random.default_rng(6)
    for trial in range(40):
        C = rng.normal(size=(12, 4))
        C[1] = 0.0 if trial % 2 else -C[0]
        D = rng.uniform(0.5, 1.0, size=(3, 12))
        D[1, 0], D[1, 1] = -1.0, -0.5
        expected = without_kernel(monkeypatch, lambda C=C, D=D: least_distance(C, D))
        with monkeypatch.context() as patch:
            if trial % 2 == 0:  # a row of zeros contradicts itself, not others
                forbid_least_squares(patch)
            found = least_distance(C, D)
        assert np.isnan(found[1]).all()
        assert not np.isnan(found[[0, 2]]).any()
        np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))


def test_a_contradiction_that_is_none_is_left_to_least_squares(monkeypatch):
    """Weights of rows that do not cancel, or only for near points, prove nothing."""
    tested = 0
    for C, D, _ in polyhedra(12):
        expected = without_kernel(monkeypatch, lambda C=C, D=D: least_distance(C, D))
        for weights in (1.0, 1e6):

            def contradict(X, U, weights=weights):
                X[:], U[:] = 0.0, weights

            with monkeypatch.context() as patch:
                patch.setattr(module, "compiled", lambda _, c=contradict: spoiled(c))
                found = least_distance(C, D)
            near = NEAR * np.abs(expected).max()
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=near)
            tested += len(found)
    assert tested == 240


def test_no_variables_and_no_polyhedra_leave_nothing_to_find():
    assert least_distance(np.ones((3, 2)), np.empty((0, 3))).shape == (0, 2)
    assert least_distance(np.empty((3, 0)), np.ones((5, 3))).shape == (5, 0)


def spoiled(change):
    kernel = compiled(module.KERNEL)

    def solve(C, D, X, U):
        kernel.solve(C, D, X, U)
        change(X, U)

    return SimpleNamespace(solve=solve)


def times(factor, which):
    def change(*answer):
        answer[which][:] *= factor

    return change


@pytest.mark.parametrize(
    "change",
    [times(1.0 + 1e-9, 0), times(1.0 + 1e-9, 1), times(0.0, 0), times(0.0, 1), times(-1.0, 1),
     times(np.nan, 0), times(np.nan, 1)],
)  # fmt: skip
def test_wrong_answers_are_left_to_least_squares(monkeypatch, change):
    tested = 0
    for C, D, _ in polyhedra(12):
        expected = without_kernel(monkeypatch, lambda C=C, D=D: least_distance(C, D))
        with monkeypatch.context() as patch:
            patch.setattr(module, "compiled", lambda _: spoiled(change))
            found = least_distance(C, D)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=NEAR * np.abs(expected).max())
        tested += len(found)
    assert tested == 120


def test_contact_forces_are_the_same_with_the_kernel_and_without(monkeypatch):
    rng = np.random.default_rng(9)
    tested = 0
    for name in ("wedge", "dodecahedron", "random-20-7"):
        for grasp in gc.plan(example_object(name), 0.5, limit=5).grasps:
            resisted = 0.5 * gc.ferrari_canny(grasp, torque_scale=1.0, norm="linf").lower
            loads = rng.normal(size=(24, 6))
            loads *= resisted / np.linalg.norm(loads, axis=1, keepdims=True)
            for limits in ((0.0, np.inf), (0.0, 1.0), (0.01, 5.0)):

                def run(grasp=grasp, loads=loads, limits=limits):
                    return gc.contact_forces(grasp, None, 0.5, loads, normal_force=limits)

                expected = without_kernel(monkeypatch, run)
                with monkeypatch.context() as patch:
                    forbid_least_squares(patch)
                    found = run()
                near = NEAR * np.abs(expected).max()
                np.testing.assert_allclose(found, expected, rtol=0.0, atol=near)
                tested += len(found)
    assert tested >= 1000


def test_loads_beyond_the_limits_are_refused_all_the_same():
    grasp = gc.plan(example_object("wedge"), 0.5, limit=1).grasps[0]
    loads = np.array([[0.01, 0, 0, 0, 0, 0], [100.0, 0, 0, 0, 0, 0]])
    with pytest.raises(gc.NoForcesError, match="wrench 1, counting from 0"):
        gc.contact_forces(grasp, None, 0.5, loads, normal_force=(0.0, 1.0))
