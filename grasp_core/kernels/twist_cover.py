"""A search for a cover of all twists by cones on each of which contact forces have power together.

What is covered and why is derived in `grasp_core.twist_covers`, which checks every answer; here
only cones are cut and forces chosen. Cones are cut level by level, the oldest first, so that the
answer is a tree in levels: for each cone either the edge that is cut, or the forces.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType, reportMissingTypeStubs]

from grasp_core.arrays import Array, Indices
from grasp_core.contact_sites import Sites

RAYS = 6
MOTIONS = 6
"""Numbers that say how a twist of unit length moves a contact: along the normal and two tangents,
turning about these two and about the normal."""
LEAF = 15
"""Code of a cone that is not cut; smaller ones are edges, (0, 1), (0, 2) and so on."""
COVERED, REFUTED, UNDECIDED = 1, -1, 0
ROUNDS = 30
"""Of the game between a ray, who wants little power, and forces, who want much."""
ANSWERS = 3
"""Forces that are tried as the best answer to weights of rays."""
STEPS = 40
"""Towards the place of a contact where a twist is resisted least."""
AHEAD = 1e-9
"""Power per length of twist with which a force counts."""
EVEN = 0.02
"""Weight that each ray keeps in the choice of the edge that is cut."""
TINY = 1e-12
"""Share of the friction that forces keep clear of, for rounding."""


class Tree(NamedTuple):
    """What becomes of each cone, n of them at most, filled in."""

    codes: Indices
    """(n,)"""
    forces: Array
    """Along the frames, (n, k, 3)."""
    shifts: Array
    """Where contacts do not resist a twist, along the frames from the points, (k, 3)."""


@njit(cache=True, error_model="numpy")
def lowest(
    motion: Array, sites: Sites, i: int, force: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Least power of a force n + f t_1 + g t_2 over a contact's site, and where, (n, t_1, t_2)."""
    f, g = force
    u, v, w = motion[3] - motion[5] * f, motion[4] - motion[5] * g, f * motion[4] - g * motion[3]
    least, x, y = np.inf, 0.0, 0.0
    for corner in range(sites.corners.shape[1]):
        height = u * sites.corners[i, corner, 1] - v * sites.corners[i, corner, 0]
        if height < least:
            least, x, y = height, sites.corners[i, corner, 0], sites.corners[i, corner, 1]
    length = math.sqrt(u * u + v * v)
    if sites.radii[i] > 0.0 and length > 0.0:
        least -= sites.radii[i] * length
        x += sites.radii[i] * v / length
        y -= sites.radii[i] * u / length
    out = -sites.depths[i] if w > 0.0 else sites.depths[i]
    return motion[0] + f * motion[1] + g * motion[2] + least + out * w, out, x, y


@njit(cache=True, error_model="numpy")
def velocity(
    motion: Array, place: Array | tuple[float, float, float]
) -> tuple[float, float, float]:
    """Of a contact that is off its point, along the frame."""
    out, x, y = place
    return (
        motion[0] + motion[3] * y - motion[4] * x,
        motion[1] - motion[5] * y + motion[4] * out,
        motion[2] + motion[5] * x - motion[3] * out,
    )


@njit(cache=True, error_model="numpy")
def longest(f: float, g: float, most: float) -> tuple[float, float]:
    """The tangential part in a direction that friction allows."""
    length = math.sqrt(f * f + g * g)
    return (f * most / length, g * most / length) if length > 0.0 else (0.0, 0.0)


@njit(cache=True, error_model="numpy")
def holds(sites: Sites, i: int, x: float, y: float) -> bool:
    """Whether a place in its plane is in a contact's polygon, or in its disc."""
    if x * x + y * y <= sites.radii[i] ** 2:
        return True
    corners, sides = sites.corners[i], 0
    for place in range(len(corners)):
        here, there = corners[place - 1], corners[place]
        sides += int(here[0] != there[0] or here[1] != there[1])
        ahead = (there[0] - here[0]) * (y - here[1]) - (there[1] - here[1]) * (x - here[0])
        if ahead < 0.0:
            return False
    return sides > 0


@njit(cache=True, error_model="numpy")
def resists(motion: Array, sites: Sites, i: int, shift: Array) -> bool:
    """Whether a contact may resist a twist wherever it is; else a place, perhaps, where it cannot.

    Where a contact does not slide friction has no power, and otherwise the most that it allows is
    convex in the place, and steps go to where it is least. False, with a place that resists, where
    the steps do not suffice.
    """
    most = sites.friction[i] * (1.0 - TINY)
    out, x, y = 0.0, 0.0, 0.0
    if motion[5] != 0.0:
        shift[0], shift[1], shift[2] = 0.0, -motion[2] / motion[5], motion[1] / motion[5]
        if holds(sites, i, shift[1], shift[2]) and velocity(motion, shift)[0] <= 0.0:
            return False
    for step in range(STEPS):
        _, q, r = velocity(motion, (out, x, y))
        least, out_ahead, x_ahead, y_ahead = lowest(motion, sites, i, longest(q, r, most))
        if least > AHEAD:
            return True
        share = 2.0 / (step + 2.0)
        out += share * (out_ahead - out)
        x += share * (x_ahead - x)
        y += share * (y_ahead - y)
        p, q, r = velocity(motion, (out, x, y))
        if p + sites.friction[i] * math.sqrt(q * q + r * r) <= 0.0:
            break
    shift[0], shift[1], shift[2] = out, x, y
    return False


