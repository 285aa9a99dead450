"""Decides force closure of contacts: tries several ways to find forces or a twist that prove it.

The margin program is solved in compiled code, or else by the conic solver. `proofs` says what an
answer proves. Margins of zero need a twist that lies on the cones, or one that leaves contacts at
rest that balance by themselves.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.closure.margin_program import (
    SMALLEST_NORMAL,
    deepest_forces,
    margin_program,
)
from grasp_core.closure.proofs import (
    RANK,
    depths_in_cones,
    generators_of,
    proves_closure,
    refutes_closure,
    without_giants,
)
from grasp_core.closure.wrench_sets import WrenchSet, nearest_wrench
from grasp_core.closure.wrenches import WRENCH, grasp_map, normal_and_tangential
from grasp_core.errors import SolverError

DECIDED = 1e-9
"""Distance of a margin from zero below which it is left undecided unless a certificate settles it:
a hundred times the tolerance that the solver is asked for."""
PRECISE = 1e-10
"""Gap that compiled code may leave, relative to the margin: smaller than the gap that the conic
solver leaves."""
FAR = 1e3
"""Distance of a margin from zero, in units of the friction, above which the conic solver decides:
such margins come from nearly parallel normals, where compiled code has errors of some per mille."""
INTERIOR = 1e-6
"""Depth of a force inside its cone above which it counts as interior, if normal parts sum to 1: far
more than the solver leaves on a boundary."""
TOUCHING = 1e-9
"""Supports of a unit twist above minus this value count as zero: the tolerance of the solver."""
NEWTON_STEPS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The margin program's solution, and the verdict on force closure that it proves."""

    margin: float
    """Optimum of the program as the solver found it, dimensionless; only `closed` is proved."""
    forces: Array
    """Balancing forces, (k, 3); they prove closure if `closed` is True."""
    twist: Array
    """Twist of the dual program, (6,); it refutes closure if `closed` is False."""
    closed: bool | None
    """The verdict; None where neither closure nor its opposite is proved."""


def decide(arms: Array, normals: Array, friction: Array) -> Answer:
    """Decide force closure of contacts at unit size, in compiled code or by the conic solver."""
    answer = _decided_quickly(arms, normals, friction)
    return answer or _decided_by_programs(arms, normals, friction)


def _decided_by_programs(arms: Array, normals: Array, friction: Array) -> Answer:
    try:
        margin, forces, twist = margin_program(grasp_map(arms), normals, friction)
    except SolverError:
        # nearly parallel normals: the program has no solution, or none to within rounding
        return _apart(arms, normals, friction)
    if proves_closure(forces, arms, normals, friction):
        return Answer(margin, forces, twist, closed=True)
    if margin < 0.0 and refutes_closure(twist, arms, normals, friction):
        return Answer(margin, forces, twist, closed=False)
    # at a margin of zero, (2) holds once the twist is taken onto the cones
    if abs(margin) < DECIDED:
        touching = _touching_twist(twist, arms, normals, friction)
        if refutes_closure(touching, arms, normals, friction):
            return Answer(0.0, forces, touching, closed=False)
    # some contacts may balance by themselves: the margin is zero then, and only the others depart
    sparing = _twist_sparing_interior_forces(arms, normals, friction, forces)
    if sparing is not None and refutes_closure(sparing, arms, normals, friction):
        return Answer(0.0, forces, sparing, closed=False)
    return Answer(margin, forces, twist, closed=None)


def _decided_quickly(arms: Array, normals: Array, friction: Array) -> Answer | None:
    """Return compiled code's answer if it is proved; it needs one positive friction for all."""
    if not (friction[0] > 0.0 and (friction == friction[0]).all()):
        return None
    forces, twists, margins = deepest_forces(arms[None], normals[None], friction[:1], PRECISE)
    forces, twists = without_giants(forces, 2), without_giants(twists, 1)
    lower, upper = (float(each) for each in margins[0])
    scale = float(friction[0])
    close = abs(upper - lower) <= DECIDED * max(scale, abs(lower)) and abs(lower) <= FAR * scale
    if not close:  # nor if one is not a number
        return None
    if lower > DECIDED and proves_closure(forces[0], arms, normals, friction):
        return Answer(lower, forces[0], twists[0], closed=True)
    if upper < -DECIDED and refutes_closure(twists[0], arms, normals, friction):
        return Answer(lower, forces[0], twists[0], closed=False)
    return None


def _apart(arms: Array, normals: Array, friction: Array) -> Answer:
    """Refute closure by the twist towards the nearest wrench, or leave it undecided."""
    wrenches = WrenchSet.at(arms, normals, friction)
    _, facing = nearest_wrench(wrenches)
    refuted = refutes_closure(facing, arms, normals, friction)
    return Answer(-math.inf, np.zeros_like(arms), facing, closed=False if refuted else None)


def _touching_twist(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """Change a twist so that supports that are nearly zero are zero up to rounding.

    Where the margin is exactly zero, as with symmetric normals at just their critical friction, the
    solver's twist passes the cones by its own tolerance; Newton's method takes it onto them.
    """
    twist = twist / max(float(np.linalg.norm(twist)), SMALLEST_NORMAL)
    for _ in range(NEWTON_STEPS):
        velocities = twist[:3] + cross(twist[3:], arms)
        along, across = normal_and_tangential(velocities, normals)
        excess = along + friction * across
        touched = excess > -TOUCHING
        # the gradient of s_i in y is the wrench of the force in cone i that works most along y
        sideways = (velocities - along[:, None] * normals) / np.maximum(across, SMALLEST_NORMAL)[
            :, None
        ]
        forces = (normals + friction[:, None] * sideways)[touched]
        slopes = np.hstack([forces, cross(arms[touched], forces)])
        step, *_ = np.linalg.lstsq(slopes, excess[touched], rcond=RANK)
        twist = twist - np.asarray(step, dtype=np.float64)
    return twist


def _twist_sparing_interior_forces(
    arms: Array, normals: Array, friction: Array, forces: Array
) -> Array | None:
    """Find a separating twist where some contacts balance each other.

    Their forces are inside their cones, so the margin is zero however far the other contacts are
    from completing closure. A separating twist must leave the balanced contacts at rest; among such
    twists the margin program is solved again, for the other contacts only, until its optimum is
    negative or no contact is left.
    """
    rest = np.arange(len(arms))
    twists = np.eye(WRENCH)
    while True:  # each turn takes balanced contacts from the rest, or returns
        depth = depths_in_cones(forces, normals[rest], friction[rest])
        balanced = depth > INTERIOR
        if not balanced.any():
            return None
        generators = generators_of(
            arms[rest[balanced]], normals[rest[balanced]], friction[rest[balanced]]
        )
        # a force inside its cone can work along every velocity of its contact, so that must be zero
        twists = _null_space(generators.T @ twists, twists)
        rest = rest[~balanced]
        if not twists.shape[1]:
            return None
        if not rest.size:
            return twists[:, 0]
        balance = twists.T @ grasp_map(arms[rest])
        margin, forces, reduced = margin_program(balance, normals[rest], friction[rest])
        if margin < -DECIDED:
            return twists @ reduced
        if margin > DECIDED:
            return None


def _null_space(rows: Array, basis: Array) -> Array:
    """Return a basis of the vectors in the span of `basis` (columns) that `rows` maps to 0."""
    if not rows.size:
        return basis
    _, values, right = np.linalg.svd(rows)
    rank = int((values > RANK).sum())
    return basis @ right[rank:].T
