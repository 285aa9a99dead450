import numpy as np
import pytest
from scipy.optimize import linprog

from grasp_core.errors import SolverError
from grasp_core.lp import Infeasible, LinearProgram, Optimum, maximize

SQUARE = np.vstack([np.eye(2), -np.eye(2)])


def test_the_corner_of_a_square_is_found_with_its_multipliers():
    answer = maximize(LinearProgram(np.array([1.0, 2.0]), SQUARE, np.array([3.0, 4.0, 0, 0])))
    assert isinstance(answer, Optimum)
    np.testing.assert_allclose(answer.x, [3.0, 4.0])
    np.testing.assert_allclose(answer.multipliers, [1.0, 2.0, 0.0, 0.0])
    assert answer.value == pytest.approx(11.0)


def test_equalities_are_met():
    program = LinearProgram(
        np.array([1.0, 0.0]),
        SQUARE,
        np.array([3.0, 4.0, 0, 0]),
        np.array([[1.0, 1.0]]),
        np.array([2.0]),
    )
    answer = maximize(program)
    assert isinstance(answer, Optimum)
    np.testing.assert_allclose(answer.x, [2.0, 0.0], atol=1e-12)


def test_an_empty_set_comes_with_a_proof():
    answer = maximize(LinearProgram(np.array([1.0, 0]), SQUARE, np.array([1.0, 1, -2, 0])))
    assert isinstance(answer, Infeasible)
    y = answer.multipliers
    assert (y >= 0).all()
    np.testing.assert_allclose(SQUARE.T @ y, 0.0, atol=1e-12)
    assert y @ [1.0, 1, -2, 0] < 0


def test_an_unbounded_program_is_an_error():
    with pytest.raises(SolverError):
        maximize(LinearProgram(np.array([1.0, 1.0]), SQUARE[:1], np.array([1.0])))


def test_verdicts_and_values_agree_with_another_route():
    """Random programs, half of them made infeasible by a contradictory row."""
    rng = np.random.default_rng(0)
    seen = {Optimum: 0, Infeasible: 0}
    for trial in range(400):
        n, rows = int(rng.integers(2, 12)), int(rng.integers(15, 60))
        A = rng.normal(size=(rows, n))
        b = A @ rng.normal(size=n) + rng.uniform(size=rows)
        if trial % 2:
            weights = rng.uniform(size=rows)
            A = np.vstack([A, -weights @ A])
            b = np.append(b, -weights @ b - 0.01)
        c = A.T @ rng.uniform(size=len(A))
        answer = maximize(LinearProgram(c, A, b))
        judge = linprog(-c, A_ub=A, b_ub=b, bounds=[(None, None)] * n, method="highs-ipm")
        assert (judge.status == 0) == isinstance(answer, Optimum)
        seen[type(answer)] += 1
        if isinstance(answer, Optimum):
            assert answer.value == pytest.approx(-judge.fun, abs=1e-6)
    assert min(seen.values()) >= 150
