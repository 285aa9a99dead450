"""Contacts with torsion: force closure and critical friction by hand and by the definition."""

import math

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.bodies import OPPOSITE
from tests.judges import random_contacts, random_rotation
from tests.tampering import exact_closure

CASES = 40
CLOSE = 1e-6
"""Distance from the critical friction, relative to it, at which certificates are asked for: twenty
times the width of the interval."""


def drawn(rng, count):
    x, n = random_contacts(rng, count, rng.choice([0.3, 0.7]))
    if count == 2 and rng.uniform() < 0.5:  # two are rarely closed unless they are opposite
        x[1], n[1] = -x[0] + 0.1 * rng.normal(size=3), -n[0]
    mu_t = rng.choice([0.0, 0.05, 0.4], size=count)
    mu_t[0] = 0.1
    return 0.05 * x, n, rng.uniform(0.1, 0.8, size=count), 0.05 * mu_t


def test_two_opposite_soft_fingers_close_and_hard_ones_never_do():
    """Each pushes with half of the sum, so its depth in the cone is mu / 2."""
    hard = gc.force_closure(*OPPOSITE, 1.0)
    assert hard.closed is False
    assert hard.verify()
    for torsion_m in (1e-4, 0.01, [0.01, 0.0]):
        soft = gc.force_closure(*OPPOSITE, 0.5, torsion_m=torsion_m)
        assert soft.closed
        assert soft.verify()
        assert soft.margin == pytest.approx(0.25, rel=1e-6)
    assert gc.critical_friction(*OPPOSITE, torsion_m=0.005) == 0.0


@pytest.mark.parametrize("count", [2, 3])
def test_verdicts_and_margins_are_those_of_the_definition(count):
    rng = np.random.default_rng(count)
    seen = {True: 0, False: 0}
    for _ in range(CASES):
        x, n, mu, mu_t = drawn(rng, count)
        found = gc.force_closure(x, n, mu, torsion_m=mu_t)
        assert found.verify()
        assert exact_closure.closure(found)
        seen[found.closed] += 1
    assert min(seen.values()) >= 3


def test_more_torsion_never_loses_closure_and_motions_change_nothing():
    rng = np.random.default_rng(6)
    closed = 0
    for _ in range(CASES):
        x, n, mu, mu_t = drawn(rng, 3)
        found = gc.force_closure(x, n, mu, torsion_m=mu_t)
        closed += found.closed
        more = gc.force_closure(x, n, mu, torsion_m=2.0 * mu_t)
        assert more.closed or not found.closed
        R = random_rotation(rng)
        moved = gc.force_closure(20.0 * x @ R.T + 1.0, n @ R.T, mu, torsion_m=20.0 * mu_t)
        assert moved.closed is found.closed
        # both optima are good to the conic solver's 1e-9, and allow for rounding alike
        assert moved.margin == pytest.approx(found.margin, abs=1e-7)
    assert closed >= 5


def test_torsion_without_friction_is_refused():
    with pytest.raises(gc.InputError, match="torsion_m must be zero where friction is"):
        gc.force_closure(*OPPOSITE, 0.0, torsion_m=0.01)


@pytest.mark.parametrize("offset", [0.01, 0.05, 0.2])
def test_two_offset_fingers_need_the_slope_of_the_line_between_them(offset):
    x = np.array([[-0.05, offset / 2, 0], [0.05, -offset / 2, 0]])
    n = np.array([[1.0, 0, 0], [-1, 0, 0]])
    assert gc.critical_friction(x, n) == math.inf
    found = gc.critical_friction(x, n, torsion_m=0.005)
    assert found == pytest.approx(offset / 0.1, rel=1e-7)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_certificates_on_both_sides_of_the_critical_friction_agree(count):
    rng = np.random.default_rng(count)
    finite = 0
    for _ in range(20):
        x, n = random_contacts(rng, count, 0.5)
        mu_t = rng.choice([0.0, 0.1, 0.4], size=count)
        mu_t[-1] = 0.2
        critical = gc.critical_friction(x, n, torsion_m=mu_t)
        if not 1e-3 < critical < math.inf:
            continue
        finite += 1
        above = gc.force_closure(x, n, critical * (1 + CLOSE), torsion_m=mu_t)
        below = gc.force_closure(x, n, critical * (1 - CLOSE), torsion_m=mu_t)
        assert above.closed
        assert above.verify()
        assert not below.closed
        assert below.verify()
    assert finite >= 5
