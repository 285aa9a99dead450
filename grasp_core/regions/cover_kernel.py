"""Searches in compiled code for cones that cover all twists, with forces that resist each cone.

`grasp_core.regions.regions_certificate` derives what is covered and why, and checks every answer;
here cones are only divided and forces chosen. Numbers in comments refer to that derivation. Cones
are divided level by level, the oldest first, so the answer is a tree in levels: for each cone the
edge at which it is divided, or the forces.

A cone of twists is covered if contact forces together have power on all of its six rays. Such
forces are found in rounds. In each round every ray has a weight, by how much power it has lacked so
far, and the forces that are best for these weights are chosen. The mean of the chosen forces, later
ones counting more, comes to have power on all rays if any forces do.

A motion is six numbers for each contact and each twist of length one: the velocity of the contact's
point along its normal and two tangents, and the rate of turning about these tangents and the
normal.
"""

import math
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.regions.growth import LEAST_POWER, Sites
from grasp_core.regions.regions_certificate import TWIST, UNDIVIDED

TWIST_SIZE = 6
MOST_PLACE_STEPS = 40
CONE_RAYS = TWIST
FORCE_ROUNDS = 30  # of the choice of forces, at most
ANSWERS = 3
"""Number of forces per contact that are tried as the best one for given weights."""
EVEN_WEIGHT = 0.02
"""Weight added to each ray in the choice of the edge to cut, so that all edges are cut in time."""
CLEAR_OF_CONE = 1e-12
"""Share of the friction that contact forces leave unused, so that rounding does no harm."""
COVERED, REFUTED, UNDECIDED = 1, -1, 0


