"""False verdicts on force closure, and false critical frictions.

What is true is shown by forces and twists in rational arithmetic, and margins by conic programs.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np

import grasp_core as gc
from grasp_core.closure import closure_certificate as closure
from grasp_core.closure import friction_interval
from tests.attacks.searching import Attack, power, tiny
from tests.grasp_core.exact_judges import closed_exactly, open_exactly
from tests.judges import random_contacts
from tests.tampering.exact_closure import margin_of

SEEDS = 16
SURE = 1e-6
"""How far margins are moved past what a program finds, at least."""


@cache
def needed(seed):
    """A critical friction, both ends of which are shown in rational arithmetic."""
    while True:
        rng = np.random.default_rng(seed)
        x, n = random_contacts(rng, int(rng.integers(3, 7)), rng.choice([0.3, 0.7]))
        found = gc.critical_friction_interval(x, n)
        known = 1e-3 < found.lower <= found.upper < 10.0
        known = known and closed_exactly(found.forces, x, n, found.upper)
        if known and open_exactly(found.twist, x, n, found.lower):
            return found
        seed += 1000


@cache
def verdicts(seed):
    """Genuine verdicts next to the critical friction, closed and open, with their optima."""
    found = needed(seed)
    x, n = found.positions, found.normals
    both = []
    for friction in (found.upper * 1.01, found.lower * 0.99):
        mu = np.full(len(x), friction)
        both.append((gc.force_closure(x, n, mu), margin_of(x, n, mu)))
    return both


def any_seed(rng):
    return int(rng.integers(SEEDS))


def about_origin(twist, x):
    return np.concatenate([twist[:3] - np.cross(twist[3:], x), twist[3:]])


def separating(rng, found):
    """A twist near one that separates at slightly less friction, as short as it may be."""
    y = about_origin(found.twist, found.positions[0])
    y = y + power(rng, -16, -4) * np.linalg.norm(y) * rng.normal(size=6) * rng.choice([0.0, 1.0])
    y = y / np.abs(y).max()
    kind = rng.integers(4)
    if kind == 0:
        return y * power(rng, -323, 40)
    if kind == 1:  # squares vanish from 1e-162 on: what is along a cone's side, first
        return y * power(rng, -170, -145)
    return np.ldexp(np.rint(y * rng.uniform(1, 40)), -1074) if kind == 2 else tiny(rng, 6)


def open_though_closed(rng):
    found = needed(any_seed(rng))
    mu = np.full(len(found.normals), found.upper * (1.0 + power(rng, -9, -1)))
    y = separating(rng, found)
    return lambda: gc.ClosureCertificate(
        False, -power(rng, -300, 0) if rng.uniform() < 0.5 else 0.0, found.positions, found.normals,
        mu, None, y,
    )  # fmt: skip


def closed_though_open(rng):
    found = needed(any_seed(rng))
    mu = np.full(len(found.normals), found.lower * (1.0 - power(rng, -9, -1)))
    f = found.forces + power(rng, -14, -1) * rng.normal(size=found.forces.shape) * rng.choice(
        [0.0, np.abs(found.forces).max()]
    )
    f = f / np.einsum("ki,ki->", f, found.normals) * power(rng, -0.01, 0.01)
    return lambda: gc.ClosureCertificate(
        True, power(rng, -300, -6), found.positions, found.normals, mu, f, None
    )


def too_large_a_margin(rng):
    c, optimum = verdicts(any_seed(rng))[0]
    more = optimum + power(rng, -6, 0)
    f = c.forces + power(rng, -12, -3) * rng.normal(size=c.forces.shape) * rng.choice([0.0, 1.0])
    f = f * power(rng, -10, 3) if rng.uniform() < 0.5 else f
    return lambda: replace(c, margin=more, forces=f)


def too_small_a_margin(rng):
    c, optimum = verdicts(any_seed(rng))[1]
    less = min(optimum, 0.0) - power(rng, -6, 6)
    y = c.separating_wrench * power(rng, -323, 40)
    y = y + power(rng, -9, 3) * rng.normal(size=6) * rng.choice([0.0, np.abs(y).max()])
    return lambda: replace(c, margin=less, separating_wrench=y)


CLOSURE = Attack(
    (open_though_closed, closed_though_open, too_large_a_margin, too_small_a_margin),
    (lambda monkeypatch: monkeypatch.setattr(closure, "of_order_one", lambda *arrays: arrays),),
    3000,
)  # fmt: skip


def soft_though_open(rng):
    """Closed with so little torsion that nothing is changed by it."""
    found = needed(any_seed(rng))
    make = open_though_closed(rng)
    mu_t = np.zeros(len(found.normals))
    mu_t[0] = power(rng, -40, -3)
    c = make()
    if len(c.friction) != len(mu_t):
        return None
    return lambda: replace(c, torsion_m=mu_t)


@cache
def soft_verdict(seed):
    """A genuine verdict with torsion, and the optimum of its margin program."""
    found = needed(seed)
    x, n = found.positions, found.normals
    mu, mu_t = np.full(len(x), found.upper * 1.05), np.full(len(x), 0.01 * np.ptp(x))
    return gc.force_closure(x, n, mu, torsion_m=mu_t), margin_of(x, n, mu, mu_t)


def too_large_a_soft_margin(rng):
    c, optimum = soft_verdict(any_seed(rng))
    f = c.forces + power(rng, -12, -3) * rng.normal(size=c.forces.shape) * rng.choice([0.0, 1.0])
    m = c.torques * power(rng, -3, 3)
    more = optimum + power(rng, -6, 0)
    return lambda: replace(c, margin=more, forces=f, torques=m)


SOFT = Attack(
    (soft_though_open, too_large_a_soft_margin),
    (lambda monkeypatch: monkeypatch.setattr(closure, "lower_bound", lambda *_: math.inf),),
    1500,
)  # fmt: skip


def too_low_an_upper_end(rng):
    found = needed(any_seed(rng))
    upper = found.lower * (1.0 - power(rng, -13, 0))
    f = found.forces * power(rng, -40, 40)
    f = f + power(rng, -16, 3) * rng.normal(size=f.shape) * np.abs(f).max()
    f = np.ldexp(np.rint(found.forces * 9), -1074) if rng.uniform() < 0.2 else f
    return lambda: replace(found, lower=0.0, twist=None, upper=upper, forces=f)


def too_high_a_lower_end(rng):
    found = needed(any_seed(rng))
    lower = found.upper * (1.0 + power(rng, -13, 3)) if rng.uniform() < 0.8 else math.inf
    y = found.twist + power(rng, -16, 0) * rng.normal(size=6) * rng.choice([0.0, 1.0])
    y = tiny(rng, 6) if rng.uniform() < 0.2 else y * power(rng, -320, 40)
    return lambda: replace(found, lower=lower, upper=math.inf, twist=y, forces=None)


@cache
def near_a_line(seed):
    """Contacts next to a line, two of which are next to each other, closed at some friction."""
    while True:
        rng = np.random.default_rng(seed)
        s, d = 1e-5, np.nextafter(1e-9, 1.0)
        x = np.vstack([np.zeros(3), [d, 0, 0], [1.0, 0, 0], s * rng.normal(size=(6, 3))])
        x[3:, 0] = rng.uniform(-0.9, 0.9, size=6)
        n = rng.normal(size=(9, 3))
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        try:
            found = gc.critical_friction_interval(x, n)
        except gc.GraspError:
            found = None
        known = found is not None and found.upper < 100.0
        if known and closed_exactly(found.forces, x, n, found.upper):
            return found
        seed += 1000


def put_to_rest(rng):
    """A turn that is mostly one which the proof takes away, so that nearly nothing is left."""
    found = near_a_line(int(rng.integers(4)))
    t, turn = power(rng, -9, -5), rng.uniform(0, 2 * np.pi)
    y = np.array([0, 0, 0, t, np.cos(turn), np.sin(turn)])
    lower = found.upper * (1.0 + power(rng, -6, 3)) if rng.uniform() < 0.5 else math.inf
    return lambda: replace(found, lower=lower, upper=math.inf, twist=y, forces=None)


def nearly_at_rest(monkeypatch):
    """Speeds of a ten-thousandth of what is left of a twist count as none."""
    monkeypatch.setattr(friction_interval, "RESTING_INVERSE", 10**4)


FRICTION = Attack(
    (too_low_an_upper_end, too_high_a_lower_end, put_to_rest), (nearly_at_rest,), 2000
)
