"""The entropy of joint angles is that of the shares of records in a hundred bins."""

import math

import numpy as np
import pytest

from sim_validate.protocols.diversity import BINS, joint_entropies

RANGE = (-0.5, 1.5)


def middles(*bins):
    """Angles in the middles of some bins of the range, (n, 1) [rad]."""
    low, high = RANGE
    return low + (np.array(bins)[:, None] + 0.5) * (high - low) / BINS


def entropy(angles, span=RANGE):
    (found,) = joint_entropies(angles, np.array([span]))
    return found


def test_it_is_the_logarithm_of_the_number_of_bins_that_are_used_alike():
    assert entropy(middles(7)) == 0.0
    assert entropy(middles(3, 3, 3, 99)) == pytest.approx(
        -0.75 * math.log(0.75) - 0.25 * math.log(0.25)
    )
    assert entropy(middles(*range(BINS))) == pytest.approx(math.log(100.0))
    assert entropy(middles(*range(BINS), *range(BINS))) == pytest.approx(math.log(100.0))


def test_joints_are_taken_each_by_its_own_range():
    angles = np.hstack([middles(0, 1), 10.0 * middles(0, 1), middles(5, 5)])
    found = joint_entropies(angles, np.array([RANGE, (-50.0, 150.0), RANGE]))
    assert found == pytest.approx([math.log(2.0), 0.0, 0.0])


def test_angles_beyond_the_range_count_at_its_ends():
    angles = np.array([[-9.0], [RANGE[0]], [RANGE[1]], [9.0]])
    assert entropy(angles) == pytest.approx(math.log(2.0))


def test_a_joint_without_a_range_has_a_full_turn_and_one_of_no_width_no_entropy():
    turns = np.linspace(-np.pi, np.pi, BINS, endpoint=False)[:, None] + 1e-3
    assert entropy(turns, (np.nan, np.nan)) == pytest.approx(math.log(100.0))
    assert entropy(np.array([[0.2], [0.2]]), (0.2, 0.2)) == 0.0
