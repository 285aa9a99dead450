import numpy as np
import pytest

from grasp_core.errors import SolverError
from grasp_core.solvers.conic import ConicProgram, minimize


def test_the_closest_point_of_a_line_to_the_origin():
    """Minimise s with |(x, y)| <= s and x + y = 2: the answer is (1, 1)."""
    A = np.array([[1.0, 1, 0], [0, 0, -1], [-1, 0, 0], [0, -1, 0]])
    answer = minimize(ConicProgram(np.array([0.0, 0, 1]), A, np.array([2.0, 0, 0, 0]), 1, 0, (3,)))
    np.testing.assert_allclose(answer.x, [1.0, 1.0, np.sqrt(2.0)], atol=1e-8)
    assert answer.value == pytest.approx(-(np.array([2.0, 0, 0, 0]) @ answer.z), abs=1e-8)


def test_a_program_without_solution_is_an_error():
    A = np.array([[1.0], [-1.0]])
    with pytest.raises(SolverError):
        minimize(ConicProgram(np.array([1.0]), A, np.array([-1.0, -1.0]), 0, 2))
