"""Decides whether contacts are in force closure at every positive friction, or at no friction.

Solved: whether contacts are in force closure at every positive friction, and whether they are at
no friction whatever. Both are questions of linear programs.

Every friction. Let S be no contacts at first. Seek pushes l_i >= 0 along the normals of the others
that balance with any forces at all at the contacts in S,

    sum over S of wrench(f_i) + sum over the others of l_i wrench(n_i) = 0,                 (1)

with as many l_i > 0 as can be. Add those contacts to S, and go on until nothing is added. If S
holds all contacts and the wrenches span six dimensions, every friction mu > 0 is enough: forces of
each round, times mu or less those of the round before, are inside all cones, since what a later
round does to a contact is small beside the push that the contact has already. Two rounds make a
margin that grows with the square of mu, three one with its cube. Otherwise, by Stiemke's lemma, a
twist leaves S at rest while all others depart along their normals; it separates up to the least
ratio of departing to sliding, which is a positive friction.

No friction. Cones grow into the half-spaces n_i.f > 0 with the friction, so none is enough iff no
balanced forces push at all contacts, or the wrenches do not span; that is, iff some twist makes
every contact depart straight along its normal, or leaves it at rest:

    v_i = -c_i n_i,  c_i >= 0.                                                              (2)
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrenches import WRENCH, grasp_map, normal_and_tangential
from grasp_core.errors import SolverError
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize

DEPENDENT = 1e-9
"""Singular values of unit-size wrenches below this value count as zero."""
SUPPORTED = 0.5
"""Border between pushes of zero and of one: pushes that can be positive can be one."""
LARGEST_VARIABLE = 1e4
"""Largest size of a variable of the programs, whose answers are of order one."""
POSITIVE = 1e-6
"""Optima below this count as zero: a hundred times the residual of a linear program."""
STEP_SHARE = 0.5
"""Share of what is left of a cone that the forces of the next round may take."""


@dataclass(frozen=True, slots=True, eq=False)
class Rounds:
    """Balanced forces of each round of the search, or the twist with which the rounds end."""

    forces: tuple[Array, ...]
    """Balanced forces of each round, (k, 3) each; empty unless every positive friction is
    enough."""
    twist: Array | None
    """Twist under which contacts depart along their normals or are at rest, (6,); None where
    `forces` are given or nothing was found."""

    def at(self, friction: float, normals: Array) -> Array:
        """Combine the rounds to balanced forces inside the cones of a friction, (k, 3)."""
        total = self.forces[0]
        for forces in self.forces[1:]:
            along, across = normal_and_tangential(total, normals)
            sizes = np.linalg.norm(forces, axis=1)
            room, taken = (friction * along - across)[along > 0.0], sizes[along > 0.0]
            share = STEP_SHARE / (1.0 + friction) * np.min(room / np.maximum(taken, DEPENDENT))
            total = total + min(float(share), 1.0) * forces
        return total


def rounds(arms: Array, normals: Array) -> Rounds:
    """Find out whether every positive friction is enough for force closure.

    Takes `arms`, `normals` (k, 3).
    """
    maps = grasp_map(arms).reshape(WRENCH, -1, 3)
    pushes = np.einsum("wki,ki->wk", maps, normals)
    settled, found = np.zeros(len(arms), dtype=bool), list[Array]()
    # each turn settles a contact: weights may be scaled up until a share is one
    while not settled.all():
        free = np.flatnonzero(~settled)
        held = maps[:, settled].reshape(WRENCH, -1)
        # (1), seen only in the directions of wrenches that the contacts of S cannot apply
        outside = _complement(held)
        weights = _most_pushes(outside.T @ pushes[:, free])
        if weights is None:
            return Rounds((), _departing(outside, pushes[:, free]))
        forces = np.zeros_like(arms)
        forces[free] = weights[:, None] * normals[free]
        needed = -pushes[:, free] @ weights
        supporting = np.asarray(np.linalg.lstsq(held, needed, rcond=DEPENDENT)[0], dtype=np.float64)
        forces[settled] = supporting.reshape(-1, 3)
        found.append(forces)
        settled[free[weights > 0.0]] = True
    left = _complement(grasp_map(arms))
    return Rounds((), left[:, 0]) if left.shape[1] else Rounds(tuple(found), None)


def hopeless_twist(arms: Array, normals: Array) -> Array | None:
    """Find a twist (6,) that separates at every friction, by (2); None if there is none.

    Takes `arms`, `normals` (k, 3).
    """
    at_rest = _complement(grasp_map(arms))
    if at_rest.shape[1]:
        return at_rest[:, 0]
    k = len(arms)
    # (2) as a null space: the variables are the twist and the speeds c_i, whose sum is maximised
    departing = np.zeros((k, 3, k))
    departing[np.arange(k), :, np.arange(k)] = normals
    basis = _null_space(np.hstack([grasp_map(arms).T, departing.reshape(3 * k, k)]))
    speeds = basis[WRENCH:]
    rows = np.vstack([-speeds, speeds.sum(axis=0), np.eye(basis.shape[1]), -np.eye(basis.shape[1])])
    limits = np.repeat([0.0, 1.0, LARGEST_VARIABLE, LARGEST_VARIABLE], [k, 1, *basis.shape[1:] * 2])
    found = _best(speeds.sum(axis=0), rows, limits)
    return None if found is None else basis[:WRENCH] @ found


def pushing_forces(arms: Array, normals: Array) -> Array | None:
    """Find balanced forces (k, 3) that push at every contact; None if there are none.

    Some friction allows such forces.

    Takes `arms`, `normals` (k, 3).
    """
    basis = _null_space(grasp_map(arms))
    n = basis.shape[1]
    pushes = np.einsum("kin,ki->kn", basis.reshape(*arms.shape, n), normals)
    rows = np.vstack([np.hstack([-pushes, np.ones((len(arms), 1))]), np.eye(2 * n, n + 1)])
    rows[len(arms) :, :n] = np.vstack([np.eye(n), -np.eye(n)])
    limits = np.repeat([0.0, 1.0], [len(arms), 2 * n])
    found = _best(np.eye(n + 1)[n], rows, limits)
    return None if found is None else (basis @ found[:n]).reshape(arms.shape)


def _most_pushes(rows: Array) -> Array | None:
    """Find weights (n,) >= 0 with rows @ weights = 0, as many of them positive as possible."""
    basis = _null_space(rows)
    k, n = basis.shape
    # shares from 0 to 1, each at most its weight: their sum counts the weights that can be positive
    shares = np.eye(k)
    nothing = np.zeros((k, n))
    limits = np.repeat([0.0, 0.0, 1.0, LARGEST_VARIABLE], k)
    found = _best(
        np.repeat([0.0, 1.0], [n, k]),
        np.block([[-basis, shares], [nothing, -shares], [nothing, shares], [basis, 0.0 * shares]]),
        limits,
    )
    if found is None:
        return None
    return np.where(found[n:] > SUPPORTED, basis @ found[:n], 0.0)


def _departing(outside: Array, pushes: Array) -> Array | None:
    """Find the combination of the columns of `outside` that departs most evenly, or None."""
    m, n = outside.shape[1], pushes.shape[1]
    steep = np.hstack([pushes.T @ outside, np.ones((n, 1))])
    box = np.hstack([np.vstack([np.eye(m), -np.eye(m)]), np.zeros((2 * m, 1))])
    found = _best(np.eye(m + 1)[m], np.vstack([steep, box]), np.repeat([0.0, 1.0], [n, 2 * m]))
    return None if found is None else outside @ found[:m]


def _best(c: Array, A: Array, b: Array) -> Array | None:
    """Return where c.x is largest subject to A x <= b; None if it is not clearly positive there."""
    if not A.shape[1]:
        return None
    try:
        found = maximize(LinearProgram(c, A, b))
    except SolverError:
        return None
    return found.x if isinstance(found, Optimum) and found.value > POSITIVE else None


def _null_space(rows: Array) -> Array:
    """Return orthonormal columns that `rows` maps to zero."""
    if not rows.size:
        return np.eye(rows.shape[1])
    _, values, right = np.linalg.svd(rows)
    return right[int((values > DEPENDENT).sum()) :].T


def _complement(wrenches: Array) -> Array:
    """Return orthonormal columns that are orthogonal to all of the wrenches (6, n)."""
    return _null_space(wrenches.T) if wrenches.size else np.eye(WRENCH)
