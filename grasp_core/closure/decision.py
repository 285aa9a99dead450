"""Decides force closure of contacts: tries several ways to find forces or a twist that prove it.

`force_closure` derives the margin program, (1) to (3) there. For hard contacts with one friction it
is solved in compiled code (see `margin_kernel`), or else by the conic solver. `proofs` says what an
answer proves. Margins of zero need a twist that lies on the cones, or one that leaves contacts at
rest that balance by themselves.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.closure.contacts import WRENCH, in_frames, normal_and_tangential
from grasp_core.closure.proofs import (
    CHECK_SLACK,
    LEAST_DIVISOR,
    RANK,
    ContactCones,
    proves_closure,
    refutes_closure,
    without_giants,
)
from grasp_core.closure.wrench_sets import WrenchSet, contact_program, nearest_wrench
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.solvers.conic import minimize

MARGIN_KERNEL = "grasp_core.closure.margin_kernel"
"""Kernel of the search for critical friction, which solves the same program at many frictions."""
SIGN_SHARE = 0.1
"""Gap, as in `margin_kernel`, that may be left where only the sign of a margin is asked for."""
DECIDED = 1e-9
"""Distance of a margin from zero below which it is left undecided unless a certificate settles it:
a hundred times the tolerance that the solver is asked for."""
PRECISE = 1e-10
"""Gap that compiled code may leave, relative to the margin: smaller than the gap that the conic
solver leaves."""
FAR_MARGIN = 1e3
"""Distance of a margin from zero, in units of the friction, above which the conic solver decides:
such margins come from nearly parallel normals, where compiled code has errors of some per mille."""
INTERIOR = 1e-6
"""Depth of a force inside its cone above which it counts as interior, if normal parts sum to 1: far
more than the solver leaves on a boundary."""
TOUCHING_SUPPORT = 1e-9
"""Supports of a unit twist above minus this value count as zero: the tolerance of the solver."""
NEWTON_STEPS = 3


def deepest_forces(
    arms: Array, normals: Array, friction: Array, share: float = SIGN_SHARE
) -> tuple[Array, Array, Array]:
    """Balance many sets of hard contacts with forces as deep in the cones as possible.

    Gives forces, (g, k, 3); twists, (g, 6), on which the supports are at most the margin over the
    friction; and lower and upper bounds of the margin, (g, 2), where the forces balance. A search
    that broke down, as on degenerate contacts, ends with bounds that have crossed or are NaN.
    """
    forces, twists = np.zeros_like(arms), np.zeros((len(arms), WRENCH))
    values = np.ones((len(arms), 2))
    given = tuple(np.array(each) for each in (arms, normals, friction))  # writable
    compiled(MARGIN_KERNEL).deepest(given, share, forces, twists, values)
    contacts = arms.shape[1]
    return forces, twists / contacts, friction[:, None] / contacts * (1.0 - values)


def margin_program(cones: ContactCones, balance: Array) -> tuple[float, Array, Array]:
    """Solve for the margin t, balancing forces (k, w), and the twist of the dual program, (m,).

    The forces balance if `balance`, (m, k w), maps them to zero. The unknowns of a contact are its
    normal force and the other parts over mu, so that small coefficients are solved as well as large
    ones; without friction only the normal force is unknown.
    """
    k, width = cones.normals.shape
    n, flat = k * width, cones.friction == 0.0
    frames = cones.frames
    frames[:, :, 1:] *= cones.friction[:, None, None]
    rows = in_frames(balance, frames)
    pushing = np.eye(n)[::width].sum(axis=0)
    used = cones.sliding.ravel()
    if (departing := _departing_twist(rows[:, used], pushing[used])) is not None:
        return -math.inf, np.zeros((k, width)), departing
    # (1) and (2) of `force_closure` as equations, then (3) over mu: the normal part less t / mu
    # bounds the other parts over mu, with t in units that keep its column of order one
    forces, depth = np.eye(n, n + 1), np.eye(n + 1)[n]
    equal = (rows @ forces, 0.0), (pushing[None] @ forces, 1.0)
    largest = float(cones.friction.max()) or 1.0
    depths = largest / np.where(flat, 1.0, np.maximum(cones.friction, LEAST_DIVISOR))
    answer = minimize(contact_program(-depth, 1.0 - flat, width, equal, room=depths))
    # what the solver leaves of the imbalance is taken off by least squares
    x = answer.x[:-1]
    x = x - np.asarray(np.linalg.lstsq(rows, rows @ x, rcond=None)[0], dtype=np.float64)
    forces = np.einsum("kij,kj->ki", frames, x.reshape(k, width))
    return largest * float(answer.x[-1]), forces, -answer.z[: len(balance)]


def _departing_twist(rows: Array, share: Array) -> Array | None:
    """Find a twist with which every contact leaves along its normal: then no forces balance."""
    sizes = np.maximum(np.linalg.norm(rows, axis=0), LEAST_DIVISOR)
    scaled: Array = (rows / sizes).T
    twist = -np.asarray(np.linalg.lstsq(scaled, share / sizes, rcond=None)[0], dtype=np.float64)
    missed = np.abs(rows.T @ twist + share) / np.maximum(sizes, 1.0)
    allowed = CHECK_SLACK * (1.0 + float(np.abs(twist).max()))
    return twist if np.isfinite(missed).all() and missed.max() <= allowed else None


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """The margin program's solution, and the verdict on force closure that it proves.

    Only `closed` is proved: True by `forces`, (k, w), False by `twist`, (6,), and None by neither.
    """

    margin: float
    forces: Array
    twist: Array
    closed: bool | None


def decide(cones: ContactCones) -> Decision:
    """Decide force closure of one set of contacts, in compiled code or by the conic solver."""
    return _decided_quickly(cones) or _decided_by_programs(cones)


def _decided_by_programs(cones: ContactCones) -> Decision:
    try:
        margin, forces, twist = margin_program(cones, cones.maps)
    except SolverError:
        # nearly parallel normals: no solution, or none to within rounding; the twist towards the
        # nearest wrench may refute closure
        _, twist = nearest_wrench(WrenchSet.within(cones, "l1"))
        closed = False if refutes_closure(cones, twist) else None
        return Decision(-math.inf, np.zeros_like(cones.normals), twist, closed)
    if proves_closure(cones, forces):
        return Decision(margin, forces, twist, closed=True)
    if margin < 0.0 and refutes_closure(cones, twist):
        return Decision(margin, forces, twist, closed=False)
    # at a margin of zero, (2) holds once the twist is taken onto the cones
    others = [_touching_twist(cones, twist)] if abs(margin) < DECIDED else []
    # some contacts may balance by themselves: the margin is zero then, and only the others depart
    sparing = _sparing_twist(cones, cones.depths(forces))
    if sparing is not None:
        others += [sparing, _touching_twist(cones, sparing)]
    for each in others:
        if refutes_closure(cones, each):
            return Decision(0.0, forces, each, closed=False)
    return Decision(margin, forces, twist, closed=None)


def _decided_quickly(cones: ContactCones) -> Decision | None:
    """Return compiled code's answer if it is proved, for hard contacts with one friction."""
    alike = (cones.friction > 0.0).all() and np.ptp(cones.friction) == 0.0
    if cones.torsion is not None or not alike:
        return None
    one = ContactCones.at(cones.arms[None], cones.inward[None], cones.friction[None])
    closed, separated, margins, forces, twists = decided_at_once(one)
    if not (closed[0] or separated[0]):
        return None
    return Decision(float(margins[0]), forces[0], twists[0], closed=bool(closed[0]))


