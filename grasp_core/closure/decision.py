"""Decides force closure of contacts: tries several ways to find forces or a twist that prove it.

`force_closure` derives the margin program, (1) to (3) there. It is solved in compiled code (see
`margin_kernel`), or else by the conic solver. `proofs` says what an answer proves. Margins of zero
need a twist that lies on the cones, or one that leaves contacts at rest that balance by themselves.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, cross
from grasp_core.closure.contacts import (
    WRENCH,
    contact_frames,
    grasp_map,
    in_frames,
    normal_and_tangential,
)
from grasp_core.closure.proofs import (
    CHECK_SLACK,
    RANK,
    SMALLEST_NORMAL,
    allowed,
    depths_in_cones,
    generators_of,
    proves_closure,
    refutes_closure,
    without_giants,
)
from grasp_core.closure.wrench_sets import WrenchSet, nearest_wrench
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.solvers.conic import ConicProgram, minimize

KERNEL = "grasp_core.closure.margin_kernel"
"""Kernel of the search for critical friction, which solves the same program at many frictions."""
SIGN_SHARE = 0.1
"""Gap, as in `margin_kernel`, that may be left where only the sign of a margin is asked for."""
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


def deepest_forces(
    arms: Array, normals: Array, friction: Array, share: float = SIGN_SHARE
) -> tuple[Array, Array, Array]:
    """Balance many sets of contacts with forces as deep in the cones as possible.

    Gives forces, (g, k, 3); twists, (g, 6), on which the supports are at most the margin over the
    friction; and lower and upper bounds of the margin, (g, 2), where the forces balance. A search
    that broke down, as on degenerate contacts, ends with bounds that have crossed or are NaN.
    """
    forces, twists = np.zeros_like(arms), np.zeros((len(arms), WRENCH))
    values = np.ones((len(arms), 2))
    given = tuple(np.array(each) for each in (arms, normals, friction))  # writable
    compiled(KERNEL).deepest(given, share, forces, twists, values)
    contacts = arms.shape[1]
    return forces, twists / contacts, friction[:, None] / contacts * (1.0 - values)


def margin_program(balance: Array, normals: Array, friction: Array) -> tuple[float, Array, Array]:
    """Solve for the margin t, balancing forces (k, 3), and the twist of the dual program, (m,).

    The forces balance if `balance`, (m, 3k), maps them to zero. The unknowns of a contact are its
    normal force and its tangential force over mu, so that small coefficients are solved as well as
    large ones; without friction only the normal force is unknown.
    """
    k, m = len(normals), len(balance)
    frames = contact_frames(normals) * np.array([np.ones(k), friction, friction]).T[:, None]
    free = allowed(friction)
    rows = in_frames(balance, frames)[:, free]
    pushing = np.tile([True, False, False], k)[free]
    if (departing := departing_twist(rows, pushing * 1.0)) is not None:
        return -math.inf, np.zeros((k, 3)), departing
    n = int(free.sum())
    largest = float(friction.max()) or 1.0
    flat = friction == 0.0
    A = np.zeros((m + 1 + n, n + 1))
    # (1) and (2) of `force_closure` as equations
    A[:m, :n], A[m, :n] = rows, pushing
    order = np.argsort(~np.repeat(flat, 3)[free], kind="stable")  # frictionless rows first
    A[m + 1 + np.arange(n), order] = -1.0
    # (3), over mu: the normal part less t / mu bounds the tangential part over mu
    depths = largest / np.where(flat, 1.0, np.maximum(friction, SMALLEST_NORMAL))
    A[m + 1 :, n] = np.where(pushing, np.repeat(depths, 3)[free], 0.0)[order]
    b, q = np.zeros(len(A)), np.zeros(n + 1)
    b[m], q[-1] = 1.0, -1.0
    flats = int(flat.sum())
    solution = minimize(ConicProgram(q, A, b, m + 1, flats, (3,) * (k - flats)))
    local = np.zeros(3 * k)
    x = solution.x[:-1]
    # what the solver leaves of the imbalance is taken off by least squares
    local[free] = x - np.asarray(np.linalg.lstsq(rows, rows @ x, rcond=None)[0], dtype=np.float64)
    forces = np.einsum("kij,kj->ki", frames, local.reshape(k, 3))
    return largest * float(solution.x[-1]), forces, -solution.z[:m]


def departing_twist(rows: Array, share: Array) -> Array | None:
    """Find a twist with which every contact leaves along its normal: then no forces balance."""
    sizes = np.maximum(np.linalg.norm(rows, axis=0), SMALLEST_NORMAL)
    scaled: Array = (rows / sizes).T
    twist = -np.asarray(np.linalg.lstsq(scaled, share / sizes, rcond=None)[0], dtype=np.float64)
    missed = np.abs(rows.T @ twist + share) / np.maximum(sizes, 1.0)
    if not np.isfinite(missed).all() or missed.max() > CHECK_SLACK * (
        1.0 + float(np.abs(twist).max())
    ):
        return None
    return twist


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The margin program's solution, and the verdict on force closure that it proves.

    Only `closed` is proved: True by `forces`, False by `twist`, (6,), and None by neither. Forces
    are (k, 3), or local coordinates of soft contacts, (k, 4).
    """

    margin: float
    forces: Array
    twist: Array
    closed: bool | None


