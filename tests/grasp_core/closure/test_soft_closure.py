"""Force closure of contacts with torsion, beside hand-worked cases, pyramids and samples."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.soft_cones import OPPOSITE, ball_edges, inradius, wrenches_of
from tests.judges import PROVED, least_weight_program, random_contacts, random_rotation

CASES = 60
SAMPLES = 400


def closed_by_program(x, n, mu, mu_t, edges):
    """Whether positive weights balance the edges' wrenches, at unit size and of rank six."""
    arms = x - x.mean(axis=0)
    size = np.linalg.norm(arms, axis=1).max()
    W = wrenches_of(arms / size, n, mu, mu_t / size, edges)
    weights, _ = least_weight_program(W)
    return np.linalg.matrix_rank(W, 1e-9) == 6 and weights.min() > PROVED


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


def test_torsion_adds_what_a_missing_turn_about_one_axis_needs():
    """Three hard fingers in a plane at 120 degrees lack nothing; two hard and one soft lack none.

    Two opposite hard fingers leave the turn about their line. A third, soft one, whose normal is
    across that line, holds the turn by sliding; one whose line of force meets the line at a right
    angle and has no lever does not, but its torsion has no part along the line either.
    """
    x = np.array([[-0.05, 0, 0], [0.05, 0, 0], [0.05, 0, 0]])
    n = np.array([[1.0, 0, 0], [-1, 0, 0], [-1, 0, 0]])
    assert gc.force_closure(x, n, 0.5).closed is False
    for third, closed in ((0.01, True), (0.0, False)):
        found = gc.force_closure(x, n, 0.5, torsion_m=[0.0, 0.0, third])
        assert found.closed is closed
        assert found.verify()


@pytest.mark.parametrize("count", [2, 3])
def test_pyramids_inside_and_around_the_cones_agree(count):
    """Pyramids inside that close prove closure, pyramids around that do not prove the opposite."""
    rng = np.random.default_rng(count)
    inner, outer = ball_edges(12), ball_edges(24) / inradius(24)
    seen = {True: 0, False: 0}
    for _ in range(CASES):
        x, n, mu, mu_t = drawn(rng, count)
        found = gc.force_closure(x, n, mu, torsion_m=mu_t)
        assert found.verify()
        seen[found.closed] += 1
        if closed_by_program(x, n, mu, mu_t, inner):
            assert found.closed
        if not closed_by_program(x, n, mu, mu_t, outer):
            assert not found.closed
    assert min(seen.values()) >= 3


def test_no_force_and_torque_in_a_cone_works_along_a_separating_wrench():
    rng = np.random.default_rng(5)
    separated = 0
    for _ in range(CASES):
        x, n, mu, mu_t = drawn(rng, 3)
        found = gc.force_closure(x, n, mu, torsion_m=mu_t)
        if found.closed:
            continue
        separated += 1
        ways = rng.normal(size=(SAMPLES, 3))
        ways *= rng.uniform(size=(SAMPLES, 1)) ** (1 / 3) / np.linalg.norm(ways, axis=1)[:, None]
        y = found.separating_wrench
        for point, normal, friction, torsion in zip(x, n, mu, mu_t, strict=True):
            tangents = np.linalg.svd(normal[None])[2][1:]
            f = normal + friction * ways[:, :2] @ tangents
            torque = np.cross(point, f) + np.outer(torsion * ways[:, 2], normal)
            # rounding is relative to the longest arm, some 0.1 m
            assert (f @ y[:3] + torque @ y[3:]).max() <= 1e-11 * np.linalg.norm(y)
    assert separated >= 10


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
    assert closed >= 10


def test_torsion_of_zero_changes_no_field():
    rng = np.random.default_rng(7)
    for count in (2, 3, 4, 5):
        x, n, mu, _ = drawn(rng, count)
        plain, zero = gc.force_closure(x, n, mu), gc.force_closure(x, n, mu, torsion_m=0.0)
        assert plain == zero
        assert plain.torsion_m is None
        assert plain.torques is None
        assert repr(plain) == repr(zero)


def test_a_certificate_holds_for_its_own_torsion_only():
    found = gc.force_closure(*OPPOSITE, 0.5, torsion_m=0.01)
    assert not replace(found, torsion_m=None).verify()
    assert not replace(found, torsion_m=None, torques=None).verify()
    assert not replace(found, torsion_m=np.zeros(2)).verify()
    assert not replace(found, torques=np.array([0.01, 0.0])).verify()
    assert not replace(found, margin=0.26).verify()
    open_ = gc.force_closure(*OPPOSITE, 0.5)
    assert not replace(open_, torsion_m=np.full(2, 0.01)).verify()


def test_torsion_without_friction_is_refused():
    with pytest.raises(gc.InputError, match="torsion_m must be zero where friction is"):
        gc.force_closure(*OPPOSITE, 0.0, torsion_m=0.01)