@njit(cache=True, error_model="numpy")
def is_open(motions: Array, sites: Sites, shifts: Array) -> bool:
    """Whether no contact resists a twist at the places that are filled in."""
    for i in range(len(sites.points)):
        if resists(motions[i], sites, i, shifts[i]):
            return False
        p, q, r = velocity(motions[i], (shifts[i, 0], shifts[i, 1], shifts[i, 2]))
        if p + sites.friction[i] * math.sqrt(q * q + r * r) > 0.0:
            return False
    return True


@njit(cache=True, error_model="numpy")
def pivot(ids: Indices, weights: Array, motions: Array, i: int, most: float) -> tuple[float, float]:
    """The tangential part of a contact's force along the axis of the mean twist, if allowed.

    It has the same power wherever the contact is.
    """
    f, g, along = 0.0, 0.0, 0.0
    for place in range(RAYS):
        f += weights[place] * motions[ids[place], i, 3]
        g += weights[place] * motions[ids[place], i, 4]
        along += weights[place] * motions[ids[place], i, 5]
    if f * f + g * g < (most * along) ** 2:
        return f / along, g / along
    return longest(f * along, g * along, most)


@njit(cache=True, error_model="numpy")
def answer(
    ids: Indices, weights: Array, motions: Array, sites: Sites, i: int
) -> tuple[float, float, float]:
    """The sum of a contact's least powers on weighted rays for a good force, and that force."""
    most = sites.friction[i] * (1.0 - TINY)
    best, best_f, best_g = -np.inf, 0.0, 0.0
    f, g = pivot(ids, weights, motions, i, most)
    mean_f, mean_g = 0.0, 0.0
    for turn in range(ANSWERS):
        total, slope_f, slope_g = 0.0, 0.0, 0.0
        for place in range(RAYS):
            if weights[place] > 0.0:
                motion = motions[ids[place], i]
                power, out, x, y = lowest(motion, sites, i, (f, g))
                _, q, r = velocity(motion, (out, x, y))
                total += weights[place] * power
                slope_f += weights[place] * q
                slope_g += weights[place] * r
        if turn == 0 or total > best:
            best, best_f, best_g = total, f, g
        share = 1.0 / (turn + 1.0)
        mean_f += share * (slope_f - mean_f)
        mean_g += share * (slope_g - mean_g)
        f, g = longest(mean_f, mean_g, most)
    return best, best_f, best_g


@njit(cache=True, error_model="numpy")
def together(ids: Indices, motions: Array, sites: Sites, forces: Array) -> float:
    """Least power of some forces together on the rays of a cone, over all sites."""
    least = np.inf
    for place in range(RAYS):
        total = 0.0
        for i in range(len(forces)):
            along = forces[i, 0]
            if along > 0.0:
                force = (forces[i, 1] / along, forces[i, 2] / along)
                total += along * lowest(motions[ids[place], i], sites, i, force)[0]
        least = min(least, total)
    return least


@njit(cache=True, error_model="numpy")
def reweigh(regrets: Array, powers: Array, weights: Array) -> None:
    """Put weight on rays by how little power they would have cost so far, the last time twice."""
    mean, total = weights @ powers, 0.0
    for place in range(RAYS):
        regrets[place] = max(0.0, regrets[place] + mean - powers[place])
        weights[place] = max(0.0, regrets[place] + mean - powers[place])
        total += weights[place]
    if total <= 0.0:
        weights[:] = 1.0 / RAYS
    else:
        weights /= total


@njit(cache=True, error_model="numpy")
def find_forces(ids: Indices, motions: Array, sites: Sites, forces: Array, weights: Array) -> bool:
    """Fill in forces with power on all rays of a cone, if some are found; else a bad twist in it.

    A game: weights of the rays are chosen by what they regret not to have chosen, forces answer,
    and the mean answer, late ones counting more, is what gets the power. No answer, no such forces.
    """
    regrets, powers = np.zeros(RAYS), np.empty(RAYS)
    weights[:] = 1.0 / RAYS
    forces[:] = 0.0
    for turn in range(ROUNDS):
        best, contact, f, g = -np.inf, 0, 0.0, 0.0
        for i in range(len(forces)):
            found = answer(ids, weights, motions, sites, i)
            if found[0] > best:
                contact = i
                best, f, g = found
        if best <= AHEAD:
            return False
        for place in range(RAYS):
            powers[place] = lowest(motions[ids[place], contact], sites, contact, (f, g))[0]
        forces[contact, 0] += turn + 1.0
        forces[contact, 1] += (turn + 1.0) * f
        forces[contact, 2] += (turn + 1.0) * g
        if together(ids, motions, sites, forces) > AHEAD:
            return True
        reweigh(regrets, powers, weights)
    return False


