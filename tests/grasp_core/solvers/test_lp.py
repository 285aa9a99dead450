from collections import Counter
from unittest import mock

import numpy as np
import pytest
from scipy.optimize import linprog

from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.solvers import lp
from grasp_core.solvers.lp import Infeasible, LinearProgram, Optimum, maximize

SQUARE = np.vstack([np.eye(2), -np.eye(2)])


def test_the_corner_of_a_square_is_found_with_its_multipliers():
    answer = maximize(LinearProgram(np.array([1.0, 2.0]), SQUARE, np.array([3.0, 4.0, 0, 0])))
    assert isinstance(answer, Optimum)
    np.testing.assert_allclose(answer.x, [3.0, 4.0])
    np.testing.assert_allclose(answer.multipliers, [1.0, 2.0, 0.0, 0.0])
    assert answer.value == pytest.approx(11.0)


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


def answers_agree(program, answer):
    """Whether HiGHS says the same."""
    judge = linprog(
        -program.c, A_ub=program.A, b_ub=program.b, A_eq=program.A_eq, b_eq=program.b_eq,
        bounds=(None, None), method="highs",
    )  # fmt: skip
    if isinstance(answer, Infeasible):
        return judge.status == 2  # infeasible
    return judge.status == 0 and abs(answer.value + judge.fun) <= 1e-8 * (1.0 + abs(judge.fun))


@pytest.mark.parametrize("route", [lp._by_simplex, lp._by_interior_point])
def test_degenerate_programs_end_with_the_same_answers(route):
    """Small whole numbers: rows repeat, vertices coincide, equalities contradict each other."""
    rng = np.random.default_rng(1)
    seen = {Optimum: 0, Infeasible: 0, None: 0}
    for _ in range(200):
        n, rows, equalities = int(rng.integers(2, 7)), int(rng.integers(6, 25)), rng.integers(0, 3)
        A = rng.integers(-1, 2, (rows, n)).astype(float)
        A_eq = rng.integers(-1, 2, (equalities, n)).astype(float)
        box = np.vstack([np.eye(n), -np.eye(n)])
        program = LinearProgram(
            rng.integers(-2, 3, n).astype(float), np.vstack([A, box]),
            np.append(rng.integers(-1, 3, rows), np.full(2 * n, 5.0)), A_eq,
            rng.integers(-1, 2, equalities).astype(float),
        )  # fmt: skip
        try:
            answer = route(program)
        except (SolverError, np.linalg.LinAlgError):
            seen[None] += 1
            continue
        assert answers_agree(program, answer)
        seen[type(answer)] += 1
    assert min(seen[Optimum], seen[Infeasible]) >= 30
    assert seen[None] <= 2


def test_a_cutoff_ends_the_search_with_a_bound_below_it():
    rng, ended = np.random.default_rng(2), 0
    for _ in range(60):
        A = rng.normal(size=(40, 5))
        b = rng.uniform(0.5, 1.5, 40)
        c = rng.normal(size=5)
        best = maximize(LinearProgram(c, A, b))
        if not isinstance(best, Optimum):
            continue
        simplex, rows = kernel_rows(A, b)

        def bound(cutoff, c=c, simplex=simplex, rows=rows):
            return simplex.bounded(c, rows, cutoff, 1e-11, simplex.vertex_of(5))

        assert best.value - 1e-9 <= bound(best.value + 0.1) <= best.value + 0.1
        assert bound(best.value - 0.1) == pytest.approx(best.value, abs=1e-9)
        ended += 1
    assert ended >= 50


def test_what_the_compiled_method_gets_wrong_is_left_to_the_conic_solver(monkeypatch):
    wrong = mock.Mock(side_effect=SolverError("a row is violated"))
    monkeypatch.setattr(lp, "_by_simplex", wrong)
    answer = maximize(LinearProgram(np.ones(2), SQUARE, np.ones(4)))
    assert wrong.called
    assert answer.value == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("rows", "limits"),
    [([[1.0], [-1.0]], [3e4, -2e4]), ([[1e-5], [-1e-5]], [2.0, -1.0])],
)
def test_programs_far_from_order_one_are_not_called_infeasible(rows, limits):
    program = LinearProgram(np.ones(1), np.array(rows), np.array(limits))
    assert isinstance(maximize(program), Optimum)


