"""Contact forces that balance a wrench, by strictly convex programs; the door to ProxQP.

Forces are sought in pyramids inscribed in the friction cones, so that every answer lies in
the true cones. Two objectives for balanced forces: the least norm, and the least friction,
that is, the smallest coefficient max_i |tangential part| / normal part. The latter is found
by Dinkelbach's iteration: with r the current coefficient, forces that minimise the largest
tangential part minus r times the normal part have a smaller one, until they do not; the last
2 % that pyramids give away come from `least_friction`. Where nothing balances,
`closest_forces` leaves the least imbalance.

Forces are scaled by the largest normal force and lengths by the longest arm inside. ProxQP
calls some of these feasible programs infeasible, so it is asked for the closest feasible
point, and its status is not read: an answer counts when its own residuals are small.
"""

import importlib
import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.least_friction import lower_friction
from grasp_core.values import Grasp, contact_arrays
from grasp_core.wrenches import contact_frames, grasp_map

PYRAMID_SIDES = 16
"""An inscribed 16-sided pyramid gives away 1.9 % of the friction coefficient."""
RESIDUAL = 1e-6
"""Largest imbalance and cone violation accepted, in units of the largest normal force: a
hundred times the accuracy asked of the solver."""
REQUESTED = 1e-8
MAX_ITERATIONS = 300
"""Feasible programs of this size take about twenty; infeasible ones would go on for minutes."""
REGULAR = 1e-3
"""Weight of the forces' own size that keeps the least-friction programs strictly convex."""
IMPROVEMENT = 1e-2
"""Iteration ends when the coefficient falls by less than this share."""
MAX_ROUNDS = 20
ACTIVE = (1e-6, 1e-5, 1e-7, 1e-8)
"""Slacks below which a constraint may count as active, tried in turn."""
LEAST_CHARGE = 1e-3
"""Weight of the forces' own size against the imbalance in `closest_forces`."""


