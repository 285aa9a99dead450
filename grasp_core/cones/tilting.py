"""Tilts force cones so that they positively span although the faces' normals do not.

Solved: for four normals n_i with friction cones of half-angles theta_i, axes a_i and one half-angle
psi, as large as a search finds, such that the cones around a_i lie inside the friction cones and
positively span whatever direction each contributes (P3):

    angle(a_i, n_i) + psi <= theta_i,      psi < theta*(a_1, .., a_4).                        (1)

Solutions exist exactly where four forces, each strictly inside its friction cone, can sum to zero
without lying in a plane: then their directions positively span, and by continuity so do narrow
cones around them. So boxes and prisms have them at any friction, though never around the
normals, and so have all faces at frictions above 0.354, where P3 around the normals is impossible.

With a_i = n_i and psi = theta this is Definition 3 of the paper; its constructions hold word for
word, since nothing in them uses that an axis is a normal.

An upper bound of psi. For every unit vector m some axis has a_i.m < -sin(psi), and it is within
theta_i - psi of its normal, so that

    2 psi  <  max_i angle(n_i, m) - 90 deg + theta_i.                                         (2)

Search. The height of the pyramid (theta, theta*) over the axes has one ridge after another, so
nothing is claimed to be the largest. Axes that balance well are found first: each in turn is
pointed against the sum of the others, as far as a cap around its normal lets it, for caps of
several sizes; normals that lie nearly in a plane, as those of a box's sides, are bent out of it.
Then all four are moved at random, in steps that grow with success and shrink without. The moves are
the same for any quadruple, in frames that turn with it, so that turned objects get turned cones.

Source: this project's; P3 with its closed form is explained in `spanning`.

Arrays have a row for each of q quadruples: normals, axes and directions are (q, 4, 3), friction
angles `thetas` (q, 4) and half-angles (q,) [rad].
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.values import FINGERS

TILTING_KERNEL = "grasp_core.cones.tilting_kernel"
TOWARD = (0.5, 0.9)
"""Angles up to which axes may lean to meet in a point, in friction angles."""
RANDOM_MOVES = 60
SLIGHT = 1e-6
"""Size below which improvements and directions decide nothing, as in `tilting_kernel`."""
LEAST_ANGLE_SINE = 0.1
"""Sine of the angle between two axes above which one can serve to find a direction across the
other."""
NEARLY_PLANAR = 0.5
"""Spread of normals across a plane, as a share of their next larger spread, below which they nearly
lie in the plane."""
QUADRUPLES_AT_ONCE = 20_000
"""Number of quadruples that are searched at once, which needs some tens of megabytes."""


class TiltedCones(NamedTuple):
    """Force cones of q quadruples, four for each."""

    axes: Array
    """Unit vectors along the cones' middles, (q, 4, 3)."""
    half_angles: Array
    """Half-angle psi that the four cones share, (q,) [rad]; not positive where none was found."""


def tilted_cones(normals: Array, thetas: Array) -> TiltedCones:
    """Search for wide force cones that positively span, for many quadruples."""
    cuts = [*range(0, len(normals), QUADRUPLES_AT_ONCE), len(normals)]
    parts = [_search(normals[i:j], thetas[i:j]) for i, j in pairwise(cuts)]
    if not parts:
        return TiltedCones(np.empty((0, FINGERS, 3)), np.empty(0))
    axes, half_angles = (np.concatenate(each) for each in zip(*parts, strict=True))
    return TiltedCones(axes, half_angles)


def widest_half_angles(normals: Array, thetas: Array, sines: Array) -> Array:
    """Bound the half-angles psi of all force cones by (2), however tilted, (q,) [rad].

    Where the normals span, the smallest over m of max angle(n_i, m) - 90 deg is theta*. Else it is
    negative, and taken where m is in the middle of two normals, or as far from three.
    """
    lowest = np.empty(len(normals))
    compiled(TILTING_KERNEL).lowest_heights(np.ascontiguousarray(normals), lowest)
    heights = np.where(sines > 0.0, sines, np.minimum(lowest, 0.0))
    # (2), for the largest theta_i and the best m; psi is no more than any theta_i, by (1)
    widest = 0.5 * (thetas.max(axis=1) + np.arcsin(np.clip(heights, -1.0, 1.0)))
    return np.minimum(widest + SLIGHT, thetas.min(axis=1))


