"""Ties are decided by rules that rounding cannot tip."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from grasp_core.solvers import ties
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize

ROUNDING = 1e-14
"""What another processor makes of a number of order one, generously."""


def shaken(rng, values):
    return values + ROUNDING * rng.uniform(-1.0, 1.0, np.shape(values))


def test_numbers_of_regular_objects_are_far_from_the_borders_of_cells():
    """Fractions of small whole numbers, their roots, and the golden section."""
    fractions = {i / j for j in range(1, 33) for i in range(3 * j + 1)}
    numbers = np.array([f(x) for x in sorted(fractions) for f in (float, math.sqrt)])
    numbers = np.append(numbers, [math.pi, (1.0 + math.sqrt(5.0)) / 2.0, 1.0 / 256.0, 0.5**20])
    assert len(numbers) > 1_500
    np.testing.assert_array_equal(ties.graded(numbers + ROUNDING), ties.graded(numbers - ROUNDING))


def test_few_digits_round_down_by_less_than_a_share():
    rng = np.random.default_rng(0)
    for sizes in rng.uniform((-6.0, -6.0), (3.0, -0.5), (2000, 2)):
        number, share = 10.0**sizes
        rounded = ties.few_digits(number, share)
        assert number * (1.0 - share) < rounded <= number
        assert ties.few_digits(rounded, share) == rounded
        assert ties.few_digits(number * (1.0 + 1e-15), share) == rounded


def test_coarse_bounds_are_upper_bounds_shared_by_equals():
    numbers = np.random.default_rng(0).uniform(0.0, 3.0, 10_000)
    bounds = ties.coarse(numbers)
    assert (bounds >= numbers).all()
    assert (bounds - numbers).max() <= 1.001 * 10.0**-ties.SAME_DIGITS
    assert ties.coarse(0.25 + 1e-15) == ties.coarse(0.25 - 1e-15)
    assert ties.coarse(math.inf) == math.inf
    assert ties.coarse(-math.inf) == -math.inf


@pytest.mark.parametrize("digits", [6, 9, 10])
def test_numbers_on_a_grid_share_all_bits_with_their_equals(digits):
    numbers = np.array([i / j for j in range(1, 33) for i in range(-3 * j, 3 * j + 1)])
    told = ties.on_grid(numbers, digits)
    assert np.abs(told - numbers).max() <= 0.62 * 10.0**-digits
    for shift in (-ROUNDING, ROUNDING):
        assert ties.on_grid(numbers + shift, digits).tobytes() == told.tobytes()
    assert ties.coarse(0.25 + 1e-15, digits) == ties.coarse(0.25 - 1e-15, digits) > 0.25


@given(st.integers(0, 10**6))
def test_orders_of_repeated_numbers_do_not_depend_on_their_last_digits(seed):
    rng = np.random.default_rng(seed)
    values = rng.choice(rng.permutation(np.linspace(0.1, 1.0, 40))[:6], 30)
    assert ties.smallest_first(shaken(rng, values)) == ties.smallest_first(values)
    assert ties.largest_first(shaken(rng, values)) == ties.largest_first(values)
    assert ties.first_best(shaken(rng, values)) == int(np.argmax(values))
    assert sorted(ties.smallest_first(values), key=lambda i: (values[i], i)) == (
        ties.smallest_first(values)
    )


def test_ranks_count_equals_once_and_take_infinities():
    found = ties.ranks([3.0, 1.0, 3.0 + 1e-9, math.inf, 2.0, math.inf])
    assert found.tolist() == [2, 0, 2, 3, 1, 3]
    assert ties.ranks([]).tolist() == []
    assert ties.first_best([-math.inf, -math.inf]) == 0
    assert ties.first_best([1.0, math.inf, math.inf]) == 1


def test_a_challenger_must_be_better_by_a_margin():
    assert ties.surpassing(0.3) >= 0.3 * (1.0 + 1e-9)
    assert ties.surpassing(0.3) < 0.3 * (1.0 + 1e-5)
    assert ties.surpassing(-0.3) >= -0.3 + 1e-9
    assert ties.surpassing(-math.inf) == -math.inf


def random_program(rng, *, equalities):
    """A bounded program whose objective is that of some of its rows: a whole face is optimal."""
    n, rows = 5, 12
    A = rng.normal(size=(rows, n))
    A = np.vstack([A, np.eye(n), -np.eye(n)])
    b = np.concatenate([rng.uniform(0.5, 1.5, rows), np.full(2 * n, 3.0)])
    c = A[:2].sum(axis=0) if rng.uniform() < 0.7 else A[0].copy()
    if not equalities:
        return LinearProgram(c, A, b)
    direction = rng.normal(size=(1, n))
    return LinearProgram(c, A, b, direction, 0.1 * rng.normal(size=1))


@pytest.mark.parametrize("equalities", [False, True])
def test_the_nearest_optimum_is_optimal_and_nothing_optimal_is_nearer(equalities):
    """Beside a solver for general problems, which starts from the answer."""
    rng = np.random.default_rng(1)
    moved = 0
    for _ in range(40):
        program = random_program(rng, equalities=equalities)
        best = maximize(program)
        assert isinstance(best, Optimum)
        x = ties.nearest_optimum(program, best)
        least = best.value - ties.SAME_VALUE * (1.0 + abs(best.value))
        assert program.c @ x >= least - ties.FEASIBLE
        assert (program.A @ x - program.b).max() <= ties.FEASIBLE
        conditions = [
            {"type": "ineq", "fun": lambda v, p=program: p.b - p.A @ v},
            {"type": "ineq", "fun": lambda v, p=program, least=least: p.c @ v - least},
        ]
        if equalities:
            np.testing.assert_allclose(program.A_eq @ x, program.b_eq, atol=ties.FEASIBLE)
            conditions.append({"type": "eq", "fun": lambda v, p=program: p.A_eq @ v - p.b_eq})
        other = minimize(lambda v: v @ v, x, jac=lambda v: 2.0 * v, constraints=conditions,
                         method="SLSQP")  # fmt: skip
        assert other.fun >= x @ x - 1e-6 * (1.0 + x @ x)
        moved += np.abs(x - best.x).max() > 1e-3
    assert moved > 20


def disc_in_a_rectangle(angle):
    """The largest disc, over its centre and radius: it may be anywhere along the middle."""
    outward = np.array([[math.cos(a), math.sin(a)] for a in angle + np.arange(4) * math.pi / 2.0])
    rows = np.column_stack([outward, np.ones(4)])
    return LinearProgram(np.array([0.0, 0.0, 1.0]), rows, np.array([2.0, 1.0, 2.5, 1.0]))


def test_rounding_moves_the_nearest_optimum_by_rounding_where_vertices_jump():
    rng = np.random.default_rng(2)
    jumps = 0
    for angle in np.arange(60) * math.pi / 12.0:
        program = disc_in_a_rectangle(angle)
        again = LinearProgram(*(shaken(rng, each) for each in (program.c, program.A, program.b)))
        one, two = maximize(program), maximize(again)
        near = [ties.nearest_optimum(p, o) for p, o in ((program, one), (again, two))]
        assert np.abs(near[0] - near[1]).max() < 1e-9
        assert np.abs(near[0][:2]).max() < 1e-4
        jumps += np.abs(one.x - two.x).max() > 1e-3
    assert jumps > 5
