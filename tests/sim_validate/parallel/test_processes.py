import pytest

from sim_validate.parallel.processes import each


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_units(jobs):
    assert list(each(abs, range(-20, 0), jobs=jobs)) == list(range(20, 0, -1))


def test_an_error_in_a_unit_reaches_the_caller():
    with pytest.raises(TypeError):
        list(each(abs, [None] * 20, jobs=2))