def widened(directions: Array, normals: Array, thetas: Array) -> TiltedCones:
    """Search for force cones with axes near given directions inside the friction cones."""
    axes = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    return _improved(axes, normals, thetas)


def toward(points: Array, positions: Array, normals: Array, thetas: Array) -> TiltedCones:
    """Search for force cones whose axes lean towards common points as far as possible."""
    ways = points[:, None] - positions
    inward = np.einsum("qfi,qfi->qf", ways, normals)
    ways = ways * np.where(inward < -SLIGHT, -1.0, 1.0)[..., None]  # away from points outside
    best, half_angles = normals, np.full(len(normals), -np.inf)
    for cap in TOWARD:
        axes = np.empty_like(ways)
        compiled(TILTING_KERNEL).lean_each(
            *map(np.ascontiguousarray, (ways, normals, thetas)), cap, axes
        )
        found, reached = _improved(axes, normals, thetas)
        better = reached > half_angles + SLIGHT
        best = np.where(better[:, None, None], found, best)
        half_angles = np.where(better, reached, half_angles)
    return TiltedCones(best, half_angles)


def _search(normals: Array, thetas: Array) -> TiltedCones:
    normals, thetas = np.ascontiguousarray(normals), np.ascontiguousarray(thetas)
    kernel, best = compiled(TILTING_KERNEL), TiltedCones(normals.copy(), np.empty(len(normals)))
    kernel.half_angles(best.axes, normals, thetas, best.half_angles)
    kernel.balance(tuple(best), normals, thetas)
    # squares of spreads: the first is across the plane that the normals lie in most nearly
    squares, directions = np.linalg.eigh(normals.transpose(0, 2, 1) @ normals)
    flat = np.flatnonzero(squares[:, 0] < NEARLY_PLANAR**2 * squares[:, 1])
    bent = best.axes[flat], best.half_angles[flat]
    kernel.bend(bent, normals[flat], thetas[flat], _across(normals[flat], directions[flat, :, 0]))
    best.axes[flat], best.half_angles[flat] = bent
    return _improved(best.axes, normals, thetas)


def _across(normals: Array, across: Array) -> Array:
    """Return directions across planes, each to the side that tells turned normals alike, (q, 3)."""
    turns = np.cross(normals[:, :1], normals[:, 1:])
    which = np.argmax(np.linalg.norm(turns, axis=-1) > LEAST_ANGLE_SINE, axis=1)
    handed = np.einsum("qi,qi->q", turns[np.arange(len(turns)), which], across)
    return np.asarray(across * np.where(handed < 0.0, -1.0, 1.0)[:, None], dtype=np.float64)


def _improved(axes: Array, normals: Array, thetas: Array) -> TiltedCones:
    # one seed for all quadruples: equal ones get equal moves, wherever they are listed
    moves = np.random.default_rng(0).normal(size=(RANDOM_MOVES, FINGERS, 2))
    first, second = _aside(axes)
    cones = TiltedCones(np.array(axes, order="C"), np.empty(len(axes)))
    given = map(np.ascontiguousarray, (normals, thetas, np.stack([first, second])))
    compiled(TILTING_KERNEL).improve(tuple(cones), *given, moves)
    return cones


def _aside(axes: Array) -> tuple[Array, Array]:
    """Return two directions across each axis, (q, 4, 3); the first is across a second axis too."""
    first = np.zeros_like(axes)
    for ahead in range(FINGERS - 1, 0, -1):
        cross = np.cross(axes, np.roll(axes, -ahead, axis=1))
        length = np.linalg.norm(cross, axis=-1, keepdims=True)
        first = np.where(
            length > LEAST_ANGLE_SINE, cross / np.maximum(length, LEAST_ANGLE_SINE), first
        )
    return first, np.cross(axes, first)
