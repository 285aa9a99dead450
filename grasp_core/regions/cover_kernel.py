"""Searches in compiled code for cones that cover all twists, with forces that resist each cone.

`grasp_core.regions.proof` derives what is covered and why, and checks every answer; here cones are
only divided and forces chosen. Numbers in comments refer to that derivation. Cones are divided
level by level, the oldest first, so the answer is a tree in levels: for each cone the edge at which
it is divided, or the forces.
"""

import math
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.regions.motions_kernel import MOTIONS, is_open, longest, lowest, velocity
from grasp_core.regions.proof import LEAF, TWIST
from grasp_core.regions.sites import AHEAD, ANSWERS, CLEAR_OF_CONE, EVEN, ROUNDS, Sites

RAYS = TWIST
COVERED, REFUTED, UNDECIDED = 1, -1, 0


class Tree(NamedTuple):
    """The outcome of a search for at most n cones; `search` fills in the arrays."""

    codes: Indices
    """For each cone, the number of the edge at which it is divided, or `LEAF`, (n,)."""
    forces: Array
    """Forces on cones that are not divided, along the frames, (n, k, 3)."""
    shifts: Array
    """Shifts of the contacts, along the frames, at which they do not resist some twist, (k, 3)."""


@loop("numpy")
def pivot(ids: Indices, weights: Array, motions: Array, i: int, most: float) -> tuple[float, float]:
    """Compute a tangential force on the axis of the mean twist, if friction allows it.

    Along this axis a contact's force has the same power wherever the contact is.
    """
    f, g, along = 0.0, 0.0, 0.0
    for place in range(RAYS):
        f += weights[place] * motions[ids[place], i, 3]
        g += weights[place] * motions[ids[place], i, 4]
        along += weights[place] * motions[ids[place], i, 5]
    if f * f + g * g < (most * along) ** 2:
        return f / along, g / along
    return longest(f * along, g * along, most)


@loop("numpy")
def answer(
    ids: Indices, weights: Array, motions: Array, sites: Sites, i: int
) -> tuple[float, float, float]:
    """Find a contact's summed least power on weighted rays for a good force, and that force."""
    most = sites.friction[i] * (1.0 - CLEAR_OF_CONE)
    best, best_f, best_g = -np.inf, 0.0, 0.0
    f, g = pivot(ids, weights, motions, i, most)
    mean_f, mean_g = 0.0, 0.0
    for turn in range(ANSWERS):
        total, slope_f, slope_g = 0.0, 0.0, 0.0
        for place in range(RAYS):
            if weights[place] > 0.0:
                motion = motions[ids[place], i]
                power, out, x, y = lowest(motion, sites, i, (f, g))
                # power is linear in the force: its slopes are the velocities at worst places
                _, q, r = velocity(motion, (out, x, y))
                total += weights[place] * power
                slope_f += weights[place] * q
                slope_g += weights[place] * r
        if turn == 0 or total > best:
            best, best_f, best_g = total, f, g
        # answers to the mean of all slopes so far do not swing back and forth
        share = 1.0 / (turn + 1.0)
        mean_f += share * (slope_f - mean_f)
        mean_g += share * (slope_g - mean_g)
        f, g = longest(mean_f, mean_g, most)
    return best, best_f, best_g


@loop("numpy")
def together(ids: Indices, motions: Array, sites: Sites, forces: Array, clear: Array) -> bool:
    """Return whether forces together have positive power on all rays of a cone: h > 0 in (2)."""
    least, needed = np.inf, 0.0
    for i in range(len(forces)):
        needed += forces[i, 0] * clear[i]
    for place in range(RAYS):
        total = 0.0
        for i in range(len(forces)):
            along = forces[i, 0]
            if along > 0.0:
                force = (forces[i, 1] / along, forces[i, 2] / along)
                total += along * lowest(motions[ids[place], i], sites, i, force)[0]
        least = min(least, total)
    return least > needed


@loop("numpy")
def dot(u: Array, v: Array) -> float:
    """Return the inner product of two lists of six numbers, added in the same order everywhere."""
    total = 0.0
    for place in range(RAYS):
        total += u[place] * v[place]
    return total


