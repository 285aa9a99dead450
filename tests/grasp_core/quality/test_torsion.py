"""Wrench limits and Ferrari-Canny quality with torsion, beside hand-worked cases and programs."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.bodies import OPPOSITE
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts
from tests.tampering.table import Limited
from tests.tampering.wrench_bounds import quality, wrench_limit

CASES = 20
LARGEST = 10.0


def drawn(rng, count):
    x, n = random_contacts(rng, count, 0.5)
    mu_t = rng.choice([0.0, 0.05, 0.4], size=count)
    mu_t[0] = 0.2
    return x, n, rng.uniform(0.2, 0.8, size=count), mu_t


def test_two_opposite_fingers_hold_a_twist_and_a_force_as_their_cones_say():
    """A twist about the line: 2 mu_t N. A force across it: 2 mu N. Both at once: an ellipse."""
    twist, pull, both = gc.wrench_limits(
        *OPPOSITE, 0.5, [[0, 0, 0, 1, 0, 0], [0, 1, 0, 0, 0, 0], [0, 1, 0, 0.01, 0, 0]],
        max_normal_force=LARGEST, torsion_m=0.01,
    )  # fmt: skip
    assert twist.limit == pytest.approx(2 * 0.01 * LARGEST, rel=1e-6)
    assert twist.torques == pytest.approx([-0.1, 0.1], rel=1e-6)
    assert pull.limit == pytest.approx(2 * 0.5 * LARGEST, rel=1e-6)
    # at the multiple l each finger carries l / 2 N and l / 200 N m: (l / 10)^2 (1 + 1/4) = 1
    assert both.limit == pytest.approx(LARGEST / np.sqrt(1.25), rel=1e-6)
    for found in (twist, pull, both):
        assert found.verify(*OPPOSITE, 0.5, max_normal_force=LARGEST, torsion_m=0.01)
        assert not found.verify(*OPPOSITE, 0.5, max_normal_force=LARGEST)
        missing = replace(found, torques=None)
        assert not missing.verify(*OPPOSITE, 0.5, max_normal_force=LARGEST, torsion_m=0.01)
    for found in (twist, both):  # the pull needs no torsion
        assert not found.verify(*OPPOSITE, 0.5, max_normal_force=LARGEST, torsion_m=0.009)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_limits_are_proved_and_those_of_the_definition(count):
    rng = np.random.default_rng(count)
    more = 0
    for _ in range(CASES):
        x, n, mu, mu_t = drawn(rng, count)
        load = rng.normal(size=6)
        (found,) = gc.wrench_limits(x, n, mu, load[None], max_normal_force=LARGEST, torsion_m=mu_t)
        known = Limited(found, x, n, mu, LARGEST, np.zeros(3), None, mu_t)
        assert known.verify()
        assert wrench_limit(known)
        hard = gc.wrench_limits(x, n, mu, [load], max_normal_force=LARGEST)[0].limit
        assert found.limit >= hard - 1e-6 * LARGEST
        more += found.limit > 1.01 * hard + 1e-9
    assert more >= CASES // 10


def test_the_quality_of_two_opposite_fingers_is_the_twist_they_hold():
    """With torques over 0.1 m: l1 gives mu_t / 0.1 for the twist, the weakest direction of all."""
    found = gc.ferrari_canny(*OPPOSITE, 0.5, torque_scale=0.1, torsion_m=0.01)
    assert found.verify()
    assert found.lower <= 0.1 <= found.upper * (1 + 1e-9)
    assert found.upper == pytest.approx(0.1, rel=1e-4)
    hard = gc.ferrari_canny(*OPPOSITE, 0.5, torque_scale=0.1)
    # the supports of a set without extent along the twist are zero but for rounding
    assert hard.upper <= 1e-12


def test_no_direction_that_a_descent_finds_has_less_support_than_the_quality():
    rng = np.random.default_rng(8)
    inside = 0
    for _ in range(3):
        _, _, mu, mu_t = drawn(rng, 4)
        x, n = TETRA_CENTERS + 0.2 * rng.normal(size=(4, 3)), TETRA_NORMALS
        found = gc.ferrari_canny(
            x, n, mu, center=x.mean(axis=0), torque_scale=1.0, gap=0.05, torsion_m=mu_t
        )
        assert found.verify()
        assert quality(found, rng)
        inside += found.lower > 0.0
    assert inside >= 1


def test_torsion_of_zero_changes_no_field():
    rng = np.random.default_rng(2)
    x, n, mu, _ = drawn(rng, 4)
    load = rng.normal(size=(3, 6))
    plain = gc.wrench_limits(x, n, mu, load, max_normal_force=LARGEST)
    assert plain == gc.wrench_limits(x, n, mu, load, max_normal_force=LARGEST, torsion_m=0.0)
    assert all(found.torques is None for found in plain)
    plain = gc.ferrari_canny(x, n, mu, torque_scale=1.0)
    assert plain == gc.ferrari_canny(x, n, mu, torque_scale=1.0, torsion_m=np.zeros(4))


def test_torsion_and_motors_together_are_refused():
    motors = gc.Motors(np.ones((2, 6)), np.ones(2), np.zeros(2))
    with pytest.raises(gc.InputError, match="torsion_m must be zero with motors"):
        gc.wrench_limits(
            *OPPOSITE, 0.5, np.eye(6), max_normal_force=LARGEST, motors=motors, torsion_m=0.01
        )
