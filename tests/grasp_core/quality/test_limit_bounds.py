"""Bounds on limits beside the limits that the conic program finds and proves."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.quality import limit_bounds
from grasp_core.quality.wrench_limits import body_of, limit_of
from tests.judges import random_contacts

GAP = 1e-3
ROUNDING = 1e-6


def closed_contacts(rng, count, soft):
    """Random contacts in closure: where they are, with what friction and torsion, and forces."""
    while True:
        x, n = random_contacts(rng, count, 0.5)
        mu = rng.uniform(0.2, 0.8, count)
        mu_t = rng.choice([0.0, 0.05, 0.4], count) if soft else np.zeros(count)
        found = gc.force_closure(x, n, mu, torsion_m=mu_t)
        if found.closed:
            return x, n, mu, mu_t, found


def bounded(x, n, mu, mu_t, found, loads):
    """Bounds on each load and its limit, (loads, 3), for a largest push of 1 N."""
    body = body_of(x, n, mu, 1.0, None, mu_t)
    forces = body.in_frames(found.forces, found.torques)
    both = limit_bounds.limit_bounds(body.bounded, forces, body.about_middle(loads), GAP)
    return np.column_stack([both, [limit_of(body, load).limit for load in loads]])


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("count", [3, 4, 6])
def test_bounds_hold_the_limit_between_them_and_meet(count, soft):
    rng = np.random.default_rng(count)
    for _ in range(5):
        lower, upper, limit = bounded(
            *closed_contacts(rng, count, soft), rng.normal(size=(20, 6))
        ).T
        assert (upper - lower <= GAP * lower).all()
        assert (lower <= limit * (1.0 + ROUNDING)).all()
        assert (limit <= upper * (1.0 + ROUNDING)).all()


def test_after_one_step_bounds_hold_and_are_far_apart(monkeypatch):
    monkeypatch.setattr(limit_bounds, "MOST_STEPS", 1)
    rng = np.random.default_rng(0)
    lower, upper, limit = bounded(*closed_contacts(rng, 4, False), rng.normal(size=(20, 6))).T
    assert ((lower <= limit) & (limit <= upper)).all()
    assert (upper > 1.02 * lower).all()


@pytest.mark.parametrize("share", [1e-2, 1e-4, 1e-6])
def test_next_to_the_critical_friction_bounds_hold_or_do_not_meet(share):
    """Rounding leaves forces out of balance there, which the lower bound has to pay for."""
    rng = np.random.default_rng(1)
    for _ in range(5):
        x, n, *_ = closed_contacts(rng, 4, False)
        mu = gc.critical_friction(x, n) * (1.0 + share)
        found = gc.force_closure(x, n, mu)
        lower, upper, limit = bounded(x, n, mu, 0.0, found, rng.normal(size=(20, 6))).T
        met = upper - lower <= GAP * lower
        assert met.all() or share < 1e-2
        assert (np.abs(lower - limit) <= 2.0 * GAP * limit)[met].all()
        assert (limit <= upper * (1.0 + GAP)).all()


def test_a_contact_without_friction_has_a_place_among_others():
    rng = np.random.default_rng(2)
    x, n, mu, mu_t, _ = closed_contacts(rng, 6, False)
    mu[0] = 0.0
    found = gc.force_closure(x, n, mu)
    assert found.closed
    lower, upper, limit = bounded(x, n, mu, mu_t, found, rng.normal(size=(10, 6))).T
    assert (upper - lower <= GAP * lower).all()
    assert ((lower <= limit * (1.0 + ROUNDING)) & (limit <= upper * (1.0 + ROUNDING))).all()
