"""False limits of wrenches, squeezes and payloads.

What contacts resist is found by conic programs of the tests, and directions that they hold least in
by many of them. Bounds are exact but for rounding: what is claimed is false by far more.
"""

from dataclasses import replace
from functools import cache

import numpy as np

import grasp_core as gc
import grasp_core.quality.wrench_limits as checked
from grasp_core.closure.contacts import to_center, to_origin
from grasp_core.execution import carried_mass, squeeze_certificate
from grasp_core.execution.carried_mass import Payload
from grasp_core.execution.squeeze_certificate import Survival
from grasp_core.quality.wrench_limits import body_of
from tests.attacks.searching import Attack, power, tiny
from tests.tampering import table
from tests.tampering.hand_payloads import held
from tests.tampering.squeezes import GRAVITY, largest_scale, responding
from tests.tampering.wrench_bounds import multiple_of

SEEDS = 12
SURE = 1e-8
"""Share of the largest force by which claims are false at least."""


@cache
def limit(seed):
    """A genuine limit, the multiple by a program of the tests, and by how much claims are off."""
    c = table.wrench_limit(seed) if seed % 2 else on_a_line(seed)
    k, most = len(c.positions), c.max_normal_force
    mu = np.full(k, c.friction) if np.ndim(c.friction) == 0 else np.asarray(c.friction)
    load, _, best = multiple_of(c, mu, np.zeros(k))
    off = SURE * most * k * np.sqrt(1.0 + mu.max() ** 2) / np.linalg.norm(load)
    return c, best, off


def on_a_line(seed):
    """Two opposite contacts, which resist no turn about their line, and a load that they resist."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    x, n = np.outer([-0.05, 0.05], turn[0]), np.outer([1.0, -1.0], turn[0])
    f = 10.0 * n + 2.0 * np.outer([1.0, 1.0], turn[1])
    load = -np.append(f.sum(axis=0), np.cross(x, f).sum(axis=0))
    (found,) = gc.wrench_limits(x, n, 0.5, load[None], max_normal_force=10.0)
    return table.Limited(found, x, n, 0.5, 10.0, np.zeros(3), None)


def any_seed(rng):
    return int(rng.integers(SEEDS))


def facet_of(c, rng):
    """A facet of power -1 against the load, as long as one likes in directions without power.

    Half of these are twists on which contact forces have next to no power.
    """
    w = c.found.wrench
    z = rng.normal(size=6)
    if rng.uniform() < 0.5:
        z = weakest_ways(c)[int(rng.integers(3))].copy()
    z -= w * (w @ z) / (w @ w)
    y = c.found.facet * rng.choice([0.0, 1.0]) + power(rng, -6, 25) * z / np.linalg.norm(z)
    return y - w * (y @ w + 1.0) / (w @ w)


def weakest_ways(c):
    """Twists by how little power contact forces have on them, (6, 6)."""
    body = body_of(c.positions - c.center, c.normals, c.friction, c.max_normal_force, c.motors, 0.0)
    return to_origin(np.linalg.svd(body.G)[0].T, body.middle, body.size)[::-1]


def lowered(c, best, off, facet, multipliers, rng):
    upper = max(best * (1.0 - power(rng, -3, 0)) - off, 0.0)
    if upper >= best - 0.5 * off:
        return None
    low = replace(
        c.found, limit=0.0, upper=upper, forces=0.0 * c.found.forces, facet=facet,
        motor_multipliers=multipliers,
    )  # fmt: skip
    return lambda: replace(c, found=low)


def long_facets(rng):
    c, best, off = limit(any_seed(rng))
    facet = facet_of(c, rng)
    return lowered(c, best, off, facet, c.found.motor_multipliers, rng)


def huge_multipliers(rng):
    c, best, off = limit(1 + 2 * int(rng.integers(SEEDS // 2)))
    m = c.found.motor_multipliers * power(rng, 0, 40)
    m += power(rng, 0, 40) * rng.normal(size=len(m)) * rng.choice([0.0, 1.0])
    return lowered(c, best, off, facet_of(c, rng), m, rng)


def higher_limits(rng):
    """Forces grown with the claim, out of their cones, or not balanced."""
    c, best, off = limit(any_seed(rng))
    up = best * (1.0 + power(rng, -4, 3)) + off
    grown = up / c.found.limit if c.found.limit > 0.0 and rng.uniform() < 0.5 else 1.0
    forces = c.found.forces * grown
    forces = forces + power(rng, -12, 0) * c.max_normal_force * rng.normal(size=forces.shape)
    high = replace(c.found, limit=up, upper=max(up, c.found.upper), forces=forces)
    return lambda: replace(c, found=high)


def small_loads(rng):
    """A load of almost nothing, of which forces of nothing resist any multiple."""
    c, best, off = limit(any_seed(rng))
    s = power(rng, -45, 0)
    up = (best + off) / s * (1.0 + power(rng, -4, 1))
    y = c.found.facet / s
    high = replace(c.found, wrench=s * c.found.wrench, limit=up, upper=up, facet=y)
    return lambda: replace(c, found=high)


def any_slack(monkeypatch):
    """A facet's slack grows with its length, as it once did."""

    def bounds(body, found):
        twist = to_center(found.facet, body.middle, body.size)
        far = body.bounded.size * float(np.linalg.norm(twist))
        bound = body.support(found.facet, found.motor_multipliers)
        return bound <= found.upper + 1e-12 * body.max_normal_force * far

    monkeypatch.setattr(checked, "bounds", bounds)