def test_numbers_that_are_none_are_an_error():
    with pytest.raises(SolverError):
        maximize(LinearProgram(np.ones(2), SQUARE, np.array([1.0, np.nan, 1.0, 1.0])))
    program = LinearProgram(np.ones(2), SQUARE, np.ones(4))
    with pytest.raises(SolverError):
        lp._checked_optimum(program, np.full(2, np.nan), np.ones(4))


def kernel_rows(A, b, equalities=0):
    """A program as compiled code wants it."""
    simplex = compiled(lp.LP_KERNEL)
    A, b = np.asarray(A, dtype=float), np.asarray(b, dtype=float)
    rows = simplex.LpRows(np.array(A.T, order="C"), b, equalities)
    return simplex, rows


def vertex_of(simplex, basis, y):
    return simplex.Vertex(np.array(basis), np.array(y, dtype=float), np.zeros(len(basis)))


def test_bounds_are_proved_where_many_rows_nearly_meet_in_a_vertex():
    """A corner of a box, each of whose rows comes four times, turned by about the last pivot."""
    rng, seen = np.random.default_rng(8), Counter()
    for trial in range(60):
        n = int(rng.integers(3, 12))
        A = np.vstack([np.eye(n), -np.eye(n)] * 4)
        A = (A + 1e-9 * rng.normal(size=A.shape)) @ np.linalg.qr(rng.normal(size=(n, n)))[0]
        b = np.ones(len(A)) + 1e-9 * rng.normal(size=len(A))
        if trial % 2:
            A, b = np.vstack([A, -A[:1]]), np.append(b, -b[0] - 1e-3)  # beyond the first face
        c = A[: 2 * n].T @ rng.choice([0.0, 1.0, 2.0], size=2 * n)
        simplex, rows = kernel_rows(A, b)
        bound = simplex.bounded(c, rows, -np.inf, 1e-11, simplex.vertex_of(n))
        expected = linprog(-c, A, b, bounds=[(None, None)] * n)
        seen[expected.status] += 1
        assert bound == (
            pytest.approx(-expected.fun, abs=1e-7) if expected.x is not None else -np.inf
        )
    assert min(seen[0], seen[2]) == 30


def test_compiled_bounds_count_only_what_multipliers_prove():
    simplex, rows = kernel_rows(SQUARE, [3.0, 4.0, 0.0, 0.0])
    c = np.array([1.0, 2.0])

    def bound(basis, y, of=rows):
        return simplex.proved_bound(c, of, vertex_of(simplex, basis, y), 1e-12)

    assert bound([0, 1], [1.0, 2.0]) == pytest.approx(11.0)
    assert bound([0, 1], [1.0, 1.0]) == np.inf  # something of c is left over
    assert bound([2, 3], [-1.0, -2.0]) == np.inf  # rows that may not be turned
    assert bound([0, 4 + 2], [1.0, 2.0]) == np.inf  # a side of the box
    _, equal = kernel_rows(SQUARE, [3.0, 4.0, 0.0, 0.0], equalities=2)
    assert bound([2, 3], [-1.0, -2.0], equal) == pytest.approx(0.0)
    assert bound([0, 1], [1.0, 2.0], kernel_rows(SQUARE, [np.nan, 4.0, 0.0, 0.0])[1]) == np.inf


def test_compiled_refutations_count_only_what_the_combination_proves():
    contradictory = [3.0, 4.0, -5.0, 0.0]  # x <= 3 and x >= 5

    def empty(alpha, basis=(0, 1), b=contradictory, equalities=0):
        simplex, rows = kernel_rows(SQUARE, b, equalities)
        return simplex.proved_empty(rows, vertex_of(simplex, basis, alpha), 2, 1e4)

    assert empty([-1.0, 0.0])
    assert not empty([-1.0, 0.0], b=[3.0, 4.0, -3.0, 0.0])  # they meet
    assert not empty([-0.9, 0.0])  # something of the row is left over
    assert not empty([1.0, 0.0])
    assert empty([-1.0, 0.1])  # what may not weigh is left out, and the rest is proof enough
    assert not empty([-1.0, 0.0], basis=(4, 1))  # a side of the box
    assert not empty([-1.0, 0.0], b=[np.nan, 4.0, -5.0, 0.0])
