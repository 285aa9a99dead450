"""A search for a cover of all twists by cones on each of which one contact force has power.

What is covered and why is derived in `grasp_core.twist_covers`, which checks every answer; here
only cones are cut and forces chosen. Cones are cut level by level, the oldest first, so that the
answer is a tree in levels: for each cone either the edge that is cut, or the contact and its force.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType, reportMissingTypeStubs]

from grasp_core.arrays import Array, Indices

RAYS = 6
POWERS = 6
"""Numbers that say how a twist of unit length moves a contact: along the normal and two tangents,
turning about these two and about the normal."""
LEAF = 15
"""Code of a cone that is not cut; smaller ones are edges, (0, 1), (0, 2) and so on."""
COVERED, REFUTED, UNDECIDED = 1, -1, 0
NARROWINGS = 7
"""Halvings of the step in the search for a force."""
WAYS = 4
AHEAD = 1e-9
"""Power per length of twist with which a force counts."""
SHARE = 0.1
"""Of the length of an edge in all that decides which one is cut; the rest is its contact's."""
TINY = 1e-12
"""Share of the friction that forces keep clear of, for rounding."""


class Contacts(NamedTuple):
    """What is to be covered."""

    points: Array
    """About any origin, (k, 3)."""
    frames: Array
    """Columns (inward normal, tangent, tangent), (k, 3, 3)."""
    friction: Array
    """(k,)"""
    sizes: Array
    """Radius and depth of each contact's region, (k, 2)."""
    axes: Array
    """Twists of the first rays as rows, (6, 6)."""


class Tree(NamedTuple):
    """What becomes of each cone, n of them at most, filled in."""

    codes: Indices
    """(n,)"""
    contacts: Indices
    """Whose force covers it, (n,)."""
    forces: Array
    """Tangential parts of that force, whose normal part is one, (n, 2)."""


@njit(cache=True, error_model="numpy")
def least_power(
    ids: Indices, powers: Array, given: Contacts, i: int, force: tuple[float, float]
) -> float:
    """Least power of a force n + f t_1 + g t_2 of contact i on some rays, over its region."""
    f, g = force
    least, radius, depth = np.inf, given.sizes[i, 0], given.sizes[i, 1]
    for place in range(len(ids)):
        ray = ids[place]
        across, along = powers[ray, i, 3], powers[ray, i, 4]
        u, v = across - powers[ray, i, 5] * f, along - powers[ray, i, 5] * g
        found = powers[ray, i, 0] + f * powers[ray, i, 1] + g * powers[ray, i, 2]
        found -= radius * math.sqrt(u * u + v * v) + depth * abs(f * along - g * across)
        least = min(least, found)
    return least


@njit(cache=True, error_model="numpy")
def allowed(f: float, g: float, most: float) -> tuple[float, float]:
    """A tangential part, made as short as friction demands."""
    length = math.sqrt(f * f + g * g)
    return (f * most / length, g * most / length) if length > most else (f, g)


@njit(cache=True, error_model="numpy")
def mean_motion(ids: Indices, powers: Array, i: int, most: float) -> tuple[bool, float, float]:
    """Whether no ray is beyond the power of all forces, and a force along the mean motion."""
    f, g = 0.0, 0.0
    for place in range(len(ids)):
        p, q, r = powers[ids[place], i, 0], powers[ids[place], i, 1], powers[ids[place], i, 2]
        if p + most * math.sqrt(q * q + r * r) <= 0.0:
            return False, 0.0, 0.0
        f += q
        g += r
    length = math.sqrt(f * f + g * g)
    scale = most / length if length > 0.0 else 0.0
    return True, f * scale, g * scale


@njit(cache=True, error_model="numpy")
def best_force(ids: Indices, powers: Array, given: Contacts, i: int, force: Array) -> float:
    """Fill in tangential parts of a force with much power on all of some rays; its least power.

    The least power is concave in the force: steps along the axes from the mean direction of
    motion, halved when none is better, until it counts.
    """
    most = given.friction[i] * (1.0 - TINY)
    possible, f, g = mean_motion(ids, powers, i, most)
    if not possible:
        return -np.inf
    best, step = least_power(ids, powers, given, i, (f, g)), 0.5 * most
    for turn in range(NARROWINGS * WAYS):
        if best > AHEAD:
            break
        ahead = step if turn % WAYS < WAYS // 2 else -step
        tried = allowed(f + ahead * (turn % 2), g + ahead * (1 - turn % 2), most)
        found = least_power(ids, powers, given, i, tried)
        if found > best:
            best = found
            f, g = tried
        if turn % WAYS == WAYS - 1:
            step *= 0.6
    force[0], force[1] = f, g
    return best


