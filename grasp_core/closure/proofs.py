"""Proofs of force closure, and of its opposite, from the answer of the margin program.

Contacts are given at unit size: arms from their mean point, the longest of length one. The program
and the supports s_i are those of `force_closure`. Let d_i be the depth mu_i n_i.f_i - |tangential
part of f_i| of force i in its cone, or n_i.f_i without friction, w the wrench of all forces, and
sigma the sixth singular value of the matrix of wrenches that contacts can apply. A correction of
length c = (|w| + rounding) / sigma balances the forces, and takes no more than sqrt(1 + mu_i^2) c
from d_i. So forces prove closure, and the left side bounds the margin from below, if

    min_i (d_i - sqrt(1 + mu_i^2) c) / (sum n_i.f_i + sqrt(k) c)  >  0,                       (1)

and a twist y refutes closure if no support is positive but for rounding:

    s_i(y) <= rounding sqrt(1 + mu_i^2) |y|  for all i.                                       (2)

With the velocities v_i, M the largest support, and r_i = 1 / mu_i, or 1 without friction, a
negative M bounds the margin t from above:

    t  <=  M / sum_i r_i (M - n_i.v_i).                                                       (3)

For in forces with t + |tangential part of f_i| <= mu_i n_i.f_i the shares b_i = n_i.f_i - r_i t are
not negative, and their power, which is zero, is at most M sum_i b_i + t sum_i r_i n_i.v_i.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.closure.margin_program import (
    ROUNDING,
    TINY,
    allowed,
    deepest_forces,
    margin_program,
)
from grasp_core.closure.nearest_wrench import nearest_wrench
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.closure.wrenches import (
    WRENCH,
    contact_frames,
    grasp_map,
    in_frames,
    normal_and_tangential,
)
from grasp_core.errors import SolverError

DECIDED = 1e-9
"""Margins closer to zero are left undecided unless a certificate settles them: a hundred
times the tolerance asked of the solver."""
PRECISE = 1e-10
"""Gap that compiled code may leave, relative to the margin: below what the conic solver leaves."""
FAR = 1e3
"""Margins farther from zero, in units of the friction, come from nearly parallel normals; compiled
code is off by some per mille there, so the conic solver decides."""
INTERIOR = 1e-6
"""Depth inside its cone, for forces whose normal parts sum to 1, from which a contact counts as
carrying an interior force: far above what the solver leaves on a boundary."""
TOUCHING = 1e-9
"""Supports of a unit twist above minus this count as zero: the tolerance of the solver."""
NEWTON_STEPS = 3
GIANT = 1e100
"""Largest number accepted from a compiled search, which may end with larger ones, or with NaN,
where contacts are degenerate."""
RANK = 1e-9
"""Smallest singular value of the unit-size grasp map that counts as full rank."""


def supports(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """Compute the support s_i(y) of each friction cone, cut at unit normal force, (k,)."""
    velocities = twist[:3] + np.cross(twist[3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    return along + friction * across


def _generators(arms: Array, normals: Array, friction: Array) -> Array:
    """Return wrenches that span those of all contacts: three each, one each without friction."""
    G = grasp_map(arms)
    if (friction > 0.0).all():
        return G
    return in_frames(G, contact_frames(normals))[:, allowed(friction)]


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The margin program's answer, and which verdict it proves."""

    margin: float
    """Optimum of the program as it was found, dimensionless; only `closed` is proved."""
    forces: Array
    """Balancing forces, (k, 3); they prove closure if `closed` is True."""
    twist: Array
    """Twist of the dual program, (6,); it refutes closure if `closed` is False."""
    closed: bool | None
    """The verdict; None where neither closure nor its opposite is proved."""


def decide(arms: Array, normals: Array, friction: Array) -> Answer:
    """Decide closure of contacts at unit size: in compiled code, or else by the conic solver."""
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
    """Return the answer of compiled code if it is proved; that code knows one positive friction."""
    if not (friction[0] > 0.0 and (friction == friction[0]).all()):
        return None
    forces, twists, margins = deepest_forces(arms[None], normals[None], friction[:1], PRECISE)
    forces, twists = _without_giants(forces), _without_giants(twists)
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
    wrenches = WrenchSet(in_frames(grasp_map(arms), contact_frames(normals)), friction, "l1")
    _, facing = nearest_wrench(wrenches)
    refuted = refutes_closure(facing, arms, normals, friction)
    return Answer(-math.inf, np.zeros_like(arms), facing, closed=False if refuted else None)