def decide(arms: Array, normals: Array, friction: Array) -> Answer:
    """Decide force closure of contacts at unit size, in compiled code or by the conic solver."""
    answer = _decided_quickly(arms, normals, friction)
    return answer or _decided_by_programs(arms, normals, friction)


def _decided_by_programs(arms: Array, normals: Array, friction: Array) -> Answer:
    try:
        margin, forces, twist = margin_program(grasp_map(arms), normals, friction)
    except SolverError:
        # nearly parallel normals: no solution, or none to within rounding; the twist towards the
        # nearest wrench may refute closure
        _, facing = nearest_wrench(WrenchSet.at(arms, normals, friction))
        closed = False if refutes_closure(facing, arms, normals, friction) else None
        return Answer(-math.inf, np.zeros_like(arms), facing, closed)
    if proves_closure(forces, arms, normals, friction):
        return Answer(margin, forces, twist, closed=True)
    if margin < 0.0 and refutes_closure(twist, arms, normals, friction):
        return Answer(margin, forces, twist, closed=False)

    def pushed(twist: Array) -> tuple[Array, Array]:
        velocities = twist[:3] + cross(twist[3:], arms)
        along, across = normal_and_tangential(velocities, normals)
        slides = velocities - along[:, None] * normals
        sideways = slides / np.maximum(across, SMALLEST_NORMAL)[:, None]
        forces = normals + friction[:, None] * sideways
        return along + friction * across, np.hstack([forces, cross(arms, forces)])

    def held(some: Indices) -> Array:
        return generators_of(arms[some], normals[some], friction[some]).T

    def solved(twists: Array, rest: Indices) -> tuple[float, Array, Array]:
        margin, forces, reduced = margin_program(
            twists.T @ grasp_map(arms[rest]), normals[rest], friction[rest]
        )
        return margin, depths_in_cones(forces, normals[rest], friction[rest]), reduced

    # at a margin of zero, (2) holds once the twist is taken onto the cones
    if abs(margin) < DECIDED:
        touching = touching_twist(twist, pushed)
        if refutes_closure(touching, arms, normals, friction):
            return Answer(0.0, forces, touching, closed=False)
    # some contacts may balance by themselves: the margin is zero then, and only the others depart
    sparing = sparing_twist(depths_in_cones(forces, normals, friction), held, solved)
    if sparing is not None and refutes_closure(sparing, arms, normals, friction):
        return Answer(0.0, forces, sparing, closed=False)
    return Answer(margin, forces, twist, closed=None)


