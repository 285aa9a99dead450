"""False bounds on all grasps of an object: trees that refute what known contacts reach.

What contacts reach is the ball in the hull of edges of their cones, by qhull.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from grasp_core.optimizing import best_grasp as result
from grasp_core.optimizing.support_cuts import CutTree
from grasp_core.quality.ferrari_canny import FerrariCanny
from tests.attacks.searching import Attack, always, power
from tests.attacks.wrench_sets import hull_radius
from tests.tampering import table

TREES = 3


@cache
def known(seed):
    """A genuine best grasp, and a quality that its contacts reach for certain."""
    found = table.best(seed)
    return found, hull_radius(found.quality.wrenches, 16)


def changed_deeds(t, rng):
    """The steps of a tree, some of them left out, said twice, put elsewhere or about others."""
    deeds, asked = t.deeds.copy(), t.asked.copy()
    n, kind = len(deeds), rng.integers(7)
    at = int(rng.integers(n))
    some = slice(at, at + int(rng.integers(1, 20)))
    if kind == 0:
        deeds[at] = rng.integers(0, 40)
    elif kind == 1:
        asked[at] = rng.integers(max(len(t.twists), len(t.lines), 1) + 1)
    elif kind == 2:
        deeds[some] = 0
    elif kind == 3:
        deeds, asked = np.delete(deeds, some), np.delete(asked, some)
    elif kind == 4:
        deeds, asked = deeds[:at], asked[:at]
    elif kind == 5:
        deeds, asked = (np.insert(each, at, each[some]) for each in (deeds, asked))
    else:
        deeds = np.where(rng.uniform(size=n) < 0.5, deeds & 15, deeds)
    return {"deeds": deeds, "asked": asked}


def changed_numbers(t, rng):
    """Twists as long as allowed and lines of any length, or with no digits."""
    s = rng.choice([1.0 + 1e-12, 1.5, 2.0, 2.0 + 1e-12])
    lines = t.lines * 10.0 ** rng.choice([-300.0, -323.0, 0.0, 49.0])
    if len(lines) and rng.uniform() < 0.3:
        lines = rng.permutation(lines)
    twists = t.twists / np.linalg.norm(t.twists, axis=1, keepdims=True) * s
    return {"twists": twists, "lines": lines}


def more_maps(t, rng):
    """Maps that are no symmetries, or next to nothing, in any number."""
    angle = rng.choice([1e-10, 1e-9, 2e-9, 1e-8, np.pi, 2 * np.pi / 3])
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    maps = [np.linalg.matrix_power(turn, k) for k in range(int(rng.choice([2, 3, 4, 128])))]
    kept = t.maps if rng.uniform() < 0.3 else np.array(maps)
    return {"maps": kept[: int(rng.integers(1, len(kept) + 1))]}


def lowered(t, reach, rng):
    """A tree with a threshold that contacts reach by far more than rounding, and other fields."""
    low = max((reach - (t.bound - t.threshold)) * (1.0 - power(rng, -6, -0.1)), 1e-6)
    ways = [changed_deeds, changed_numbers, more_maps]
    changed = {}
    for way in rng.permutation(3)[: rng.integers(0, 3)]:
        changed |= ways[way](t, rng)
    most = (t.bound - t.threshold) if "maps" not in changed else 3e-7
    low = min(low, max(reach - most, 1e-6) * (1.0 - 1e-6))
    return lambda: replace(t, threshold=low, **changed)


def lower_bounds(rng):
    found, reach = known(int(rng.integers(TREES)))
    return lowered(found.proof, reach, rng)


def lower_best(rng):
    """A best grasp whose bound is too low, or whose quality is larger than it can be."""
    found, reach = known(int(rng.integers(TREES)))
    if rng.uniform() < 0.5:
        make = lowered(found.proof, reach, rng)
        grown = replace(found.quality, lower=min(found.quality.lower, reach * 0.1))
        return lambda: replace(found, proof=make(), quality=grown)
    q = found.quality
    lower = q.upper * (1.0 + power(rng, -6, 0))
    return lambda: replace(found, quality=replace(q, lower=lower, upper=lower))


def unreplayed(monkeypatch):
    """Trees are not replayed."""
    monkeypatch.setattr(CutTree, "_replayed", always(True))


def any_quality(monkeypatch):
    """Qualities are believed."""
    monkeypatch.setattr(FerrariCanny, "verify", always(True))
    monkeypatch.setattr(result, "are_contacts_of", always(True))


TREE = Attack((lower_bounds,), (unreplayed,), 2000)
BEST = Attack((lower_best,), (unreplayed, any_quality), 600)