LIMIT = Attack((long_facets, huge_multipliers, higher_limits, small_loads), (any_slack,), 4000)


@cache
def squeeze(seed):
    """A genuine squeeze without offset or motors, and the best scale by a program of the tests."""
    contacts, springs = table.held(seed)
    axes = np.diag(np.repeat([0.5, 0.5 * contacts[0].radius], 3))
    c = gc.best_squeeze(*contacts, gc.LoadSet(np.zeros(6), axes), max_push_n=10.0, **springs)
    frames, _, offset, change = responding(c.grip, c.loads)
    return c, largest_scale(c.grip, frames, offset, change, c)


@cache
def softer(seed, share):
    """A part of a genuine squeeze, with what it survives and the load that ends it."""
    c, best = squeeze(seed)
    grip = c.grip.squeezed(share * c.grip.squeeze)
    survival = Survival.of(grip, c.loads)
    reactions = survival.reactions(grip.local_squeeze)
    angles, scales = reactions.worst_angles()
    first = int(scales.argmin())
    scale = float(scales[first]) * (1.0 - 1e-7)
    return replace(
        c, grip=grip, scale=scale, contact=first, joint=-1,
        direction=reactions.worst_of(first, float(angles[first])),
        proofs=reactions.multipliers(scale),
    ), best  # fmt: skip


def other_multipliers(rng):
    """Multipliers of any length, also so short that their products have no digits."""
    c, best = softer(any_seed(rng), float(rng.choice([0.3, 0.6, 0.9])))
    upper = c.scale * (1.0 + power(rng, -6, -1))
    if upper > 0.99 * best:
        return None
    if rng.uniform() < 0.3:
        y = c.multipliers * 10.0 ** rng.uniform(-30, 30, size=c.multipliers.shape)
        z = c.balance * power(rng, -9, 30)
        return lambda: replace(c, upper=upper, multipliers=y, balance=z)
    y = np.abs(tiny(rng, c.multipliers.shape)) * (rng.uniform(size=c.multipliers.shape) < 0.2)
    kept = np.ldexp(c.multipliers, -int(rng.integers(900, 1075)))
    z = tiny(rng, 6) if rng.uniform() < 0.5 else np.zeros(6)
    return lambda: replace(
        c, upper=upper, multipliers=y if rng.uniform() < 0.5 else kept,
        balance=z if rng.uniform() < 0.5 else c.balance,
    )  # fmt: skip


def surviving_more(rng):
    """A larger scale, with multipliers of the S-lemma, and a squeeze, that would carry it."""
    c, best = squeeze(any_seed(rng))
    scale = best * (1.0 + power(rng, -2.5, 3))
    grown = 1.0 + power(rng, -6, 3) * rng.choice([0.0, 1.0])
    one = np.zeros(c.grip.squeeze.shape)
    i = int(rng.integers(len(one)))
    one[i] = c.grip.normals[i] * power(rng, -7, 1) * rng.choice([0.0, 1.0])
    grip = c.grip.squeezed(grown * c.grip.squeeze + one)
    reactions = Survival.of(grip, c.loads).reactions(grip.local_squeeze)
    proofs = reactions.multipliers(scale) * 10.0 ** rng.choice([0.0, 1.0, 9.0, -9.0])
    return lambda: replace(c, grip=grip, scale=scale, upper=max(scale, c.upper), proofs=proofs)


