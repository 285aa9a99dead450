"""The critical friction of contacts with torsion, beside closed forms and certificates."""

import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import unit_size
from grasp_core.closure.critical_friction import soft_ends
from grasp_core.closure.proofs import ContactCones, proves_closure, refutes_closure
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


def test_a_twist_that_torsion_shares_needs_less_friction():
    rng = np.random.default_rng(1)
    less = 0
    for _ in range(CASES):
        x, n = random_contacts(rng, 4, 0.7)
        hard = gc.critical_friction(x, n)
        some, more = (gc.critical_friction(x, n, torsion_m=t) for t in (0.1, 0.4))
        assert more <= some * (1 + 1e-7) <= hard * (1 + 2e-7)
        less += more < 0.99 * hard
    assert less >= CASES // 4


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


def proved(found):
    at = found.cones.at_friction
    below = found.twist is None or refutes_closure(at(found.lower), found.twist)
    return below and (found.forces is None or proves_closure(at(found.upper), found.forces))


def test_the_interval_proves_both_ends_and_is_narrow():
    rng = np.random.default_rng(9)
    narrow = 0
    for _ in range(CASES):
        x, n = random_contacts(rng, 3, 0.5)
        cones = ContactCones.at(unit_size(x)[0], n, np.ones(3), np.full(3, 0.2))
        found = soft_ends(cones, gc.critical_friction(x, n) or 1.0)
        assert proved(found)
        if 1e-3 < found.upper < math.inf:
            assert found.upper - found.lower <= 1e-7 * found.upper
            narrow += 1
            found.upper *= 0.999  # teeth: below the threshold nothing closes
            assert not proved(found)
    assert narrow >= CASES // 4


def test_torsion_of_zero_changes_no_digit():
    rng = np.random.default_rng(4)
    for _ in range(20):
        x, n = random_contacts(rng, 4, 0.7)
        assert gc.critical_friction(x, n) == gc.critical_friction(x, n, torsion_m=np.zeros(4))