def refutes_closure(twist: Array, arms: Array, normals: Array, friction: Array) -> bool:
    """Return whether no contact force within its cone works along a twist, (2)."""
    length = float(np.linalg.norm(twist))
    # over the length of the longest force with unit normal part, which rounding is relative to
    excess = supports(twist, arms, normals, friction) / np.sqrt(1.0 + friction**2)
    return 0.0 < length < math.inf and float(excess.max()) <= ROUNDING * length


def proves_closure(forces: Array, arms: Array, normals: Array, friction: Array) -> bool:
    """Return whether forces lie so deep in the cones that correcting them is harmless, (1)."""
    return proved_margin(forces, arms, normals, friction) > 0.0


def proved_margin(
    forces: Array, arms: Array, normals: Array, friction: Array, caution: float = 1.0
) -> float:
    """Compute the margin (1) that forces prove: their depth, less what their correction may cost.

    Args:
        forces: Nearly balanced contact forces, (k, 3).
        arms: Contacts at unit size, (k, 3).
        normals: Inward unit normals, (k, 3).
        friction: Coulomb coefficients, (k,).
        caution: Factor on the length c of the correction.

    Returns:
        A lower bound of the optimum of the margin program; minus infinity if there is none.
    """
    along, _ = normal_and_tangential(forces, normals)
    depth = _depth(forces, normals, friction)
    frictionless = friction[:, None] == 0.0
    # without friction only the normal parts act, so only they have to balance
    balanced = np.where(frictionless, along[:, None] * normals, forces)
    imbalance = float(np.linalg.norm(grasp_map(arms) @ balanced.ravel()))
    generators = _generators(arms, normals, friction)
    if generators.shape[1] < WRENCH or not np.isfinite(generators).all():
        return -math.inf
    least = float(np.linalg.svd(generators, compute_uv=False)[WRENCH - 1])
    if least <= RANK:
        return -math.inf
    # c of (1); its normal parts sum to at most sqrt(k) c
    corrected = caution * (imbalance + ROUNDING) / least
    pushes = float(along.sum()) + math.sqrt(len(arms)) * corrected
    left = float((depth - np.sqrt(1.0 + friction**2) * corrected).min())
    return left / pushes if pushes > 0.0 else -math.inf


def margin_ceiling(
    twist: Array, arms: Array, normals: Array, friction: Array, caution: float = 1.0
) -> float:
    """Compute the bound (3) of the margin, from a twist on which no support is positive.

    Args:
        twist: Velocity at the mean contact and angular velocity, (6,).
        arms: Contacts at unit size, (k, 3).
        normals: Inward unit normals, (k, 3).
        friction: Coulomb coefficients, (k,).
        caution: Factor on the rounding that is allowed for.

    Returns:
        An upper bound; zero, which bounds nothing but says that there is no closure, where the
        largest support M is zero to within rounding; infinity where M is more.
    """
    if not refutes_closure(twist, arms, normals, friction):
        return math.inf
    along, _ = normal_and_tangential(twist[:3] + np.cross(twist[3:], arms), normals)
    rounding = caution * ROUNDING * float(np.linalg.norm(twist)) * np.sqrt(1.0 + friction**2)
    # M of (3), which rounding may raise
    largest = float((supports(twist, arms, normals, friction) + rounding).max())
    if largest >= 0.0:
        return 0.0
    # r_i of (3); each term of the sum is raised by rounding, so that the bound is no less
    shares = np.where(friction == 0.0, 1.0, 1.0 / np.maximum(friction, TINY))
    return largest / float((shares * (largest - along + rounding)).sum())


