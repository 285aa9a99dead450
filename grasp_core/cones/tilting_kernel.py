"""Tilts force cones in compiled code until they positively span (see `tilting`)."""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.cones.spanning_kernel import span_sine
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.values import FINGERS

CAPS = (0.3, 0.5, 0.7, 0.9)
"""Angles up to which axes may lean while they are balanced, in friction angles."""
SWEEPS = 8
PLANE_SIDES = np.array([
    [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0], [1.0, -1.0, -1.0, 1.0],
    [-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, -1.0, 1.0], [-1.0, 1.0, 1.0, -1.0],
])  # fmt: skip
"""Signs that put two fingers on either side of a plane, (6, 4)."""
FIRST_MOVE, MOVE_GROWTH, MOVE_DECAY = 0.2, 1.3, 0.9
"""Length of the first random move, in friction angles, and its factors after a success and a
failure."""
SLIGHT = 1e-6
"""Size below which improvements and directions decide nothing: vertices that are off by 1e-9 of an
object turn the normals of its small faces by a hundred times that."""


@loop()
def half_angles(axes: Array, normals: Array, thetas: Array, reached: Array) -> None:
    """Fill in the largest psi that axes allow, (q,) [rad]; negative where they do not span."""
    for q in range(len(axes)):
        reached[q] = _half_angle(axes[q], normals[q], thetas[q], -np.inf)


@loop()
def lowest_heights(normals: Array, lowest: Array) -> None:
    """Fill in the least max_i -n_i.m over the middles m of two normals or three, (q,)."""
    middle, one, other = np.empty(3), np.empty(3), np.empty(3)
    for q in range(len(normals)):
        n, lowest[q] = normals[q], np.inf
        for i in range(FINGERS):
            for j in range(i):
                for d in range(3):
                    middle[d] = n[i, d] + n[j, d]
                lowest[q] = min(lowest[q], _height(n, middle, 1.0))
                for k in range(j):
                    for d in range(3):
                        one[d], other[d] = n[i, d] - n[k, d], n[j, d] - n[k, d]
                    cross(one, other, middle)
                    lowest[q] = min(lowest[q], _height(n, middle, 1.0), _height(n, middle, -1.0))


@loop()
def _height(normals: Array, middle: Array, side: float) -> float:
    """Return the largest -n_i.m for m along or against a vector; infinite for a zero vector."""
    length, least = np.sqrt(dotted(middle, middle)), np.inf
    if length <= SLIGHT:
        return np.inf
    for finger in range(FINGERS):
        least = min(least, side * dotted(normals[finger], middle))
    return -least / length


@loop()
def balance(cones: tuple[Array, Array], normals: Array, thetas: Array) -> None:
    """Point each axis in turn against the sum of the others, within caps around the normals."""
    (axes, reached), against, turned = cones, np.empty(3), np.empty((FINGERS, 3))
    for q in range(len(normals)):
        for cap in CAPS:
            cosines, sines = np.cos(cap * thetas[q]), np.sin(cap * thetas[q])
            copy(normals[q], turned)
            for _ in range(SWEEPS):
                for finger in range(FINGERS):
                    for d in range(3):
                        against[d] = turned[finger, d]
                        for other in range(FINGERS):
                            against[d] -= turned[other, d]
                    n, axis = normals[q, finger], turned[finger]
                    _into_cap(against, n, cosines[finger], sines[finger], axis)
            floor = reached[q] + SLIGHT
            now = _half_angle(turned, normals[q], thetas[q], floor)
            if now > floor:
                reached[q] = now
                copy(turned, axes[q])


@loop()
def bend(cones: tuple[Array, Array], normals: Array, thetas: Array, across: Array) -> None:
    """Lean axes to either side of a plane, given the directions across it."""
    (axes, reached), bent, ways = cones, np.empty((FINGERS, 3)), np.empty((FINGERS, 3))
    for q in range(len(normals)):
        for s in range(len(PLANE_SIDES)):
            for finger in range(FINGERS):
                for d in range(3):
                    ways[finger, d] = PLANE_SIDES[s, finger] * across[q, d]
            for cap in CAPS[:-1]:
                lean(ways, normals[q], thetas[q], cap, bent)
                floor = reached[q] + SLIGHT
                now = _half_angle(bent, normals[q], thetas[q], floor)
                if now > floor:
                    reached[q] = now
                    copy(bent, axes[q])


@loop()
def lean_each(ways: Array, normals: Array, thetas: Array, cap: float, axes: Array) -> None:
    """Fill in what `lean` does for each quadruple, (q, 4, 3)."""
    for q in range(len(axes)):
        lean(ways[q], normals[q], thetas[q], cap, axes[q])


@loop()
def lean(ways: Array, normals: Array, thetas: Array, cap: float, axes: Array) -> None:
    """Fill in axes along given ways, or as far as a share of the friction angles allows, (4, 3)."""
    for finger in range(FINGERS):
        angle = cap * thetas[finger]
        _into_cap(ways[finger], normals[finger], np.cos(angle), np.sin(angle), axes[finger])


@loop()
def improve(
    cones: tuple[Array, Array], normals: Array, thetas: Array, frames: Array, moves: Array
) -> None:
    """Move all four axes of each quadruple at random, and keep moves that widen the cones."""
    (axes, reached), moved = cones, np.empty((FINGERS, 3))
    half_angles(axes, normals, thetas, reached)
    for q in range(len(axes)):
        step = FIRST_MOVE * thetas[q].min()
        for m in range(len(moves)):
            for finger in range(FINGERS):
                for d in range(3):
                    sideways = (
                        moves[m, finger, 0] * frames[0, q, finger, d]
                        + moves[m, finger, 1] * frames[1, q, finger, d]
                    )
                    moved[finger, d] = axes[q, finger, d] + step * sideways
                length = np.sqrt(dotted(moved[finger], moved[finger]))
                for d in range(3):
                    moved[finger, d] /= length
            floor = reached[q] + SLIGHT
            now = _half_angle(moved, normals[q], thetas[q], floor)
            if now > floor:
                reached[q] = now
                copy(moved, axes[q])
                step *= MOVE_GROWTH
            else:
                step *= MOVE_DECAY


@loop()
def _half_angle(axes: Array, normals: Array, thetas: Array, floor: float) -> float:
    """Return the largest psi by (1), or any value up to `floor` if psi is not above it."""
    sine, least = span_sine(axes), np.inf
    span = np.arcsin(min(sine, 1.0)) if sine > 0.0 else sine
    if span <= floor:
        return span
    for finger in range(FINGERS):
        square = 0.0
        for d in range(3):
            square += (axes[finger, d] - normals[finger, d]) ** 2
        least = min(least, thetas[finger] - 2.0 * np.arcsin(min(0.5 * np.sqrt(square), 1.0)))
    return min(least, span)


@loop()
def _into_cap(vector: Array, center: Array, cosine: float, sine: float, unit: Array) -> None:
    """Fill in the unit vector nearest to a vector in a cap around a centre, or the centre."""
    along, square = dotted(vector, center), 0.0
    for d in range(3):
        square += (vector[d] - along * center[d]) ** 2
    sideways, length = np.sqrt(square), np.sqrt(square + along * along)
    if sideways <= SLIGHT:
        cosine, sine = 1.0, 0.0
    elif along >= cosine * length:  # already in it
        cosine, sine = along / length, sideways / length
    for d in range(3):
        aside = (vector[d] - along * center[d]) / max(sideways, SLIGHT)
        unit[d] = cosine * center[d] + sine * aside
