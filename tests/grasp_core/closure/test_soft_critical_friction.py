"""The critical friction of contacts with torsion, beside closed forms and certificates."""

import math

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.bodies import OPPOSITE
from tests.judges import random_contacts

CASES = 20
CLOSE = 1e-6
"""Distance from the critical friction, relative to it, at which certificates are asked for: twenty
times the width of the interval."""


@pytest.mark.parametrize("offset", [0.01, 0.05, 0.2])
def test_two_offset_fingers_need_the_slope_of_the_line_between_them(offset):
    x = np.array([[-0.05, offset / 2, 0], [0.05, -offset / 2, 0]])
    n = np.array([[1.0, 0, 0], [-1, 0, 0]])
    assert gc.critical_friction(x, n) == math.inf
    found = gc.critical_friction(x, n, torsion_m=0.005)
    assert found == pytest.approx(offset / 0.1, rel=1e-7)


def test_opposite_soft_fingers_close_at_any_friction():
    assert gc.critical_friction(*OPPOSITE, torsion_m=0.005) == 0.0


@pytest.mark.parametrize("count", [2, 3, 4])
def test_certificates_agree_on_both_sides(count):
    rng = np.random.default_rng(count)
    finite = 0
    for _ in range(CASES):
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
    assert finite >= CASES // 4