def decided_at_once(
    cones: ContactCones,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Array, Array, Array]:
    """Decide hard contacts with friction: closed, separated, margins, proving forces and twists."""
    friction = cones.friction[:, 0]
    forces, twists, margins = deepest_forces(cones.arms, cones.inward, friction, PRECISE)
    forces, twists = without_giants(forces, 2), without_giants(twists, 1)
    lower, upper = margins.T
    with np.errstate(invalid="ignore"):  # a search that broke down ends with NaN
        close = np.abs(upper - lower) <= DECIDED * np.maximum(friction, np.abs(lower))
        close &= np.abs(lower) <= FAR_MARGIN * friction
        closed, separated = close & (lower > DECIDED), close & (upper < -DECIDED)
    closed[closed] = proves_closure(cones.only(closed), forces[closed])
    separated[separated] = refutes_closure(cones.only(separated), twists[separated])
    return closed, separated, lower, forces, twists


def _touching_twist(cones: ContactCones, twist: Array) -> Array:
    """Change a twist so that supports that are nearly zero are zero up to rounding.

    Where the margin is exactly zero, as with symmetric normals at just their critical friction, the
    solver's twist passes the cones by its own tolerance; Newton's method takes it onto them. The
    gradient of a support is the wrench of the force in the cone that works most along the twist.
    """
    maps = cones.maps.reshape(WRENCH, *cones.normals.shape)
    twist = twist / max(float(np.linalg.norm(twist)), LEAST_DIVISOR)
    for _ in range(NEWTON_STEPS):
        velocities = cones.velocities(twist)
        along, across = normal_and_tangential(velocities, cones.normals)
        sideways = velocities - along[:, None] * cones.normals
        sideways = sideways / np.maximum(across, LEAST_DIVISOR)[:, None]
        working = cones.normals + cones.friction[:, None] * sideways
        gradients: Array = np.einsum("wkj,kj->kw", maps, working)
        excess: Array = along + cones.friction * across
        touched = excess > -TOUCHING_SUPPORT
        step, *_ = np.linalg.lstsq(gradients[touched], excess[touched], rcond=RANK)
        twist = twist - np.asarray(step, dtype=np.float64)
    return twist


def _sparing_twist(cones: ContactCones, depths: Array) -> Array | None:
    """Find a separating twist where some contacts balance each other.

    Their forces are inside their cones, by `depths`, so the margin is zero however far the others
    are from completing closure. A separating twist must leave the balanced contacts at rest, in all
    that they feel. Among such twists, (6, m), the margin program is solved again for the other
    contacts, until its optimum is negative or no contact is left.
    """
    twists = np.eye(WRENCH)
    while True:  # each turn takes balanced contacts from the rest, or returns
        balanced = depths > INTERIOR
        if not balanced.any():
            return None
        # a force inside its cone can work along all that its contact feels, so that must be zero
        twists = twists @ null_space(cones.only(balanced).generators.T @ twists)
        cones = cones.only(~balanced)
        if not twists.shape[1]:
            return None
        if balanced.all():
            return twists[:, 0]
        try:
            margin, forces, reduced = margin_program(cones, twists.T @ cones.maps)
        except SolverError:
            return None
        if margin < -DECIDED:
            return twists @ reduced
        if margin > DECIDED:
            return None
        depths = cones.depths(forces)


def null_space(rows: Array) -> Array:
    """Return orthonormal columns that `rows` maps to zero."""
    if not rows.size:
        return np.eye(rows.shape[1])
    _, values, right = np.linalg.svd(rows)
    return right[int((values > RANK).sum()) :].T
