"""Keeps twists that are worth asking, and finds new ones by descent, compiled.

Twists that have divided or refuted much are kept. They are weighed by the multiple of the loads
that they allow: support over demand, (1) of `measures`.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.optimizing.replay_kernel import SLOPE_NUMBERS, Pieces, slopes


@loop("numpy")
def extent(corners: Array, count: int, ends: Indices) -> float:
    """Return the largest distance of two corners, and fill in which two they are, (2,)."""
    largest = 0.0
    for k in range(count):
        for j in range(k):
            da, db = corners[k, 0] - corners[j, 0], corners[k, 1] - corners[j, 1]
            square = da * da + db * db
            if square > largest:
                largest, ends[0], ends[1] = square, j, k
    return np.sqrt(largest)


@loop("numpy")
def area(corners: Array, count: int) -> float:
    """Return the area of a polygon."""
    total = 0.0
    for k in range(count):
        following = (k + 1) % count
        total += corners[k, 0] * corners[following, 1] - corners[following, 0] * corners[k, 1]
    return 0.5 * abs(total)


TWIST = 6
OVER = 1.0 + 4e-16  # factor that makes rounded unit twists at least one long
SETTLING = 5  # steps without progress after which a descent aims less far
FIRST_AIM, LAST_AIM = 0.2, 0.004
"""Share of the value that a step aims below the best one, at first and before a descent ends."""
QUALITY_DEMAND, WEIGHT_DEMAND, TASK_DEMAND = 0, 1, 2  # kinds of demands
SMALL_DEMAND = 1e-2
"""Demand below which descents take this one, and twists with negative support are compared by it.
"""


class Demand(NamedTuple):
    """The loads whose largest resisted multiple is sought."""

    kind: int
    """Whose length is at most one (`QUALITY_DEMAND` for wrenches, `WEIGHT_DEMAND` for forces), or
    of a `TASK_DEMAND`."""
    loads: Array  # loads of a task, (m, 6)


class Pool(NamedTuple):
    """Twists to ask, with what they ask of each piece."""

    twists: Array  # twists at least one long, with torques over the object's radius, (c, 6)
    demands: Array  # how much of the loads each asks for, (c,)
    asked: Array  # the `slopes` of each piece under each twist, (p, 6, c)
    used: Indices  # when each was used last, (c,)
    names: Indices  # their places among the twists that a tree names, -1 for none, (c,)
    size: Indices  # how many there are, (1,)


@loop("numpy")
def learn(pool: Pool, pieces: Pieces, demand: Demand, y: Array, now: int) -> int:
    """Put a twist into the pool, in place of the one unused for longest if that is full."""
    place = pool.size[0]
    if place < len(pool.used):
        pool.size[0] += 1
    else:
        place = 0
        for k in range(len(pool.used)):
            if pool.used[k] < pool.used[place]:
                place = k
    length = 0.0
    for j in range(TWIST):
        length += y[j] * y[j]
    length = np.sqrt(length)
    for j in range(TWIST):
        pool.twists[place, j] = y[j] / length * OVER
    pool.demands[place] = demanded(demand, pool.twists[place], np.empty(TWIST))
    at = np.empty(SLOPE_NUMBERS)
    for p in range(len(pieces.normals)):
        slopes(pieces, p, pool.twists[place], at)
        copy(at, pool.asked[p, :, place])
    pool.used[place], pool.names[place] = now, -1
    return place


@loop("numpy")
def demanded(demand: Demand, y: Array, hardest: Array) -> float:
    """Return how much of the loads a unit twist asks for, and fill in minus the load that does.

    For the usual measure that is one; its load, along the twist, is left out, as descents move
    across it.
    """
    hardest[:] = 0.0
    if demand.kind == QUALITY_DEMAND:
        return 1.0
    if demand.kind == WEIGHT_DEMAND:
        long = np.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
        if long > 0.0:
            for j in range(3):
                hardest[j] = y[j] / long
        return long
    most = 0.0
    for load in demand.loads:
        found = 0.0
        for j in range(TWIST):
            found -= load[j] * y[j]
        if found > most:
            most = found
            for j in range(TWIST):
                hardest[j] = -load[j]
    return most


@loop("numpy")
def multiple(support: float, asked: float) -> float:
    """Return the multiple of the loads that a twist allows; a negative one if it allows none.

    It is below a positive number t if and only if the support is below t times what is asked for.
    """
    if support < 0.0:
        return support / max(asked, SMALL_DEMAND)
    return support / asked if asked > 0.0 else np.inf


@loop("numpy")
def highest(pieces: Pieces, points: Array, on: Indices, y: Array, slope: Array) -> float:
    """Return the largest support of contacts at points in a direction; fill in its wrench, (6,)."""
    best, first = -np.inf, 0
    for i in range(len(points)):
        _, along, across = _velocity(pieces.normals[on[i]], points[i], y)
        found = along + pieces.friction * across
        if found > best:
            best, first = found, i
    n, x = pieces.normals[on[first]], points[first]
    (u0, u1, u2), along, across = _velocity(n, x, y)
    share = pieces.friction / across if across > 0.0 else 0.0
    f0 = n[0] + share * (u0 - along * n[0])
    f1 = n[1] + share * (u1 - along * n[1])
    f2 = n[2] + share * (u2 - along * n[2])
    slope[0], slope[1], slope[2] = f0, f1, f2
    slope[3] = x[1] * f2 - x[2] * f1
    slope[4] = x[2] * f0 - x[0] * f2
    slope[5] = x[0] * f1 - x[1] * f0
    return best


@loop("numpy")
def _velocity(n: Array, x: Array, y: Array) -> tuple[tuple[float, float, float], float, float]:
    """Return the velocity of a point under a twist, with its parts along and across a normal."""
    u0 = y[0] + y[4] * x[2] - y[5] * x[1]
    u1 = y[1] + y[5] * x[0] - y[3] * x[2]
    u2 = y[2] + y[3] * x[1] - y[4] * x[0]
    along = n[0] * u0 + n[1] * u1 + n[2] * u2
    square = u0 * u0 + u1 * u1 + u2 * u2 - along * along
    return (u0, u1, u2), along, np.sqrt(max(square, 0.0))


@loop("numpy")
def descend(
    pieces: Pieces, demand: Demand, points: Array, on: Indices, y: Array, steps: int, spare: float
) -> float:
    """Move a unit twist to where contacts resist less; return the least multiple that one allows.

    For other measures than the usual one supports are taken to be larger by `spare` in the end.

    Each step follows the wrench that attains the support, less the load that asks for most, as far
    as would lower the multiple to an aim if these stayed the largest.
    """
    at, best, slope, hardest = y.copy(), np.inf, np.empty(TWIST), np.empty(TWIST)
    aim, idle = FIRST_AIM, 0
    for _ in range(steps):
        found = _steepest(pieces, demand, points, on, at, slope, hardest)
        if found < best:
            idle = 0 if found < best - 0.25 * aim * abs(best) else idle + 1
            best = found
            copy(at, y)
        else:
            idle += 1
        if idle >= SETTLING:
            aim, idle = 0.4 * aim, 0
            copy(y, at)
            if aim < LAST_AIM:
                break
            found = _steepest(pieces, demand, points, on, at, slope, hardest)
        along, square = 0.0, 0.0
        for j in range(TWIST):
            along += slope[j] * at[j]
        for j in range(TWIST):
            slope[j] -= along * at[j]
            square += slope[j] * slope[j]
        if square <= 0.0:
            break
        step = (found - (best - aim * abs(best))) / square
        length = 0.0
        for j in range(TWIST):
            at[j] -= step * slope[j]
            length += at[j] * at[j]
        length = np.sqrt(length)
        for j in range(TWIST):
            at[j] /= length
    if demand.kind == QUALITY_DEMAND:
        return best
    found = highest(pieces, points, on, y, slope)
    return multiple(found + spare, demanded(demand, y, hardest))


@loop("numpy")
def _steepest(
    pieces: Pieces, demand: Demand, points: Array, on: Indices, y: Array, slope: Array,
    hardest: Array,
) -> float:  # fmt: skip
    """Return the multiple that a twist allows, asked for a little at least; fill in its slope."""
    found = highest(pieces, points, on, y, slope)
    if demand.kind == QUALITY_DEMAND:
        return found
    asked = demanded(demand, y, hardest)
    if asked < SMALL_DEMAND:
        asked = SMALL_DEMAND
        hardest[:] = 0.0
    found /= asked
    for j in range(TWIST):
        slope[j] = (slope[j] - found * hardest[j]) / asked
    return found
