import math

import numpy as np
import pytest

from grasp_core.arrays import frozen, frozen_indices, frozen_units, to_digits
from grasp_core.errors import InputError


def test_a_frozen_array_is_a_read_only_copy():
    source = np.arange(3.0)
    kept = frozen(source, (3,), "v")
    source[0] = 9.0
    assert kept[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1.0, 2.0], r"v must have shape \(3,\), got \(2,\)"),
        ([1.0, np.nan, 0.0], "v must be finite"),
        ([1.0, np.inf, 0.0], "v must be finite"),
        (["a", "b", "c"], "v must be an array of numbers"),
    ],
)
def test_a_bad_array_is_refused_by_name(value, message):
    with pytest.raises(InputError, match=message):
        frozen(value, (3,), "v")


def test_a_vector_that_is_not_unit_is_refused_with_its_length():
    with pytest.raises(InputError, match="normal must have length 1, got 2"):
        frozen_units([0.0, 0.0, 2.0], (3,), "normal")


@pytest.mark.parametrize("bad", [[0.5], [-1]])
def test_indices_are_whole_and_not_negative(bad):
    with pytest.raises(InputError, match="whole numbers"):
        frozen_indices(bad, (None,), "i")


@pytest.mark.parametrize("largest", [1.0, 0.05, 3.0, 1e-3, 120.0])
def test_numbers_apart_by_their_last_bits_are_rounded_to_the_same(largest):
    values = largest * np.array([1.0, -1.0, 0.5, 1 / 3, math.sqrt(0.5), 0.0, -1e-17])
    rounded = to_digits(values)
    for nudged in (np.nextafter(values, -np.inf), np.nextafter(values, np.inf)):
        np.testing.assert_array_equal(to_digits(nudged), rounded)
    np.testing.assert_allclose(rounded, values, rtol=0.0, atol=1e-8 * largest)
    assert not np.signbit(rounded[-2:]).any()
