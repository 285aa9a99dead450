"""References for the kernel of tilted cones: its four functions in NumPy, on many quadruples."""

from itertools import combinations

import numpy as np

from grasp_core.cones.spanning import OTHERS, angles_between, span_sines
from grasp_core.cones.tilting import (
    MOVES,
    PACE,
    SLIGHT,
    SWEEPS,
    _aside,
    _into_cap,
)  # fmt: skip
from grasp_core.values import FINGERS

FIRST_MOVE, GROWTH, DECAY, _ = PACE


def lowest_heights(normals):
    """Return the least max_i -n_i.m over the middles m of two normals or three, (q,)."""
    lowest = np.full(len(normals), np.inf)
    units = np.moveaxis(normals, 1, 0)
    middles = [one + other for one, other in combinations(units, 2)]
    for one, two, three in combinations(units, 3):
        # both directions square to the plane of the three tips are equally far from all three
        across = np.cross(two - one, three - one)
        middles += [across, -across]
    for middle in middles:
        length = np.linalg.norm(middle, axis=1)
        heights = -np.einsum("fqi,qi->qf", units, middle).min(axis=1) / np.maximum(length, SLIGHT)
        lowest = np.where(length > SLIGHT, np.minimum(lowest, heights), lowest)
    return lowest


def half_angle(axes, normals, thetas):
    """The largest psi that (1) allows, (q,) [rad]; negative where the axes do not span."""
    # theta* of the axes, then what the lean of each axis leaves of its friction cone
    sines = span_sines(axes)
    spans = np.where(sines > 0.0, np.arcsin(np.clip(sines, 0.0, 1.0)), sines)
    return np.minimum(spans, (thetas - angles_between(axes, normals)).min(axis=1))


def balanced(normals, caps):
    """Unit vectors, within caps around the normals, each pointed against the sum of the others."""
    axes = np.array(normals, order="C")
    for _ in range(SWEEPS):
        for finger, others in enumerate(OTHERS):
            against = -axes[:, others].sum(axis=1)
            axes[:, finger] = _into_cap(against, normals[:, finger], caps[:, finger])
    return axes


def improved(axes, normals, thetas):
    """Axes moved at random, in steps that grow with success and shrink without."""
    moves = np.random.default_rng(0).normal(size=(MOVES, FINGERS, 2))
    first, second = _aside(axes)
    reached = half_angle(axes, normals, thetas)
    # steps are in units of each quadruple's own narrowest friction cone
    steps = FIRST_MOVE * thetas.min(axis=1)
    for move in moves:
        sideways = move[:, :1] * first + move[:, 1:] * second
        moved = axes + steps[:, None, None] * sideways
        moved /= np.linalg.norm(moved, axis=-1, keepdims=True)
        now = half_angle(moved, normals, thetas)
        better = now > reached + SLIGHT
        axes = np.where(better[:, None, None], moved, axes)
        reached = np.where(better, now, reached)
        steps = steps * np.where(better, GROWTH, DECAY)
    return axes, reached