def kept_values(rng):
    """What a grip has worked out once stands beside its fields, and may be anything."""
    c, best = squeeze(any_seed(rng))
    share = power(rng, -3, -0.5)
    grip = replace(c.grip)
    grip.__dict__["response"] = share * c.grip.response
    scale = c.scale / share
    if scale < 1.01 * best:
        return None
    return lambda: replace(c, grip=grip, scale=scale, upper=c.upper / share * (1.0 + 1e-8))


def short_counts(monkeypatch):
    """Multipliers count at the length at which they come."""
    monkeypatch.setattr(squeeze_certificate, "of_order_one", lambda *arrays: list(arrays))


def keeping(monkeypatch):
    """What a grip has kept counts."""
    monkeypatch.setattr(squeeze_certificate, "replace", lambda value, **_: value)


SQUEEZE = Attack((other_multipliers, surviving_more, kept_values), (short_counts, keeping), 2500)


def holding_most(c):
    """A genuine payload, and the least mass that its hand holds in some orientations."""
    ways = np.random.default_rng(0).normal(size=(40, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return c, min(held(c.hand, way) for way in ways)


@cache
def payload(seed):
    """A genuine payload without motors, and what its forces chosen anew hold."""
    contacts, springs = table.held(seed)
    c = gc.payload(*contacts, max_push_n=10.0, **springs)
    return c.fixed, holding_most(c.free)


@cache
def hand(seed):
    """A genuine payload of a hand, and what it holds."""
    return holding_most(table.hand_payload(seed))


def holds_less(rng, c, least):
    """Facets of any length, also so short that the support of the contacts has no digits."""
    upper = 0.97 * min(least, c.lower) * (1.0 - power(rng, -3, 0))
    if upper <= 0.0:
        return None
    longest = np.abs(np.append(c.facet, c.motor_multipliers)).max()
    if rng.uniform() < 0.7:
        size = rng.uniform(0.6, 9.0) / longest
        last = -int(rng.choice([1074, 1073, 1072]))
        facet = np.ldexp(np.rint(size * c.facet + rng.uniform(-0.5, 0.5, 6)), last)
        m = np.ldexp(np.rint(size * c.motor_multipliers), last)
    else:
        s = power(rng, -330, 40)
        facet = s * (c.facet + power(rng, -6, 1) * rng.normal(size=6))
        m = s * c.motor_multipliers
    return lambda: replace(
        c, lower=0.0, upper=upper, facet=facet, motor_multipliers=m, gravities=c.gravities[:0],
        forces=c.forces[:0], triangles=c.triangles[:0],
    )  # fmt: skip


def holds_more(rng, c, least):
    """Larger hulls, forces that grow with the claim, or triangles that come again."""
    lower = least * (1.0 + power(rng, -3, 3)) + SURE * c.hand.max_push_n / GRAVITY
    g, f = c.gravities * power(rng, -1, 3), c.forces * rng.choice([1.0, lower / c.lower])
    f = f + power(rng, -12, 0) * rng.normal(size=f.shape)
    t = np.vstack([c.triangles] * int(rng.integers(1, 3)))
    return lambda: replace(
        c, lower=lower, upper=max(lower, c.upper), gravities=g, forces=f, triangles=t
    )


def hand_holds_less(rng):
    return holds_less(rng, *hand(any_seed(rng)))


def hand_holds_more(rng):
    return holds_more(rng, *hand(any_seed(rng)))


def contacts_hold_otherwise(rng):
    """A claim about the payload of contacts, beside a genuine squeeze."""
    fixed, known = payload(any_seed(rng))
    free = (holds_less, holds_more)[rng.integers(2)](rng, *known)
    return None if free is None else lambda: Payload(fixed, free())


def short_facets(monkeypatch):
    """Facets count at the length at which they come."""
    monkeypatch.setattr(carried_mass, "of_order_one", lambda *arrays: list(arrays))


PAYLOAD = Attack((contacts_hold_otherwise,), (short_facets,), 1500)
HAND = Attack((hand_holds_less, hand_holds_more), (short_facets,), 2000)
