"""Limits of wrenches in exact arithmetic: forces are corrected, and judged, as fractions."""

from dataclasses import replace
from fractions import Fraction
from math import isqrt
from types import SimpleNamespace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from scenes.example_objects import example_object
from tests.grasp_core.execution.jointed import hand_of
from tests.judges import random_contacts

LARGEST = 3.0
DIGITS = 10**60
UNSEEN = 1e-9
"""Load beyond a limit that checks do see, whatever its size: balances are checked to less than a
billionth of the largest force."""


def exact(array):
    return np.vectorize(Fraction, otypes=[object])(np.asarray(array, dtype=float))


def solved(A, b):
    """Solve A x = b by elimination, in fractions."""
    rows = np.column_stack([A, b])
    for i in range(len(rows)):
        pivot = i + next(j for j, row in enumerate(rows[i:]) if row[i] != 0)
        rows[[i, pivot]] = rows[[pivot, i]]
        rows[i] = rows[i] / rows[i][i]
        for j in range(len(rows)):
            if j != i:
                rows[j] = rows[j] - rows[j][i] * rows[i]
    return rows[:, -1]


def wrenches(x):
    """The matrix from stacked forces to their wrench about the origin, in fractions."""
    one, zero = Fraction(1), Fraction(0)
    return np.hstack([
        np.array([
            [one, zero, zero], [zero, one, zero], [zero, zero, one],
            [zero, -c, b], [c, zero, -a], [-b, a, zero],
        ])
        for a, b, c in x
    ])  # fmt: skip


def is_resisted(found, x, n, mu, motors=None, most=LARGEST):
    """Whether forces balance the limit's multiple exactly, in exact cones, limits and torques."""
    x, n, mu = exact(x), exact(n), Fraction(mu)
    G, f = wrenches(x), exact(found.forces).ravel()
    left = G @ f + Fraction(found.limit) * exact(found.wrench)
    f = f - G.T @ solved(G @ G.T, left)
    assert not (G @ f + Fraction(found.limit) * exact(found.wrench)).any()
    for each, normal in zip(f.reshape(-1, 3), n, strict=True):
        along, square, length = each @ normal, each @ each, normal @ normal
        if along < 0 or square * length - along**2 > mu**2 * along**2:
            return False
        if along**2 > Fraction(most) ** 2 * length:
            return False
    if motors is None:
        return True
    torques = exact(motors.levers) @ f + exact(motors.gravity)
    return bool((abs(torques) <= exact(motors.limits)).all())


def root(square):
    """A number that is no less than the root of a fraction, by 60 digits at most."""
    return Fraction(isqrt(int(square * DIGITS**2)) + 1, DIGITS)


def is_above(found, x, n, mu):
    """Whether the facet proves the upper bound, with roots rounded up."""
    x, n, y = exact(x), exact(n), exact(found.facet)
    velocities, mu = (wrenches(x).T @ y).reshape(-1, 3), Fraction(mu)
    pushed = Fraction(0)
    for v, normal in zip(velocities, n, strict=True):
        length = normal @ normal
        along = (v @ normal) / root(length)
        pushed += max(Fraction(0), along + mu * root(v @ v - (v @ normal) ** 2 / length))
    return Fraction(LARGEST) * pushed <= Fraction(found.upper) * -(y @ exact(found.wrench))


@pytest.mark.parametrize(("above", "gap"), [(0.5, 1e-8), (1e-2, 1e-6), (1e-4, 1e-4), (1e-6, 1e-2)])
def test_limits_near_the_critical_friction_are_attained_in_exact_arithmetic(above, gap):
    rng, near = np.random.default_rng(3), 0
    for case in range(4):
        x, n = random_contacts(rng)
        mu = gc.critical_friction(x, n) * (1.0 + above)
        motors = hand_of(rng, 4, 0.5) if case % 2 else None
        given = {"max_normal_force": LARGEST, "motors": motors}
        for found in gc.wrench_limits(x, n, mu, rng.normal(size=(2, 6)), **given):
            assert is_resisted(found, x, n, mu, motors)
            assert found.limit > 0.0
            assert motors is not None or is_above(found, x, n, mu)
            assert found.upper - found.limit <= gap * found.limit
            near += found.limit < above * LARGEST * 10
            assert found.verify(x, n, mu, **given)
            # a limit that is a little larger is not attained by these forces
            larger = found.limit * (1.0 + 1e-6) + UNSEEN
            more = replace(found, limit=larger, upper=2.0 * found.upper)
            assert not more.verify(x, n, mu, **given)
            less = replace(found, limit=0.0, forces=0.0 * found.forces, upper=found.limit)
            assert not less.verify(x, n, mu, **given)
    assert near >= 2


