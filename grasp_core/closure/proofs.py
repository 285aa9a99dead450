"""The margin program of force closure and what its answer proves (see `closure`).

Contacts are given at unit size: arms from their mean point, the longest of length one.
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
"""The gap left by compiled code, relative to the margin: below what the conic solver leaves."""
FAR = 1e3
"""Margins farther from zero, in units of the friction, are those of nearly parallel normals, where
compiled code is off by some per mille; the programs are asked."""
INTERIOR = 1e-6
"""Depth inside its cone, of forces whose normal parts sum to 1, from which a contact counts
as carrying an interior force: far above what the solver leaves on a boundary."""
TOUCHING = 1e-9
"""Supports of a unit twist above minus this are taken for zero by its solver's tolerance."""
NEWTON_STEPS = 3
GIANT = 1e100
"""Compiled searches may end with such numbers, or with none, where contacts are degenerate."""
RANK = 1e-9
"""Smallest singular value of the unit-size grasp map that counts as full rank."""


def supports(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """Support s_i(y) of each friction cone, cut at unit normal force, in direction y, (k,)."""
    velocities = twist[:3] + np.cross(twist[3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    return along + friction * across


def _generators(arms: Array, normals: Array, friction: Array) -> Array:
    """Wrenches that span what each contact can apply: three per contact, one if frictionless."""
    G = grasp_map(arms)
    if (friction > 0.0).all():
        return G
    return in_frames(G, contact_frames(normals))[:, allowed(friction)]


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What the margin program says, and what of it is proved."""

    margin: float
    forces: Array
    """Balancing forces, (k, 3); they prove closure if `closed` is True."""
    twist: Array
    """(6,); it refutes closure if `closed` is False."""
    closed: bool | None
    """None where neither is proved."""


def decide(arms: Array, normals: Array, friction: Array) -> Answer:
    """Decide closure of contacts at unit size."""
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
    if abs(margin) < DECIDED:
        touching = _touching_twist(twist, arms, normals, friction)
        if refutes_closure(touching, arms, normals, friction):
            return Answer(0.0, forces, touching, closed=False)
    sparing = _twist_sparing_interior_forces(arms, normals, friction, forces)
    if sparing is not None and refutes_closure(sparing, arms, normals, friction):
        return Answer(0.0, forces, sparing, closed=False)
    return Answer(margin, forces, twist, closed=None)


def _decided_quickly(arms: Array, normals: Array, friction: Array) -> Answer | None:
    """The answer of compiled code, if it proves one; it knows one positive friction only."""
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
    """Refuted by the wrench nearest to zero, or undecided."""
    wrenches = WrenchSet(in_frames(grasp_map(arms), contact_frames(normals)), friction, "l1")
    _, facing = nearest_wrench(wrenches)
    refuted = refutes_closure(facing, arms, normals, friction)
    return Answer(-math.inf, np.zeros_like(arms), facing, closed=False if refuted else None)


def refutes_closure(twist: Array, arms: Array, normals: Array, friction: Array) -> bool:
    """Whether no contact force within its cone works along a twist."""
    length = float(np.linalg.norm(twist))
    excess = supports(twist, arms, normals, friction) / np.sqrt(1.0 + friction**2)
    return 0.0 < length < math.inf and float(excess.max()) <= ROUNDING * length


def proves_closure(forces: Array, arms: Array, normals: Array, friction: Array) -> bool:
    """Whether forces lie in the cones' interior, deep enough to correct their imbalance there."""
    return proved_margin(forces, arms, normals, friction) > 0.0


def proved_margin(
    forces: Array, arms: Array, normals: Array, friction: Array, caution: float = 1.0
) -> float:
    """Margin that forces prove: their depth, less what correcting their imbalance may cost.

    Args:
        forces: (k, 3)
        arms: (k, 3)
        normals: (k, 3)
        friction: (k,)
        caution: Multiplies what is allowed for the correction.

    Returns:
        A lower bound of the optimum of the margin program; minus infinity if there is none.
    """
    along, _ = normal_and_tangential(forces, normals)
    depth = _depth(forces, normals, friction)
    frictionless = friction[:, None] == 0.0
    balanced = np.where(frictionless, along[:, None] * normals, forces)
    imbalance = float(np.linalg.norm(grasp_map(arms) @ balanced.ravel()))
    generators = _generators(arms, normals, friction)
    if generators.shape[1] < WRENCH or not np.isfinite(generators).all():
        return -math.inf
    least = float(np.linalg.svd(generators, compute_uv=False)[WRENCH - 1])
    if least <= RANK:
        return -math.inf
    corrected = caution * (imbalance + ROUNDING) / least
    pushes = float(along.sum()) + math.sqrt(len(arms)) * corrected
    left = float((depth - np.sqrt(1.0 + friction**2) * corrected).min())
    return left / pushes if pushes > 0.0 else -math.inf


def margin_ceiling(
    twist: Array, arms: Array, normals: Array, friction: Array, caution: float = 1.0
) -> float:
    """Margin that no forces exceed, by a twist on which no support is positive.

    With the velocities v_i, M the largest support, and r_i = 1 / mu_i, or 1 without friction, no
    more than M / sum_i r_i (M - n_i.v_i) can be the optimum t: in forces with t + |tangential part
    of f_i| <= mu_i n_i.f_i the shares b_i = n_i.f_i - r_i t are not negative, and their power,
    which is zero, is at most M sum_i b_i + t sum_i r_i n_i.v_i.

    Args:
        twist: (6,)
        arms: (k, 3)
        normals: (k, 3)
        friction: (k,)
        caution: Multiplies what is allowed for rounding.

    Returns:
        An upper bound; zero, which bounds nothing but says that there is no closure, where M is
        zero to within rounding; infinity where M is more.
    """
    if not refutes_closure(twist, arms, normals, friction):
        return math.inf
    along, _ = normal_and_tangential(twist[:3] + np.cross(twist[3:], arms), normals)
    rounding = caution * ROUNDING * float(np.linalg.norm(twist)) * np.sqrt(1.0 + friction**2)
    largest = float((supports(twist, arms, normals, friction) + rounding).max())
    if largest >= 0.0:
        return 0.0
    shares = np.where(friction == 0.0, 1.0, 1.0 / np.maximum(friction, TINY))
    return largest / float((shares * (largest - along + rounding)).sum())


def many_refute_closure(
    twists: Array, arms: Array, normals: Array, friction: Array
) -> NDArray[np.bool_]:
    """As `refutes_closure`, for many sets of contacts with one friction each.

    Args:
        twists: (g, 6)
        arms: (g, k, 3)
        normals: (g, k, 3)
        friction: (g,)

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
    """As `proves_closure`, for many sets of contacts with one positive friction each.

    Args:
        forces: (g, k, 3)
        arms: (g, k, 3)
        normals: (g, k, 3)
        friction: (g,)

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
    reach = np.sqrt(1.0 + friction**2) * (imbalance + ROUNDING) / np.maximum(least, RANK)
    return (least > RANK) & (depths > reach)


def _without_giants(vectors: Array) -> Array:
    """Zeros, which prove nothing, for sets with numbers whose squares are none."""
    axes = tuple(range(1, vectors.ndim))
    sizes = np.max(np.abs(vectors), axis=axes, keepdims=True, initial=0.0)
    return np.where(sizes < GIANT, vectors, 0.0)


def _touching_twist(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """A twist at which the supports that are nearly zero are so to within rounding.

    Where the margin is exactly zero, as with symmetric normals at just their critical friction, the
    solver's twist passes the cones by its own tolerance; Newton's method takes it onto them.
    """
    twist = twist / max(float(np.linalg.norm(twist)), TINY)
    for _ in range(NEWTON_STEPS):
        velocities = twist[:3] + np.cross(twist[3:], arms)
        along, across = normal_and_tangential(velocities, normals)
        excess = along + friction * across
        touched = excess > -TOUCHING
        sideways = (velocities - along[:, None] * normals) / np.maximum(across, TINY)[:, None]
        forces = (normals + friction[:, None] * sideways)[touched]
        slopes = np.hstack([forces, np.cross(arms[touched], forces)])
        step, *_ = np.linalg.lstsq(slopes, excess[touched], rcond=RANK)
        twist = twist - np.asarray(step, dtype=np.float64)
    return twist


def _twist_sparing_interior_forces(
    arms: Array, normals: Array, friction: Array, forces: Array
) -> Array | None:
    """A separating twist for contacts some of which balance each other inside their cones.

    The margin is zero there however far the other contacts are from completing closure. A
    separating twist must leave the balanced contacts at rest; within such twists the margin
    program is asked again, for the others only, until it is negative or nobody is left.
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
    """The part of the span of `basis` (columns) that `rows`, given in it, map to zero."""
    if not rows.size:
        return basis
    _, values, right = np.linalg.svd(rows)
    rank = int((values > RANK).sum())
    return basis @ right[rank:].T
