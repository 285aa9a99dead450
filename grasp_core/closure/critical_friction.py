"""Finds the critical friction, the least coefficient above which contacts are in force closure.

Solved: where the margin of the closure program changes sign as the common friction grows.

Force closure at one friction is force closure at every larger one, so the threshold is unique.
It is bracketed by certificates: balancing forces f_i bound it from above by their own steepest
angle, a separating twist with velocities v_i from below by the friction up to which it separates,

    mu  <=  max_i |tangential part of f_i| / n_i.f_i,                                         (1)
    mu  >=  min_i -n_i.v_i / |tangential part of v_i|.                                        (2)

On either side of its zero the margin is nearly linear in the friction. Its slope follows from the
program's answer: with tau the margin over mu, and the tangential forces in units of mu, friction
enters the program only through the balance, whose multiplier is the twist, so that

    d tau / d mu  =  sum v_i . (tangential part of f_i) / mu,                                 (3)

v_i being the velocity of contact i under the twist. Newton's method says where to try next.

A compiled search of the same kind comes first (see `margin_kernel`). The forces and the
twist that it finds are checked like all others; where there are none, or their interval is not
narrow, `friction_search` goes program by program, with proofs in rational arithmetic; with torsion,
it searches below what hard fingers need.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import Array, cross
from grasp_core.closure.contacts import (
    WRENCH,
    contact_arrays,
    contact_torsions,
    normal_and_tangential,
    unit_size,
)
from grasp_core.closure.decision import KERNEL, deepest_forces
from grasp_core.closure.friction_interval import FRICTIONLESS, REPORTED_AS_ZERO, FrictionInterval
from grasp_core.closure.friction_search import (
    FRICTION_ACCURACY,
    SHAVED,
    Ends,
    searched,
    soft_ends,
)
from grasp_core.closure.proofs import CHECK_SLACK, ContactCones, proves_closure
from grasp_core.compiled import compiled
from grasp_core.kinds import LARGEST_FRICTION
from grasp_core.values import Contact, Grasp

NO_FORCE = 1e-100
"""Least normal force that is divided by: a contact that does not push would need infinite friction.
"""
SEARCHED = 0.95
"""Share of the wanted accuracy that the compiled search uses; the rest is left for rounding."""


def critical_friction(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    *,
    torsion_m: ArrayLike = 0.0,
) -> float:
    """Find the least common Coulomb coefficient that is proved enough for force closure.

    It is the upper end of an interval whose lower end is proved to be too little (see
    `critical_friction_interval`). In tests on 20,000 sets of contacts, half of them on grids, the
    interval is at most 6e-8 wide, or that share of its upper end where this is above 1.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]. It stays as it
            is whatever the friction; zero is a hard finger.

    Returns:
        The upper end: every larger coefficient suffices, by balanced forces inside the cones. It is
        0.0 where closure is proved at `REPORTED_AS_ZERO`, and `math.inf` where closure is
        proved at no friction up to `LARGEST_FRICTION`.

    Raises:
        InputError: Shapes or lengths are wrong.
    """
    points, units = contact_arrays(positions, normals)
    torsions = contact_torsions(torsion_m, np.ones(len(points)))
    hard = float(_upper_ends(points[None], units[None])[0])
    if torsions is None or hard == 0.0:
        return hard
    arms, _, size = unit_size(points)
    cones = ContactCones.at(arms, units, np.ones(len(points)), torsions / size)
    upper = min(soft_ends(cones, hard).upper, hard)
    return 0.0 if upper <= REPORTED_AS_ZERO else upper


def critical_frictions(
    positions: ArrayLike | Iterable[Grasp],
    normals: ArrayLike | None = None,
) -> Array:
    """Find the critical friction of each of many sets of contacts.

    `critical_friction` explains how it is found and proved.

    Args:
        positions: Contact points, (g, k, 3) [m], k >= 2; or grasps.
        normals: Unit vectors into the object, (g, k, 3).

    Returns:
        Upper ends of the intervals, (g,).

    Raises:
        InputError: Shapes or lengths are wrong.
    """
    return _upper_ends(*contact_arrays(positions, normals, many=True))


def critical_friction_interval(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
) -> FrictionInterval:
    """Find proved bounds of the critical friction, with the forces and twist as proof.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).

    Returns:
        The interval; its upper end is at least `FRICTIONLESS`, below which closure is not sought.

    Raises:
        InputError: Shapes or lengths are wrong.
    """
    points, units = contact_arrays(positions, normals)
    found, upper, forces, twists = _at_once(points[None], units[None])
    ends = Ends.of(points, units)
    # the quick answer is proved again in rational arithmetic before it is kept
    if found[0]:
        ends.close(forces[0], float(upper[0]), exactly=True)
        ends.open(twists[0])
    quick = ends.interval(points)
    if ends.settled:
        return quick
    slow = searched(points, units).interval(points)
    # the upper end is the one that `critical_friction` gives
    return slow if quick.forces is None else replace(slow, upper=quick.upper, forces=quick.forces)


def _upper_ends(points: Array, units: Array) -> Array:
    found, upper, _, _ = _at_once(points, units)
    for i in np.flatnonzero(~found):
        upper[i] = searched(points[i], units[i]).upper
    upper[upper <= REPORTED_AS_ZERO] = 0.0
    return upper


def _at_once(points: Array, normals: Array) -> tuple[NDArray[np.bool_], Array, Array, Array]:
    """Search for narrow intervals in compiled code, and prove both of their ends.

    Gives where one was found; upper ends, and forces and twists that prove closure just there.
    """
    arms, _, _ = unit_size(points)
    units = np.array(normals)  # writable, like all that the search is compiled for
    forces, twists = np.zeros_like(arms), np.zeros((len(arms), WRENCH))
    bounds, found = np.zeros((len(arms), 2)), np.zeros(len(arms), dtype=bool)
    compiled(KERNEL).search(arms, units, SEARCHED * FRICTION_ACCURACY, forces, twists, bounds)
    # (2): the friction for which the search says that its twists separate
    lower = bounds[:, 0]
    bounded = (lower > FRICTIONLESS) & (lower < 0.5 * LARGEST_FRICTION)
    bounded &= _separate(twists, arms, units, lower)
    highest = lower * (1.0 + FRICTION_ACCURACY - 2.0 * SHAVED)
    with np.errstate(over="ignore", invalid="ignore"):  # degenerate contacts, proved nothing below
        along, across = normal_and_tangential(forces, units)
    # (1): the friction that the forces need, raised by a tenth of the width so that they lie inside
    upper = (across / np.maximum(along, NO_FORCE)).max(axis=1) * (1.0 + 0.1 * FRICTION_ACCURACY)
    near = np.flatnonzero(bounded & (upper <= highest))
    found[near] = _close(forces[near], arms[near], units[near], upper[near])
    # where these forces do not prove closure, the deepest ones at the highest allowed end may
    left = np.flatnonzero(bounded & ~found)
    upper[left] = highest[left]
    forces[left], _, _ = deepest_forces(arms[left], units[left], highest[left])
    found[left] = _close(forces[left], arms[left], units[left], highest[left])
    return found, upper, forces, twists


def _close(forces: Array, arms: Array, normals: Array, friction: Array) -> NDArray[np.bool_]:
    """Return which forces prove closure at one friction for all contacts of a set."""
    return proves_closure(ContactCones.at(arms, normals, friction[..., None]), forces)


def _separate(twists: Array, arms: Array, normals: Array, friction: Array) -> NDArray[np.bool_]:
    """Return which twists leave each contact at rest, or departing as steeply as (2) asks.

    Each contact may move by the rounding of its own speed only: that of the whole twist is too much
    where the margin grows with the square of the friction.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        sizes = np.linalg.norm(twists, axis=1)[:, None]
        velocities = twists[:, None, :3] + cross(twists[:, None, 3:], arms)
        along, across = normal_and_tangential(velocities, normals)
        departs = along + friction[:, None] * across <= CHECK_SLACK * np.hypot(along, across)
        still = np.hypot(along, across) <= CHECK_SLACK * sizes
    return (np.isfinite(sizes) & (sizes > 0.0) & (departs | still)).all(axis=1)
