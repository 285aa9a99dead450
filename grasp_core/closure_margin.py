"""The margin program of force closure and what its answer proves (see `closure`).

Contacts are given at unit size: arms from their mean point, the longest of length one.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.conic import ConicProgram, minimize
from grasp_core.polygons import plane_frame
from grasp_core.wrenches import grasp_map, normal_and_tangential

WRENCH = 6
"""Dimension of a wrench."""
DECIDED = 1e-9
"""Margins closer to zero are left undecided unless a certificate settles them: a hundred
times the tolerance asked of the solver."""
ROUNDING = 1e-12
"""Slack of the plain-arithmetic checks, for data scaled to unit size: some thousand
rounding errors."""
INTERIOR = 1e-6
"""Depth inside its cone, of forces whose normal parts sum to 1, from which a contact counts
as carrying an interior force: far above what the solver leaves on a boundary."""
RANK = 1e-9
"""Smallest singular value of the unit-size grasp map that counts as full rank."""


def supports(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """Support s_i(y) of each friction cone, cut at unit normal force, in direction y, (k,)."""
    velocities = twist[:3] + np.cross(twist[3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    return along + friction * across


def _generators(arms: Array, normals: Array, friction: Array) -> Array:
    """Wrenches that span what each contact can apply: three per contact, one if frictionless."""
    columns = [
        grasp_map(arm[None]) @ (np.eye(3) if mu > 0.0 else normal[:, None])
        for arm, normal, mu in zip(arms, normals, friction, strict=True)
    ]
    return np.hstack(columns)


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Margin, with forces that prove closure, or a twist that refutes it, or neither."""

    margin: float
    forces: Array | None = None
    twist: Array | None = None


def decide(arms: Array, normals: Array, friction: Array) -> Answer:
    """Decide closure of contacts at unit size."""
    margin, forces, twist = _margin_program(grasp_map(arms), normals, friction)
    if proves_closure(forces, arms, normals, friction):
        return Answer(margin, forces=forces)
    if margin < -DECIDED:
        return Answer(margin, twist=twist)
    twist = _twist_sparing_interior_forces(arms, normals, friction, forces)
    return Answer(0.0 if twist is not None else margin, twist=twist)


def proves_closure(forces: Array, arms: Array, normals: Array, friction: Array) -> bool:
    """Whether forces lie in the cones' interior, deep enough to correct their imbalance there."""
    along, _ = normal_and_tangential(forces, normals)
    depth = _depth(forces, normals, friction)
    frictionless = friction[:, None] == 0.0
    balanced = np.where(frictionless, along[:, None] * normals, forces)
    imbalance = float(np.linalg.norm(grasp_map(arms) @ balanced.ravel()))
    generators = _generators(arms, normals, friction)
    if generators.shape[1] < WRENCH:
        return False
    least = float(np.linalg.svd(generators, compute_uv=False)[WRENCH - 1])
    if least <= RANK:
        return False
    reach = np.sqrt(1.0 + friction**2) * (imbalance + ROUNDING) / least
    return bool((depth > reach).all())


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
        margin, forces, reduced = _margin_program(balance, normals[rest], friction[rest])
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


def _margin_program(balance: Array, normals: Array, friction: Array) -> tuple[float, Array, Array]:
    """Margin t, balancing forces (k, 3), and the dual twist in the rows of `balance`.

    Args:
        balance: What must vanish as a matrix on the stacked forces, (m, 3k).
        normals: (k, 3)
        friction: (k,)
    """
    k, m = len(normals), len(balance)
    n = 3 * k + 1
    departing = np.linalg.lstsq(balance.T, -normals.ravel(), rcond=None)[0]
    receding = np.asarray(departing, dtype=np.float64)
    if np.abs(balance.T @ receding + normals.ravel()).max() <= ROUNDING:
        return -math.inf, np.zeros((k, 3)), receding  # every contact leaves along its normal
    rows = {kind: list[Array]() for kind in ("zero", "nonnegative", "cone")}
    for i, (normal, mu) in enumerate(zip(normals, friction, strict=True)):
        cone = np.zeros((3, n))
        cone[0, 3 * i : 3 * i + 3] = -(mu if mu > 0.0 else 1.0) * normal
        cone[0, -1] = 1.0
        cone[1:, 3 * i : 3 * i + 3] = -plane_frame(normal).T
        if mu > 0.0:
            rows["cone"].append(cone)
        else:
            rows["zero"].append(cone[1:])
            rows["nonnegative"].append(cone[:1])
    equalities = np.vstack(
        [np.hstack([balance, np.zeros((m, 1))]), np.append(normals.ravel(), 0.0)]
    )
    A = np.vstack([equalities, *rows["zero"], *rows["nonnegative"], *rows["cone"]])
    b, q = np.zeros(len(A)), np.zeros(n)
    b[m], q[-1] = 1.0, -1.0
    solution = minimize(
        ConicProgram(
            q,
            A,
            b,
            m + 1 + 2 * len(rows["zero"]),
            len(rows["nonnegative"]),
            (3,) * len(rows["cone"]),
        )
    )
    forces = solution.x[:-1]
    if not rows["zero"]:
        correction = np.linalg.lstsq(balance, balance @ forces, rcond=None)[0]
        forces = forces - np.asarray(correction, dtype=np.float64)
    return float(solution.x[-1]), forces.reshape(k, 3), -solution.z[:m]