@njit(cache=True, error_model="numpy")
def fill_motions(ray: int, rays: Array, sites: Sites, axes: Array, motions: Array) -> None:
    """Fill in how the twist of a ray moves each contact, per length of twist."""
    twist = rays[ray] @ axes
    length = math.sqrt(twist @ twist)
    for part in range(RAYS):
        twist[part] /= length
    a0, a1, a2, b0, b1, b2 = twist
    for i in range(len(sites.points)):
        x, y, z = sites.points[i]
        v0, v1, v2 = a0 + b1 * z - b2 * y, a1 + b2 * x - b0 * z, a2 + b0 * y - b1 * x
        for c in range(3):
            column = sites.frames[i, :, c]
            motions[ray, i, c] = v0 * column[0] + v1 * column[1] + v2 * column[2]
            turning = b0 * column[0] + b1 * column[1] + b2 * column[2]
            motions[ray, i, 3 + (c + 2) % 3] = turning  # tangents first


@njit(cache=True, error_model="numpy")
def edge_to_cut(ids: Indices, rays: Array, weights: Array) -> tuple[int, int, int]:
    """Number and ends of a long edge of a cone between rays that weigh much."""
    longest, chosen, number, first, last = -1.0, 0, 0, 0, 0
    lengths = np.empty(RAYS)
    for i in range(RAYS):
        lengths[i] = math.sqrt(rays[ids[i]] @ rays[ids[i]])
    for i in range(RAYS):
        for j in range(i + 1, RAYS):
            length = 0.0
            for part in range(RAYS):
                gap = rays[ids[i], part] / lengths[i] - rays[ids[j], part] / lengths[j]
                length += gap * gap
            length *= (weights[i] + EVEN) * (weights[j] + EVEN)
            if length > longest:
                longest, chosen, first, last = length, number, ids[i], ids[j]
            number += 1
    return chosen, first, last


@njit(cache=True, error_model="numpy")
def orthants(rays: Array, sites: Sites, axes: Array, motions: Array, cones: Indices) -> None:
    """Fill in the first rays, the axes and their opposites, and the cones that they span."""
    for ray in range(2 * RAYS):
        rays[ray, ray // 2] = 1.0 - 2.0 * (ray % 2)
        fill_motions(ray, rays, sites, axes, motions)
    for signs in range(1 << RAYS):
        for j in range(RAYS):
            cones[signs, j] = 2 * j + (signs >> j & 1)


@njit(cache=True, error_model="numpy")
def search(sites: Sites, axes: Array, most: int, tree: Tree) -> tuple[int, int]:
    """Cut cones until each is covered, one ray is refuted, or there are too many.

    Args:
        sites: Where contacts may be.
        axes: Twists of the first rays as rows, (6, 6).
        most: Cones.
        tree: Filled with what becomes of each.

    Returns:
        How it ended, and the number of cones.
    """
    rays = np.zeros((2 * RAYS + most, RAYS))
    motions = np.empty((2 * RAYS + most, len(sites.points), MOTIONS))
    cones, weights = np.empty((most, RAYS), dtype=np.int64), np.empty(RAYS)
    orthants(rays, sites, axes, motions, cones)
    bad = np.empty(motions.shape[1:])
    count, made, done = 1 << RAYS, 2 * RAYS, 0
    while done < count:
        tree.codes[done] = LEAF
        if not find_forces(cones[done], motions, sites, tree.forces[done], weights):
            if count + 2 > most:
                return UNDECIDED, done
            edge, a, b = edge_to_cut(cones[done], rays, weights)
            tree.codes[done] = edge
            rays[made] = rays[a] + rays[b]
            fill_motions(made, rays, sites, axes, motions)
            bad[:] = 0.0
            for place in range(RAYS):
                bad += weights[place] * motions[cones[done, place]]
            if is_open(motions[made], sites, tree.shifts) or is_open(bad, sites, tree.shifts):
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
    k, most = 4, 1 << RAYS
    tree = Tree(np.zeros(most, np.int64), np.zeros((most, k, 3)), np.zeros((k, 3)))
    frames = np.zeros((k, 3, 3)) + np.eye(3)
    points, corners = np.zeros((k, 3)), np.zeros((k, 1, 2))
    search(
        Sites(points, frames, np.ones(k), corners, np.zeros(k), np.zeros(k)),
        np.eye(RAYS), most, tree,
    )  # fmt: skip