def many_refute_closure(
    twists: Array, arms: Array, normals: Array, friction: Array
) -> NDArray[np.bool_]:
    """Return which of many sets of contacts, with one friction each, twists refute, as (2) says.

    Args:
        twists: One twist per set, (g, 6).
        arms: Contacts at unit size, (g, k, 3).
        normals: Inward unit normals, (g, k, 3).
        friction: Coulomb coefficient of each set, (g,).

    Returns:
        Truth values, (g,).
    """
    twists = _without_giants(twists)
    lengths = np.linalg.norm(twists, axis=1)
    velocities = twists[:, None, :3] + np.cross(twists[:, None, 3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    excess = (along + friction[:, None] * across).max(axis=1) / np.sqrt(1.0 + friction**2)
    return (lengths > 0.0) & (excess <= ROUNDING * lengths)


def many_prove_closure(
    forces: Array, arms: Array, normals: Array, friction: Array
) -> NDArray[np.bool_]:
    """Return which of many sets of contacts forces prove closed, as (1) says.

    Args:
        forces: Nearly balanced contact forces, (g, k, 3).
        arms: Contacts at unit size, (g, k, 3).
        normals: Inward unit normals, (g, k, 3).
        friction: Coulomb coefficient of each set, positive, (g,).

    Returns:
        Truth values, (g,).
    """
    forces = _without_giants(forces)
    along, across = normal_and_tangential(forces, normals)
    depths = (friction[:, None] * along - across).min(axis=1)
    maps = grasp_map(arms)
    stacked = forces.reshape(len(maps), maps.shape[2])
    imbalance = np.linalg.norm(np.einsum("gwj,gj->gw", maps, stacked), axis=1)
    least = np.linalg.svd(maps, compute_uv=False)[:, WRENCH - 1]
    # sqrt(1 + mu^2) c of (1)
    reach = np.sqrt(1.0 + friction**2) * (imbalance + ROUNDING) / np.maximum(least, RANK)
    return (least > RANK) & (depths > reach)


def _without_giants(vectors: Array) -> Array:
    """Replace vectors with huge numbers or NaN by zeros, which prove nothing."""
    axes = tuple(range(1, vectors.ndim))
    sizes = np.max(np.abs(vectors), axis=axes, keepdims=True, initial=0.0)
    return np.where(sizes < GIANT, vectors, 0.0)


def _touching_twist(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """Change a twist so that supports that are nearly zero are zero to within rounding.

    Where the margin is exactly zero, as with symmetric normals at just their critical friction, the
    solver's twist passes the cones by its own tolerance; Newton's method takes it onto them.
    """
    twist = twist / max(float(np.linalg.norm(twist)), TINY)
    for _ in range(NEWTON_STEPS):
        velocities = twist[:3] + np.cross(twist[3:], arms)
        along, across = normal_and_tangential(velocities, normals)
        excess = along + friction * across
        touched = excess > -TOUCHING
        # the gradient of s_i in y is the wrench of the force in cone i that works most along y
        sideways = (velocities - along[:, None] * normals) / np.maximum(across, TINY)[:, None]
        forces = (normals + friction[:, None] * sideways)[touched]
        slopes = np.hstack([forces, np.cross(arms[touched], forces)])
        step, *_ = np.linalg.lstsq(slopes, excess[touched], rcond=RANK)
        twist = twist - np.asarray(step, dtype=np.float64)
    return twist


def _twist_sparing_interior_forces(
    arms: Array, normals: Array, friction: Array, forces: Array
) -> Array | None:
    """Find a separating twist for contacts some of which balance each other inside their cones.

    The margin is zero there however far the other contacts are from completing closure. A
    separating twist must leave the balanced contacts at rest; within such twists the margin
    program is asked again, for the other contacts only, until it is negative or none is left.
    """
    rest = np.arange(len(arms))
    twists = np.eye(WRENCH)
    while True:
        depth = _depth(forces, normals[rest], friction[rest])
        balanced = depth > INTERIOR
        if not balanced.any():
            return None
        generators = _generators(
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


def _depth(forces: Array, normals: Array, friction: Array) -> Array:
    along, across = normal_and_tangential(forces, normals)
    return np.where(friction == 0.0, along, friction * along - across)


def _null_space(rows: Array, basis: Array) -> Array:
    """Return a basis of the part of the span of `basis` (columns) that `rows` maps to zero."""
    if not rows.size:
        return basis
    _, values, right = np.linalg.svd(rows)
    rank = int((values > RANK).sum())
    return basis @ right[rank:].T