@loop("numpy")
def lowest(
    motion: Array, sites: Sites, i: int, force: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Find the least power of a force n + f t_1 + g t_2 over a contact's site, and the place."""
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


@loop("numpy")
def velocity(
    motion: Array, place: Array | tuple[float, float, float]
) -> tuple[float, float, float]:
    """Compute the velocity of a contact at a place away from its point, along the frame."""
    out, x, y = place
    return (
        motion[0] + motion[3] * y - motion[4] * x,
        motion[1] - motion[5] * y + motion[4] * out,
        motion[2] + motion[5] * x - motion[3] * out,
    )


@loop("numpy")
def longest(f: float, g: float, most: float) -> tuple[float, float]:
    """Scale a tangential direction (f, g) to the length that friction allows."""
    length = math.sqrt(f * f + g * g)
    return (f * most / length, g * most / length) if length > 0.0 else (0.0, 0.0)


@loop("numpy")
def holds(sites: Sites, i: int, x: float, y: float) -> bool:
    """Return whether a place in a contact's plane is in its polygon or in its disc."""
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


@loop("numpy", once=True)
def resists(motion: Array, sites: Sites, i: int, shift: Array) -> bool:
    """Return whether a contact resists a twist wherever it is; `shift` is a place where it may not.

    Where a contact slides, the largest power that friction allows is convex in the place, and the
    search steps to where it is least. After too many steps `shift` may be a place that resists.
    """
    most = sites.friction[i] * (1.0 - CLEAR_OF_CONE)
    out, x, y = 0.0, 0.0, 0.0
    if motion[5] != 0.0:
        # the one place that does not slide
        shift[0], shift[1], shift[2] = 0.0, -motion[2] / motion[5], motion[1] / motion[5]
        if holds(sites, i, shift[1], shift[2]) and velocity(motion, shift)[0] <= 0.0:
            return False
    for step in range(MOST_PLACE_STEPS):
        _, q, r = velocity(motion, (out, x, y))
        least, out_ahead, x_ahead, y_ahead = lowest(motion, sites, i, longest(q, r, most))
        if least > LEAST_POWER:
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


@loop("numpy")
def is_open(motions: Array, sites: Sites, shifts: Array) -> bool:
    """Return whether no contact resists a twist at some places; fill these in as `shifts`."""
    for i in range(len(sites.points)):
        if resists(motions[i], sites, i, shifts[i]):
            return False
        p, q, r = velocity(motions[i], (shifts[i, 0], shifts[i, 1], shifts[i, 2]))
        if p + sites.friction[i] * math.sqrt(q * q + r * r) > 0.0:
            return False
    return True


class CoverTree(NamedTuple):
    """The outcome of a search for at most n cones; `search` fills in the arrays.

    For each cone there is the number of the edge that divides it, or `UNDIVIDED`, (n,), and forces
    along the frames, (n, k, 3). At shifts along the frames, (k, 3), contacts do not resist some
    twist.
    """

    codes: Indices
    forces: Array
    shifts: Array


@loop("numpy", once=True)
def pivot(ids: Indices, weights: Array, motions: Array, i: int, most: float) -> tuple[float, float]:
    """Compute a tangential force, as friction allows, along the mean twist's axis.

    There its power is the same wherever the contact is.
    """
    f, g, along = 0.0, 0.0, 0.0
    for place in range(CONE_RAYS):
        f += weights[place] * motions[ids[place], i, 3]
        g += weights[place] * motions[ids[place], i, 4]
        along += weights[place] * motions[ids[place], i, 5]
    if f * f + g * g < (most * along) ** 2:
        return f / along, g / along
    return longest(f * along, g * along, most)


@loop("numpy", once=True)
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
        for place in range(CONE_RAYS):
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


@loop("numpy", once=True)
def together(ids: Indices, motions: Array, sites: Sites, forces: Array, clear: Array) -> bool:
    """Return whether forces together have positive power on all rays of a cone: h > 0 in (2)."""
    least, needed = np.inf, 0.0
    for i in range(len(forces)):
        needed += forces[i, 0] * clear[i]
    for place in range(CONE_RAYS):
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
    for place in range(CONE_RAYS):
        total += u[place] * v[place]
    return total


@loop("numpy", once=True)
def reweigh(regrets: Array, powers: Array, weights: Array) -> None:
    """Move weight to rays by the power they have lacked so far; the last round counts twice."""
    mean, total = dot(weights, powers), 0.0
    for place in range(CONE_RAYS):
        regrets[place] = max(0.0, regrets[place] + mean - powers[place])
        weights[place] = max(0.0, regrets[place] + mean - powers[place])
        total += weights[place]
    if total <= 0.0:
        weights[:] = 1.0 / CONE_RAYS
    else:
        weights /= total


@loop("numpy", once=True)
def find_forces(
    ids: Indices, motions: Array, sites: Sites, clear: Array, forces: Array, weights: Array
) -> bool:
    """Find forces with power on all rays of a cone, as the head of this module says.

    It stops once no force has power for the weights: those of a twist that may be unresisted.
    """
    regrets, powers = np.zeros(CONE_RAYS), np.empty(CONE_RAYS)
    weights[:] = 1.0 / CONE_RAYS
    forces[:] = 0.0
    for turn in range(FORCE_ROUNDS):
        best, contact, f, g = -np.inf, 0, 0.0, 0.0
        for i in range(len(forces)):
            found = answer(ids, weights, motions, sites, i)
            if found[0] > best:
                contact = i
                best, f, g = found
        if best <= LEAST_POWER:
            return False
        for place in range(CONE_RAYS):
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
    twist = np.empty(CONE_RAYS)
    for part in range(CONE_RAYS):
        twist[part] = dot(rays[ray], axes[:, part])
    length = math.sqrt(dot(twist, twist))
    for part in range(CONE_RAYS):
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


@loop("numpy", once=True)
def edge_to_cut(ids: Indices, rays: Array, weights: Array) -> tuple[int, int, int]:
    """Return number and ends of the edge to divide: a long one between rays of large weight."""
    longest, chosen, number, first, last = -1.0, 0, 0, 0, 0
    lengths = np.empty(CONE_RAYS)
    for i in range(CONE_RAYS):
        lengths[i] = math.sqrt(dot(rays[ids[i]], rays[ids[i]]))
    for i in range(CONE_RAYS):
        for j in range(i + 1, CONE_RAYS):
            length = 0.0
            for part in range(CONE_RAYS):
                gap = rays[ids[i], part] / lengths[i] - rays[ids[j], part] / lengths[j]
                length += gap * gap
            length *= (weights[i] + EVEN_WEIGHT) * (weights[j] + EVEN_WEIGHT)
            if length > longest:
                longest, chosen, first, last = length, number, ids[i], ids[j]
            number += 1
    return chosen, first, last


@loop("numpy")
def search(sites: Sites, axes: Array, needs: tuple[int, Array], tree: CoverTree) -> tuple[int, int]:
    """Divide cones until each is covered, a twist is unresisted, or there are too many cones.

    Gives how the search ended, and the number of cones.
    """
    most, clear = needs
    rays = np.zeros((2 * CONE_RAYS + most, CONE_RAYS))
    motions = np.empty((2 * CONE_RAYS + most, len(sites.points), TWIST_SIZE))
    cones, weights = np.empty((most, CONE_RAYS), dtype=np.int64), np.empty(CONE_RAYS)
    # the first rays are the axes and their opposites, which span the orthants
    for ray in range(2 * CONE_RAYS):
        rays[ray, ray // 2] = 1.0 - 2.0 * (ray % 2)
        fill_motions(ray, rays, sites, axes, motions)
    for signs in range(1 << CONE_RAYS):
        for j in range(CONE_RAYS):
            cones[signs, j] = 2 * j + (signs >> j & 1)
    bad = np.empty(motions.shape[1:])
    count, made, done = 1 << CONE_RAYS, 2 * CONE_RAYS, 0
    while done < count:
        tree.codes[done] = UNDIVIDED
        if not find_forces(cones[done], motions, sites, clear, tree.forces[done], weights):
            if count + 2 > most:
                return UNDECIDED, done
            edge, a, b = edge_to_cut(cones[done], rays, weights)
            tree.codes[done] = edge
            # (4): the sum of the ends cuts the edge
            for d in range(rays.shape[1]):
                rays[made, d] = rays[a, d] + rays[b, d]
            fill_motions(made, rays, sites, axes, motions)
            bad[:] = 0.0
            for place in range(CONE_RAYS):
                bad += weights[place] * motions[cones[done, place]]
            # (5): a twist that no contact resists
            if is_open(motions[made], sites, tree.shifts) or is_open(bad, sites, tree.shifts):
                return REFUTED, done
            for j in range(CONE_RAYS):
                end = cones[done, j]
                cones[count, j] = made if end == a else end
                cones[count + 1, j] = made if end == b else end
            count, made = count + 2, made + 1
        done += 1
    return COVERED, done
