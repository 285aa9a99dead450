"""Chooses where the search for a hand's pose starts: postures of the hand, laid over the contacts.

Postures are random joint angles at which the hand is free of itself. For each posture and each
order of fingers, the fingertips are compared with where they would have to be: first by the
distances between them and the angles between their ways inwards, which do not depend on the palm's
pose, then by the rest that is left when one set of points is laid over the other by the best rigid
motion (Kabsch). The motion keeps handedness, so an order of fingers around the palm that runs the
wrong way leaves a large rest.
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.compiled import compiled
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import hand_arrays

POSTURES = 400
"""Number of postures to choose from."""
TRIES = 60_000
"""Number of random joint angles among which they are looked for."""
INNER = (0.1, 0.85)
"""Part of the joints' ranges in which they are looked for: rather open than closed."""
APART = 0.002
"""Least distance between links in a posture [m]."""
WIDEST = 0.075
"""Largest distance of a fingertip from the middle of all [m]."""
KEPT = 300
"""Number of postures with an order of fingers that are laid over the contacts."""
LENGTH = 0.02
"""Difference of two distances between fingertips that counts as one [m]."""
TURN = 0.3
"""Weight of the angles between ways inwards."""
ARM = 0.03
"""Length of the ways inwards where they are laid over each other [m]."""
ROUND = 9
"""Digits after the point to which rests are compared: ties are decided by the order."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Where a search starts."""

    fingers: Indices  # the finger for each contact, (k,)
    joints: Array  # joint angles, (j,) [rad]
    rotation: Array  # axes of the palm's frame, (3, 3)
    position: Array  # its origin, (3,) [m]


@lru_cache(maxsize=16)
def postures(hand: Hand, seed: int) -> tuple[Array, Array]:
    """Choose at most `POSTURES` at random: joint angles, (n, j), and tips' middles, (n, f, 3)."""
    arrays, rng = hand_arrays(hand), np.random.default_rng(seed)
    low, high = arrays.ranges.T
    share = rng.uniform(*INNER, (TRIES, len(low)))
    angles = hand.drives.obeyed(low + (high - low) * share)
    kept, tips = np.empty(POSTURES, np.int64), np.empty((POSTURES + 1, len(arrays.tip_radii), 3))
    kernel = compiled("grasp_core.hands.collisions_kernel")
    count = kernel.free_postures(arrays, angles, APART, WIDEST, kept, tips)
    return angles[kept[:count]], tips[:count]


def starts(hand: Hand, positions: Array, normals: Array, *, seed: int, count: int) -> list[Start]:
    """Choose where to start from, best first."""
    (joints, ends), arrays = postures(hand, seed), hand_arrays(hand)
    if not len(joints):
        return []
    orders = np.array(list(itertools.permutations(range(len(arrays.tip_radii)), len(normals))))
    inward = ends.mean(axis=1, keepdims=True) - ends
    inward /= np.maximum(np.linalg.norm(inward, axis=2, keepdims=True), 1e-9)
    i, j = np.triu_indices(len(normals), 1)
    # all tips of a hand are taken to be as thick as the first
    middles = positions - arrays.tip_radii[0] * normals
    apart = np.linalg.norm(middles[i] - middles[j], axis=1)
    angles = np.einsum("pi,pi->p", normals[i], normals[j])
    between = np.linalg.norm(ends[:, :, None] - ends[:, None], axis=3)
    ways = np.einsum("nai,nbi->nab", inward, inward)
    one, other = orders[:, i], orders[:, j]
    off = ((between[:, one, other] - apart) ** 2).sum(axis=2) / LENGTH**2
    off += TURN * ((ways[:, one, other] - angles) ** 2).sum(axis=2)
    likely = np.argsort(off.round(ROUND), axis=None, kind="stable")[:KEPT]
    which, order = np.unravel_index(likely, off.shape)
    tips = ends[which[:, None], orders[order]]
    held = tips.mean(axis=1)
    ours = np.concatenate([tips - held[:, None], ARM * inward[which[:, None], orders[order]]], 1)
    center = middles.mean(axis=0)
    theirs = np.concatenate([middles - center, ARM * normals])
    U, _, Vt = np.linalg.svd(np.einsum("nki,kj->nij", ours, theirs))
    Vt[:, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[:, None]
    turns = np.einsum("nji,nkj->nik", Vt, U)  # lay ours best over theirs
    rests = ((np.einsum("nij,nkj->nki", turns, ours) - theirs) ** 2).sum(axis=(1, 2))
    best = np.argsort((rests / ARM**2).round(ROUND), kind="stable")[:count]
    places = center - np.einsum("nij,nj->ni", turns, held)
    return [
        Start(
            orders[order[n]].astype(np.int64), joints[which[n]].copy(), _steady(turns[n]),
            to_digits(places[n], LENGTH),
        )
        for n in best
    ]  # fmt: skip


def _steady(turn: Array) -> Array:
    """Return a rotation near one, (3, 3), without the last digits, which differ by processor.

    From some starts the search is so sensitive that they would decide where it ends.
    """
    x, aside = to_digits(turn.T[:2], 1.0).tolist()
    x = _unit(x)
    z = _unit(_crossed(x, aside))
    return np.array([x, _crossed(z, x), z]).T


def _unit(v: list[float]) -> list[float]:
    length = math.hypot(*v)
    return [part / length for part in v]


def _crossed(a: list[float], b: list[float]) -> list[float]:
    return [
        a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
    ]  # fmt: skip