@loop("numpy")
def reweigh(regrets: Array, powers: Array, weights: Array) -> None:
    """Move weight to rays by the power they have lacked so far; the last round counts twice."""
    mean, total = dot(weights, powers), 0.0
    for place in range(RAYS):
        regrets[place] = max(0.0, regrets[place] + mean - powers[place])
        weights[place] = max(0.0, regrets[place] + mean - powers[place])
        total += weights[place]
    if total <= 0.0:
        weights[:] = 1.0 / RAYS
    else:
        weights /= total


@loop("numpy")
def find_forces(
    ids: Indices, motions: Array, sites: Sites, clear: Array, forces: Array, weights: Array
) -> bool:
    """Find forces with power on all rays of a cone; return whether they were found.

    `grasp_core.regions.sites` describes the method. It stops as soon as no force of any contact has
    power for the weights; the weights are then those of a twist that may be unresisted.
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
        # later answers count more
        forces[contact, 0] += turn + 1.0
        forces[contact, 1] += (turn + 1.0) * f
        forces[contact, 2] += (turn + 1.0) * g
        if together(ids, motions, sites, forces, clear):
            return True
        reweigh(regrets, powers, weights)
    return False


@loop("numpy")
def fill_motions(ray: int, rays: Array, sites: Sites, axes: Array, motions: Array) -> None:
    """Fill in how the twist of a ray moves each contact, for a twist of length one."""
    twist = np.empty(RAYS)
    for part in range(RAYS):
        twist[part] = dot(rays[ray], axes[:, part])
    length = math.sqrt(dot(twist, twist))
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


@loop("numpy")
def edge_to_cut(ids: Indices, rays: Array, weights: Array) -> tuple[int, int, int]:
    """Return number and ends of the edge to divide: a long one between rays of large weight."""
    longest, chosen, number, first, last = -1.0, 0, 0, 0, 0
    lengths = np.empty(RAYS)
    for i in range(RAYS):
        lengths[i] = math.sqrt(dot(rays[ids[i]], rays[ids[i]]))
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


@loop("numpy")
def orthants(rays: Array, sites: Sites, axes: Array, motions: Array, cones: Indices) -> None:
    """Fill in the first rays, which are the axes and their opposites, and the cones they span."""
    for ray in range(2 * RAYS):
        rays[ray, ray // 2] = 1.0 - 2.0 * (ray % 2)
        fill_motions(ray, rays, sites, axes, motions)
    for signs in range(1 << RAYS):
        for j in range(RAYS):
            cones[signs, j] = 2 * j + (signs >> j & 1)


@loop("numpy")
def search(sites: Sites, axes: Array, needs: tuple[int, Array], tree: Tree) -> tuple[int, int]:
    """Divide cones until each is covered, a twist is unresisted, or there are too many cones.

    Takes `axes` (6, 6); `needs` (k,). Gives how the search ended, and the number of cones.
    """
    most, clear = needs
    rays = np.zeros((2 * RAYS + most, RAYS))
    motions = np.empty((2 * RAYS + most, len(sites.points), MOTIONS))
    cones, weights = np.empty((most, RAYS), dtype=np.int64), np.empty(RAYS)
    orthants(rays, sites, axes, motions, cones)
    bad = np.empty(motions.shape[1:])
    count, made, done = 1 << RAYS, 2 * RAYS, 0
    while done < count:
        tree.codes[done] = LEAF
        if not find_forces(cones[done], motions, sites, clear, tree.forces[done], weights):
            if count + 2 > most:
                return UNDECIDED, done
            edge, a, b = edge_to_cut(cones[done], rays, weights)
            tree.codes[done] = edge
            # (4): the sum of the ends cuts the edge
            rays[made] = rays[a] + rays[b]
            fill_motions(made, rays, sites, axes, motions)
            bad[:] = 0.0
            for place in range(RAYS):
                bad += weights[place] * motions[cones[done, place]]
            # (5): a twist that no contact resists
            if is_open(motions[made], sites, tree.shifts) or is_open(bad, sites, tree.shifts):
                return REFUTED, done
            for j in range(RAYS):
                end = cones[done, j]
                cones[count, j] = made if end == a else end
                cones[count + 1, j] = made if end == b else end
            count, made = count + 2, made + 1
        done += 1
    return COVERED, done