def test_contacts_that_can_push_in_no_balance_are_left_out():
    """Two opposite contacts, and one whose push no other balances: it stays at rest."""
    x = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.0, 1.0]])
    n = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    given = {"max_normal_force": LARGEST}
    (found,) = gc.wrench_limits(x, n, 0.1, [[0.0, -1.0, 0.0, 0.0, 0.0, 0.0]], **given)
    assert found.verify(x, n, 0.1, **given)
    assert not found.forces[2].any()
    assert found.limit == pytest.approx(0.2 * LARGEST, rel=1e-8)
    assert found.upper == pytest.approx(found.limit, rel=1e-8)


def test_a_wrench_just_out_of_range_is_not_resisted():
    """Two hard contacts resist no turn about their line, however small."""
    x, n = np.array([[-1.0, 0, 0], [1, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
    given = {"max_normal_force": LARGEST}
    for turn, limit in ((0.0, 0.6 * LARGEST), (1e-9, 0.0)):
        load = [[0.0, 0.0, 1.0, turn, 0.0, 0.0]]
        (found,) = gc.wrench_limits(x, n, 0.3, load, **given)
        assert found.limit == pytest.approx(limit, rel=1e-8, abs=1e-4)
        assert found.verify(x, n, 0.3, **given)


@pytest.mark.parametrize("above", [0.5, 1e-2, 1e-4])
def test_payloads_near_the_critical_friction_are_held_in_exact_arithmetic(above):
    body = example_object("wedge")
    for grasp in gc.plan(body, 0.5, limit=2).grasps:
        mu = gc.critical_friction(grasp) * (1.0 + above)
        found = gc.payload(body, grasp, mu, max_push_n=10.0).free
        assert found.lower > 0.0
        for gravity, forces in zip(found.gravities, found.forces, strict=True):
            weight = np.append(GRAVITY_M_PER_S2 * found.lower * gravity, np.zeros(3))
            held = SimpleNamespace(limit=1.0, wrench=weight, forces=forces)
            x, n = grasp.positions - body.center_of_mass, grasp.normals
            assert is_resisted(held, x, n, mu, most=10.0)
        assert found.verify()
        assert not replace(found, forces=found.forces * (1.0 + 1e-8)).verify()
        more = replace(found, lower=found.lower * (1.0 + 1e-6), upper=2.0 * found.upper)
        assert not more.verify()


def test_what_some_contacts_resist_alone_is_resisted_with_others_beside():
    """Contacts at random, of which one or two push inside their cones, and the rest cannot."""
    rng, tested = np.random.default_rng(5), 0
    for _ in range(50):
        count = int(rng.integers(2, 7))
        x, n = rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        forces = np.zeros((count, 3))
        for i in range(int(rng.integers(1, 3))):
            across = np.cross(n[i], rng.normal(size=3))
            forces[i] = n[i] + 0.2 * across / np.linalg.norm(across)
        load = -np.append(forces.sum(axis=0), np.cross(x, forces).sum(axis=0))
        (found,) = gc.wrench_limits(x, n, 0.4, load[None], max_normal_force=LARGEST)
        assert found.limit >= LARGEST * (1.0 - 1e-6)
        assert found.upper <= found.limit * (1.0 + 1e-6)
        assert found.verify(x, n, 0.4, max_normal_force=LARGEST)
        tested += not gc.force_closure(x, n, 0.4).closed
    assert tested >= 35
