"""Results are kept by the identity of what was asked for, never by an address alone."""

import pytest

from grasp_core.hands.hand_arrays import kept_by_identity


class Large:
    """A value that must not be compared."""

    def __eq__(self, other):
        pytest.fail("two values were compared")

    __hash__ = None


def test_results_of_the_same_value_are_kept_and_of_another_are_not():
    asked = []

    @kept_by_identity(4)
    def found(value):
        asked.append(value)
        return [value]

    first, second = Large(), Large()
    assert found(first) is found(first)
    assert found(second) is not found(first)
    assert len(asked) == 2
    assert found(second)[0] is second


def test_results_are_those_of_the_value_whatever_the_number_that_is_kept():
    """Values that are thrown away give their addresses to others."""

    @kept_by_identity(3)
    def found(value):
        return value["number"]

    addresses = set()
    for number in range(1000):
        value = {"number": number}
        addresses.add(id(value))
        assert found(value) == number
    assert len(addresses) < 1000
