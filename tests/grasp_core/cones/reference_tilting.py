"""Reference for the kernel of tilted cones: the search in NumPy, on many quadruples at once."""

from itertools import combinations

import numpy as np

from grasp_core.cones.spanning import angles_between, span_sines
from grasp_core.cones.tilting import FLAT, MOVES, SLIGHT, _across, _aside
from grasp_core.cones.tilting_kernel import CAPS, DECAY, FIRST_MOVE, GROWTH, SIDES, SWEEPS
from grasp_core.values import FINGERS


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


def into_cap(vectors, centers, angles):
    """The unit vectors nearest to vectors (q, 3) within angles (q,) of unit centres."""
    along = np.einsum("qi,qi->q", vectors, centers)
    across = vectors - along[:, None] * centers
    sideways = np.linalg.norm(across, axis=1)
    # no further than the cap's angle, and not at all without a direction
    turn = np.where(sideways > SLIGHT, np.minimum(np.arctan2(sideways, along), angles), 0.0)
    aside = across / np.maximum(sideways, SLIGHT)[:, None]
    return np.cos(turn)[:, None] * centers + np.sin(turn)[:, None] * aside


def tilted_cones(normals, thetas):
    """Axes and half-angles of the search."""
    found = normals.copy(), half_angle(normals, normals, thetas)
    for cap in CAPS:
        found = wider(*found, balanced(normals, cap * thetas), normals, thetas)
    _, sizes, directions = np.linalg.svd(normals)
    flat, across = sizes[:, 2] < FLAT * sizes[:, 1], _across(normals, directions[:, 2])
    for sides in SIDES:
        for cap in CAPS[:-1]:
            bent = [
                into_cap(sides[i] * across, normals[:, i], cap * thetas[:, i])
                for i in range(FINGERS)
            ]
            axes = np.where(flat[:, None, None], np.stack(bent, axis=1), found[0])
            found = wider(*found, axes, normals, thetas)
    return improved(*found, normals, thetas)


def wider(axes, reached, others, normals, thetas):
    """Other axes where they allow wider cones."""
    now = half_angle(others, normals, thetas)
    better = now > reached + SLIGHT
    return np.where(better[:, None, None], others, axes), np.where(better, now, reached)


def balanced(normals, caps):
    """Unit vectors, within caps around the normals, each pointed against the sum of the others."""
    axes = normals.copy()
    for _ in range(SWEEPS):
        for finger in range(FINGERS):
            against = axes[:, finger] - axes.sum(axis=1)
            axes[:, finger] = into_cap(against, normals[:, finger], caps[:, finger])
    return axes


def improved(axes, reached, normals, thetas):
    """Axes moved at random, in steps that grow with success and shrink without."""
    moves = np.random.default_rng(0).normal(size=(MOVES, FINGERS, 2))
    first, second = _aside(axes)
    # steps are in units of each quadruple's own narrowest friction cone
    steps = FIRST_MOVE * thetas.min(axis=1)
    for move in moves:
        sideways = move[:, :1] * first + move[:, 1:] * second
        moved = axes + steps[:, None, None] * sideways
        moved /= np.linalg.norm(moved, axis=-1, keepdims=True)
        before = reached
        axes, reached = wider(axes, reached, moved, normals, thetas)
        steps = steps * np.where(reached > before, GROWTH, DECAY)
    return axes, reached