@njit(cache=True, error_model="numpy")
def fill_powers(ray: int, rays: Array, given: Contacts, powers: Array) -> None:
    """Fill in how the twist of a ray moves each contact, per length of twist."""
    twist = rays[ray] @ given.axes
    length = math.sqrt(twist @ twist)
    for part in range(RAYS):
        twist[part] /= length
    a0, a1, a2, b0, b1, b2 = twist
    for i in range(len(given.points)):
        x, y, z = given.points[i]
        v0, v1, v2 = a0 + b1 * z - b2 * y, a1 + b2 * x - b0 * z, a2 + b0 * y - b1 * x
        for c in range(3):
            column = given.frames[i, :, c]
            powers[ray, i, c] = v0 * column[0] + v1 * column[1] + v2 * column[2]
            turning = b0 * column[0] + b1 * column[1] + b2 * column[2]
            powers[ray, i, 3 + (c + 2) % 3] = turning  # tangents first


@njit(cache=True, error_model="numpy")
def longest_edge(
    ids: Indices, rays: Array, powers: Array, given: Contacts, contact: int
) -> tuple[int, int, int]:
    """Number and ends of the edge of a cone along which a contact's motion changes most."""
    longest, chosen, number, first, last = -1.0, 0, 0, 0, 0
    lengths, weights = np.empty(RAYS), np.ones(POWERS)
    weights[1:3], weights[3:] = given.friction[contact], given.sizes[contact, 0]
    for i in range(RAYS):
        lengths[i] = math.sqrt(rays[ids[i]] @ rays[ids[i]])
    for i in range(RAYS):
        for j in range(i + 1, RAYS):
            length = 0.0
            for part in range(RAYS):
                gap = rays[ids[i], part] / lengths[i] - rays[ids[j], part] / lengths[j]
                length += SHARE * gap * gap
                gap = powers[ids[i], contact, part] - powers[ids[j], contact, part]
                length += (weights[part] * gap) ** 2
            if length > longest:
                longest, chosen, first, last = length, number, ids[i], ids[j]
            number += 1
    return chosen, first, last


@njit(cache=True, error_model="numpy")
def most_power(ids: Indices, powers: Array, given: Contacts, force: Array) -> tuple[int, float]:
    """The contact whose best force, filled in, has most power on all of some rays; that power."""
    closest, best, tried = 0, -np.inf, np.zeros(2)
    for i in range(len(given.points)):
        found = best_force(ids, powers, given, i, tried)
        if found > best:
            closest, best = i, found
            force[:] = tried
        if found > AHEAD:
            break
    return closest, best


@njit(cache=True, error_model="numpy")
def orthants(given: Contacts, rays: Array, powers: Array, cones: Indices) -> None:
    """Fill in the first rays, the axes and their opposites, and the cones that they span."""
    for ray in range(2 * RAYS):
        rays[ray, ray // 2] = 1.0 - 2.0 * (ray % 2)
        fill_powers(ray, rays, given, powers)
    for signs in range(1 << RAYS):
        for j in range(RAYS):
            cones[signs, j] = 2 * j + (signs >> j & 1)


@njit(cache=True, error_model="numpy")
def search(given: Contacts, most: int, tree: Tree) -> tuple[int, int]:
    """Cut cones until each is covered, one ray is refuted, or there are too many.

    Args:
        given: What is to be covered.
        most: Cones.
        tree: Filled with what becomes of each.

    Returns:
        How it ended, and the number of cones.
    """
    rays = np.zeros((2 * RAYS + most, RAYS))
    powers = np.empty((2 * RAYS + most, len(given.points), POWERS))
    cones, one = np.empty((most, RAYS), dtype=np.int64), np.empty(1, dtype=np.int64)
    orthants(given, rays, powers, cones)
    count, made, done, force = 1 << RAYS, 2 * RAYS, 0, np.zeros(2)
    while done < count:
        contact, best = most_power(cones[done], powers, given, tree.forces[done])
        tree.contacts[done], tree.codes[done] = contact, LEAF
        if best <= AHEAD:
            if count + 2 > most:
                return UNDECIDED, done
            edge, a, b = longest_edge(cones[done], rays, powers, given, contact)
            tree.codes[done] = edge
            rays[made] = rays[a] + rays[b]
            fill_powers(made, rays, given, powers)
            one[0] = made
            if most_power(one, powers, given, force)[1] <= AHEAD:
                return REFUTED, done
            for j in range(RAYS):
                end = cones[done, j]
                cones[count, j] = made if end == a else end
                cones[count + 1, j] = made if end == b else end
            count, made = count + 2, made + 1
        done += 1
    return COVERED, done


def try_out() -> None:
    """Compile for the types in use, on contacts on which nothing is covered."""
    count = 1 << RAYS
    tree = Tree(np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros((count, 2)))
    frames = np.zeros((4, 3, 3)) + np.eye(3)
    given = Contacts(np.zeros((4, 3)), frames, np.ones(4), np.zeros((4, 2)), np.eye(RAYS))
    search(given, count, tree)