def _decided_quickly(arms: Array, normals: Array, friction: Array) -> Answer | None:
    """Return compiled code's answer if it is proved; it needs one positive friction for all."""
    if not (friction[0] > 0.0 and (friction == friction[0]).all()):
        return None
    closed, separated, margins, forces, twists = decided_at_once(
        arms[None], normals[None], float(friction[0])
    )
    if not (closed[0] or separated[0]):
        return None
    return Answer(float(margins[0]), forces[0], twists[0], closed=bool(closed[0]))


def decided_at_once(
    arms: Array, normals: Array, friction: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Array, Array, Array]:
    """Decide what compiled code can prove of many sets of contacts with one positive friction.

    Gives which sets are proved closed, and which separated; the margins, and the forces (g, k, 3)
    and twists (g, 6) that prove it.
    """
    every = np.full(len(arms), friction)
    forces, twists, margins = deepest_forces(arms, normals, every, PRECISE)
    forces, twists = without_giants(forces, 2), without_giants(twists, 1)
    lower, upper = margins.T
    with np.errstate(invalid="ignore"):  # a search that broke down ends with NaN
        close = np.abs(upper - lower) <= DECIDED * np.maximum(friction, np.abs(lower))
        close &= np.abs(lower) <= FAR * friction
        closed, separated = close & (lower > DECIDED), close & (upper < -DECIDED)
    every = every[:, None]
    closed[closed] = proves_closure(forces[closed], arms[closed], normals[closed], every[closed])
    separated[separated] = refutes_closure(
        twists[separated], arms[separated], normals[separated], every[separated]
    )
    return closed, separated, lower, forces, twists


def touching_twist(twist: Array, pushed: Callable[[Array], tuple[Array, Array]]) -> Array:
    """Change a twist so that supports that are nearly zero are zero up to rounding.

    Where the margin is exactly zero, as with symmetric normals at just their critical friction, the
    solver's twist passes the cones by its own tolerance; Newton's method takes it onto them.
    `pushed` gives the supports, (k,), and their gradients, (k, 6): each is the wrench of the force
    in the cone that works most along the twist.
    """
    twist = twist / max(float(np.linalg.norm(twist)), SMALLEST_NORMAL)
    for _ in range(NEWTON_STEPS):
        excess, gradients = pushed(twist)
        touched = excess > -TOUCHING
        step, *_ = np.linalg.lstsq(gradients[touched], excess[touched], rcond=RANK)
        twist = twist - np.asarray(step, dtype=np.float64)
    return twist


def sparing_twist(
    depths: Array,
    held: Callable[[Indices], Array],
    solved: Callable[[Array, Indices], tuple[float, Array, Array]],
) -> Array | None:
    """Find a separating twist where some contacts balance each other.

    Their forces are inside their cones, by `depths`, so the margin is zero however far the others
    are from completing closure. A separating twist must leave the balanced contacts at rest, all
    that `held` gives of them. Among such twists, (6, m), the margin program is `solved` again for
    the other contacts, until its optimum is negative or no contact is left.
    """
    rest, twists = np.arange(len(depths)), np.eye(WRENCH)
    while True:  # each turn takes balanced contacts from the rest, or returns
        balanced = depths > INTERIOR
        if not balanced.any():
            return None
        # a force inside its cone can work along all that its contact feels, so that must be zero
        twists = twists @ null_space(held(rest[balanced]) @ twists)
        rest = rest[~balanced]
        if not twists.shape[1]:
            return None
        if not rest.size:
            return twists[:, 0]
        margin, depths, reduced = solved(twists, rest)
        if margin < -DECIDED:
            return twists @ reduced
        if margin > DECIDED:
            return None


def null_space(rows: Array) -> Array:
    """Return orthonormal columns that `rows` maps to zero."""
    if not rows.size:
        return np.eye(rows.shape[1])
    _, values, right = np.linalg.svd(rows)
    return right[int((values > RANK).sum()) :].T