def contact_forces(  # noqa: PLR0913 - the contract's arguments
    positions: ArrayLike | Grasp,
    normals: ArrayLike | None,
    friction: float,
    wrench: ArrayLike,
    *,
    objective: Literal["least_norm", "least_friction"] = "least_norm",
    normal_force: tuple[float, float] = (0.0, math.inf),
    center: ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """Forces at the contacts that balance an external wrench.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient that the forces must respect.
        wrench: External (force, torque), (6,) [N, N m], torque about `center`.
        objective: What to make least.
        normal_force: Least and largest normal force of each contact [N].
        center: (3,) [m]

    Returns:
        Forces on the object, (k, 3) [N], in the frame of `positions`.

    Raises:
        InputError: Shapes or limits are wrong.
        NoForcesError: No forces found that meet the limits and the friction.
    """
    problem = _Problem.of(positions, normals, wrench, normal_force, center)
    least_norm = objective == "least_norm"
    local = problem.least_norm(friction) if least_norm else problem.least_friction(friction)
    if local is None or problem.required_friction(local) > friction * (1.0 + RESIDUAL):
        raise NoForcesError(
            f"no forces found with friction {friction:.6g} and normal forces in "
            f"{normal_force} N that balance this wrench; lower the load or raise the limits"
        )
    return problem.in_space(local)


def least_friction_forces(
    positions: Array, normals: Array, friction: float, wrench: Array, *,
    normal_force: tuple[float, float], center: Array,
) -> tuple[Array, float] | None:  # fmt: skip
    """Balancing forces (k, 3) of least friction, with that coefficient, whatever it is.

    `friction` is where the search starts; forces are found above it if they must be.

    None when the limits on the normal forces leave no balance.
    """
    problem = _Problem.of(positions, normals, wrench, normal_force, center)
    local = problem.least_friction(friction)
    return None if local is None else (problem.in_space(local), problem.required_friction(local))


def closest_forces(
    positions: Array, normals: Array, friction: float, wrench: Array, *,
    normal_force: tuple[float, float], center: Array,
) -> Array:  # fmt: skip
    """Forces in the friction cones that leave the least imbalance, (k, 3)."""
    problem = _Problem.of(positions, normals, wrench, normal_force, center)
    return problem.in_space(problem.closest(friction))


class _Problem:
    """One wrench on one set of contacts, scaled; forces are (normal, tangent, tangent)."""

    def __init__(
        self, arms: Array, normals: Array, wrench: Array, normal_force: tuple[float, float]
    ) -> None:
        least, largest = normal_force
        scale = largest if math.isfinite(largest) else float(np.linalg.norm(wrench))
        self.scale = scale if scale > 0.0 else 1.0
        self.frames = contact_frames(normals)
        size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
        rows = grasp_map(arms / size)
        self.G = np.hstack([rows[:, 3 * i : 3 * i + 3] @ R for i, R in enumerate(self.frames)])
        self.w = wrench / self.scale
        self.w[3:] /= size
        self.count = len(arms)
        self.lower = np.tile([least / self.scale, -np.inf, -np.inf], self.count)
        self.upper = np.tile([largest / self.scale, np.inf, np.inf], self.count)

    @classmethod
    def of(
        cls, positions: ArrayLike | Grasp, normals: ArrayLike | None, wrench: ArrayLike,
        normal_force: tuple[float, float], center: ArrayLike,
    ) -> "_Problem":  # fmt: skip
        points, units = contact_arrays(positions, normals)
        if not 0.0 <= normal_force[0] < normal_force[1]:
            raise InputError(f"normal_force must be (least, largest), got {normal_force}")
        about = frozen(center, (3,), "center")
        return cls(points - about, units, np.array(frozen(wrench, (6,), "wrench")), normal_force)

    def in_space(self, local: Array) -> Array:
        """Scaled local forces as forces in the object's frame, (k, 3) [N]."""
        forces = np.einsum("kij,kj->ki", self.frames, local.reshape(-1, 3))
        return self.scale * np.asarray(forces, dtype=np.float64)

    def required_friction(self, local: Array) -> float:
        """The coefficient that these forces need, not counting contacts without force."""
        along, across = local[0::3], np.hypot(local[1::3], local[2::3])
        ratios = across / np.maximum(along, np.finfo(np.float64).tiny)
        return float(np.where(across > RESIDUAL, ratios, 0.0).max())

    def pyramid(self, friction: float) -> Array:
        """Rows R with R f <= 0 inside pyramids inscribed in the cones, (16 k, 3 k)."""
        turns = 2.0 * np.pi * (np.arange(PYRAMID_SIDES) + 0.5) / PYRAMID_SIDES
        slope = -friction * math.cos(np.pi / PYRAMID_SIDES)
        side = np.column_stack([np.full(PYRAMID_SIDES, slope), np.cos(turns), np.sin(turns)])
        return np.asarray(np.kron(np.eye(self.count), side), dtype=np.float64)

    def least_norm(self, friction: float) -> Array | None:
        """Balanced forces of least norm."""
        rows = self.pyramid(friction)
        P = np.eye(self.G.shape[1])
        return self._balanced(_solve(P, 0.0 * P[0], rows, self, balanced=True))

    def least_friction(self, start: float) -> Array | None:
        """Balanced forces of least friction, iterating from a coefficient on the way there."""
        best, friction = None, start
        for _ in range(MAX_ROUNDS):
            better = self._toward_less_friction(friction)
            if better is None:
                break
            needed = self.required_friction(better)
            if best is not None and needed > friction * (1.0 - IMPROVEMENT):
                break
            best, friction = better, needed
        if best is None:
            return None
        limits = float(self.lower[0]), float(self.upper[0])
        return lower_friction(self.G, self.w, limits, best)

    def _toward_less_friction(self, friction: float) -> Array | None:
        """Balanced forces whose largest excess over `friction`, a further variable, is least."""
        rows = self.pyramid(friction)
        n = self.G.shape[1]
        P, q = np.diag([REGULAR] * n + [1.0]), np.array([0.0] * n + [1.0])
        excess = np.hstack([rows, -np.ones((len(rows), 1))])
        x = _solve(P, q, excess, self, balanced=True)
        return None if x is None else self._balanced(x[:n])

    def closest(self, friction: float) -> Array:
        """Forces in the cones with the least imbalance."""
        rows = self.pyramid(friction)
        P = self.G.T @ self.G + LEAST_CHARGE * np.eye(self.G.shape[1])
        x = _solve(P, self.G.T @ self.w, rows, self, balanced=False)
        if x is None:
            raise SolverError("no forces in the cones were found, though a pure push is one")
        return self._into_cones(x, friction)

    def _into_cones(self, local: Array, friction: float) -> Array:
        """Forces near these that meet the limits and the cones exactly."""
        along = np.clip(local[0::3], self.lower[0::3], self.upper[0::3])
        across = np.hypot(local[1::3], local[2::3])
        shrink = np.minimum(1.0, friction * along / np.maximum(across, np.finfo(np.float64).tiny))
        return np.column_stack([along, shrink * local[1::3], shrink * local[2::3]]).ravel()

    def _balanced(self, local: Array | None) -> Array | None:
        """The forces if they balance the wrench within the limits, corrected to rounding."""
        if local is None:
            return None
        correction = np.linalg.lstsq(self.G, self.G @ local + self.w, rcond=None)[0]
        exact = local - np.asarray(correction, dtype=np.float64)
        imbalance = float(np.abs(self.G @ exact + self.w).max())
        outside = max((self.lower - exact).max(), (exact - self.upper).max())
        return exact if max(imbalance, float(outside)) <= RESIDUAL else None


def _solve(P: Array, q: Array, rows: Array, problem: _Problem, *, balanced: bool) -> Array | None:
    """Minimise x'Px/2 + q'x with rows @ x <= 0; a last variable beyond the forces is free."""
    solver = _qpsolvers()
    extra = len(q) - problem.G.shape[1]
    balance = (
        (np.hstack([problem.G, np.zeros((6, extra))]), -problem.w) if balanced else (None,) * 2
    )
    program = solver.Problem(
        P, q, rows, np.zeros(len(rows)), *balance,
        lb=np.append(problem.lower, [-np.inf] * extra),
        ub=np.append(problem.upper, [np.inf] * extra),
    )  # fmt: skip
    answer = solver.solve_problem(
        program, solver="proxqp", eps_abs=REQUESTED, max_iter=MAX_ITERATIONS,
        primal_infeasibility_solving=balanced,
    )  # fmt: skip
    if answer.x is None or not np.isfinite(answer.x).all():
        return None
    return _polished(program, np.asarray(answer.x, dtype=np.float64))


def _qpsolvers() -> Any:
    module: Any = importlib.import_module("qpsolvers")
    if "proxqp" not in module.available_solvers:
        raise SolverError(
            "ProxQP cannot be loaded; it needs the package proxsuite and the system library "
            "libgomp (on Debian: apt-get install libgomp1)"
        )
    return module


def _polished(program: Any, x: Array) -> Array:
    """The exact optimum on the constraints that are active at x, if it is feasible and as good.

    The solver stops anywhere within its tolerance, at a point that depends on where its numbers
    lie in memory. The conditions of optimality on the active constraints are linear equations
    with one answer.
    """
    P, q, C, d, A, b = _as_rows(program)
    for slack in ACTIVE:
        active = d - C @ x < slack
        E, e = np.vstack([A, C[active]]), np.concatenate([b, d[active]])
        conditions = np.block([[P, E.T], [E, np.zeros((len(e), len(e)))]])
        targets = np.concatenate([-q, e])
        solved = np.linalg.lstsq(conditions, targets, rcond=None)[0]
        exact = np.asarray(solved, dtype=np.float64)[: len(q)]
        unmet = float(np.abs(conditions @ solved - targets).max())
        outside = float((C @ exact - d).max())
        worse = float(0.5 * (exact @ P @ exact - x @ P @ x) + q @ (exact - x))
        if max(unmet, outside, worse) < RESIDUAL:
            return exact
    return x


def _as_rows(program: Any) -> tuple[Array, Array, Array, Array, Array, Array]:
    """P, q, then C x <= d with the bounds among the rows, then A x = b."""
    n = len(program.q)
    above, below = np.isfinite(program.ub), np.isfinite(program.lb)
    C = np.vstack([program.G, np.eye(n)[above], -np.eye(n)[below]])
    d = np.concatenate([program.h, program.ub[above], -program.lb[below]])
    none = program.A is None
    A, b = (np.empty((0, n)), np.empty(0)) if none else (program.A, program.b)
    return program.P, program.q, C, d, A, b
