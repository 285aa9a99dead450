"""Finds contact forces that balance wrenches, by strictly convex programs.

Forces f are sought in pyramids inscribed in the friction cones, so that every answer lies in the
true cones. With the map G from forces to their wrench, the external wrench w, the least and largest
normal force l and u, and the rows R of the pyramids they satisfy

    G f = -w,                                                                                 (1)
    l <= f_n <= u,                                                                            (2)
    R f <= 0.                                                                                 (3)

There are two objectives: the least norm |f|, and the least friction, that is, the smallest
coefficient r = max_i |f_t| / f_n. The latter is found by Dinkelbach's iteration: forces with

    the least excess max_i |f_t| - r f_n over the current r                                   (4)

have a smaller coefficient, until they do not; the last 2 % that pyramids give away come from
`least_friction`. Where pyramids hold no forces that balance, as just above the critical friction,
exact cones may (`cone_forces`). Where nothing balances, `closest_forces` leaves the least
imbalance.

Both objectives ask for the nearest point of a polyhedron (`nearest_point`), once (1) is solved
(`balance`). Where that point is not found, a quadratic program decides (`qp`), and its answer
counts when its own residuals are small.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, frozen
from grasp_core.checked import LARGEST, SMALLEST, number, one_of, several, shown
from grasp_core.closure.contact_arrays import contact_arrays, contact_frictions
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.forces.balance import RESIDUAL, Balance, needed_friction
from grasp_core.forces.cone_forces import least_norm_in_cones
from grasp_core.forces.least_friction import lower_friction
from grasp_core.solvers.nearest_point import least_distance
from grasp_core.solvers.qp import QuadraticProgram, minimize
from grasp_core.values import Grasp

REGULAR = 1e-3
"""Weight of the forces' size that keeps the least-friction programs strictly convex."""
IMPROVEMENT = 1e-2
"""Share by which the coefficient must fall in a round for the iteration to go on."""
MAX_ROUNDS = 20
LEAST_CHARGE = 1e-3
"""Weight of the forces' size relative to the imbalance in `closest_forces`."""


def contact_forces(  # noqa: PLR0913 - the contract's arguments
    positions: ArrayLike | Grasp,
    normals: ArrayLike | None,
    friction: ArrayLike,
    wrench: ArrayLike,
    *,
    objective: Literal["least_norm", "least_friction"] = "least_norm",
    normal_force: tuple[float, float] = (0.0, math.inf),
    center: ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """Find forces at the contacts that balance an external wrench, or each of many.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient that the forces must respect, one for all contacts or one
            each, (k,).
        wrench: External (force, torque), (6,), or n of them, (n, 6) [N, N m], torque about
            `center`.
        objective: What to make least: the norm of all forces, in pyramids of 16 sides inside the
            cones or, where these hold no forces, in the cones; or the largest share that a contact
            needs of its friction. The latter is found by iteration: where limits on the forces are
            far above the load it may stop early.
        normal_force: Least and largest normal force of each contact [N].
        center: Point about which torques are taken, (3,) [m].

    Returns:
        Forces on the object, (k, 3), or (n, k, 3) [N], in the frame of `positions`. The forces for
        one of many wrenches are the same as for that wrench alone, but for rounding.

    Raises:
        InputError: Shapes, limits or coefficients are wrong.
        NoForcesError: No forces were found that meet the limits and the friction; the text gives
            the index of the first of many wrenches for which there are none.
    """
    _objective(objective)
    loads, single = _rows(wrench)
    balance = _balance(positions, normals, loads, normal_force, center, by_load=True)
    mu = contact_frictions(friction, len(balance.frames))
    F = _objective(objective)(balance, mu)
    missing = np.flatnonzero([not _in_cones(f, mu) for f in F])
    if missing.size:
        which = "this wrench" if single else f"wrench {missing[0]}, counting from 0"
        raise NoForcesError(
            f"no forces were found with friction {_text(mu)} and normal forces in "
            f"{normal_force} N that balance {which}; {_remedy(normal_force)}"
        )
    forces = balance.in_space(F)
    return forces[0] if single else forces


def least_friction_forces(
    positions: Array, normals: Array, friction: float, wrench: Array, *,
    normal_force: tuple[float, float], center: Array,
) -> tuple[Array, float] | None:  # fmt: skip
    """Find balancing forces (k, 3) of least friction, with that coefficient.

    The search starts at `friction`, but the forces may need more than that.

    Returns:
        The forces [N] and the coefficient; None when the limits on the normal forces leave no
        balance.
    """
    load = frozen(wrench, (6,), "wrench")[None]
    balance = _balance(positions, normals, load, normal_force, center)
    # one coefficient for all contacts: weights of one
    alike = np.ones(len(balance.frames))
    f = _least_friction(balance, friction, alike)
    if f is None:
        return None
    return balance.in_space(f[None])[0], float(needed_friction(f[None], alike)[0])


def closest_forces(
    positions: Array, normals: Array, friction: float, wrench: Array, *,
    normal_force: tuple[float, float], center: Array,
) -> Array:  # fmt: skip
    """Find forces in the friction cones that leave the least imbalance, (k, 3) [N]."""
    load = frozen(wrench, (6,), "wrench")[None]
    balance = _balance(positions, normals, load, normal_force, center)
    # the cones (3) and limits (2) hold, while (1) is only approached: its square is the objective
    rows = balance.pyramids(np.full(len(balance.frames), friction))
    P = balance.G.T @ balance.G + LEAST_CHARGE * np.eye(balance.G.shape[1])
    q = balance.G.T @ balance.W[0]
    f = _least_imbalance(P, q, rows, balance)
    if np.isnan(f[0]):
        f = _solve(P, q, rows, balance, balanced=False)
    if f is None:
        raise SolverError(
            "the solver found no forces in the friction cones, though pure pushes are some"
        )
    return balance.in_space(balance.into_cones(f[None], friction))[0]


def _least_imbalance(P: Array, q: Array, rows: Array, balance: Balance) -> Array:
    """Minimise f'Pf/2 + q'f in the cones and limits.

    With P = L L' this is the least |L'f + inv(L) q|.
    """
    L = np.linalg.cholesky(P)
    back, shift = np.linalg.inv(L).T, np.linalg.solve(L, q)
    # (3), then (2), as rows; the balance (1) is in the objective
    along = np.eye(len(q))[0::3]
    C, d = [rows, -along], [np.zeros(len(rows)), -np.broadcast_to(balance.least, len(along))]
    if np.isfinite(balance.largest).all():
        C.append(along)
        d.append(np.broadcast_to(balance.largest, len(along)))
    turned = np.vstack(C) @ back
    z = least_distance(turned, (np.concatenate(d) + turned @ shift)[None])[0]
    return back @ (z - shift)


def _objective(name: str) -> Callable[[Balance, Array], Array]:
    known = {"least_norm": _least_norm, "least_friction": _least_friction_each}
    one_of(name, known, "objective")
    return known[name]


def _least_norm(balance: Balance, friction: Array) -> Array:
    """Find balanced forces of least norm, (n, 3k).

    The first wrench without such forces, and all after it, get NaN.
    """
    rows = balance.pyramids(friction)
    # |F0 + null z| is least where |z| is, F0 being orthogonal to the null space of (1)
    Z = least_distance(*balance.polyhedra(rows))
    F = balance.checked(balance.F0 + Z @ balance.null.T)
    P, hopeless = np.eye(F.shape[1]), balance.beyond(friction)
    # where the nearest point is not proved, ProxQP is asked, then the exact cones
    for i in np.flatnonzero(np.isnan(F[:, 0])):
        one = balance.one(int(i))
        if hopeless[i]:
            break
        f = _solve(P, 0.0 * P[0], rows, one, balanced=True)
        if f is not None:
            F[i] = one.checked(f[None])[0]
        if not _in_cones(F[i], friction):
            f = least_norm_in_cones(one, friction)
            if f is None:
                break
            F[i] = f
    return F


def _least_friction_each(balance: Balance, friction: Array) -> Array:
    """Find balanced forces of least friction, (n, 3k).

    The first wrench without such forces, and all after it, get NaN.
    """
    largest = float(friction.max())
    weights = friction / largest if largest > 0.0 else np.ones(len(friction))
    F = np.full(balance.F0.shape, np.nan)
    hopeless = balance.beyond(friction)
    for i in range(len(F)):
        if hopeless[i]:
            break
        one = balance.one(i)
        f = _least_friction(one, largest, weights)
        # pyramids may hold no forces that the cones hold, so the iteration starts in the cones then
        if f is None or not _in_cones(f, friction):
            start = least_norm_in_cones(one, friction)
            f = f if start is None else lower_friction(one, weights, start)
        if f is None:
            break
        F[i] = f
    return F


def _in_cones(f: Array, friction: Array) -> bool:
    """Return whether local forces (3k,) are finite and stay within the friction cones."""
    return bool(needed_friction(f[None], friction)[0] <= 1.0 + RESIDUAL)


def _least_friction(balance: Balance, start: float, weights: Array) -> Array | None:
    """Find forces (3k,) with the least r, if contacts have r times their weight as friction.

    The iteration starts from a given coefficient.
    """
    best, friction = None, start
    for _ in range(MAX_ROUNDS):
        better = _toward_less_friction(balance, friction, weights)
        if np.isnan(better[0]):
            break
        needed = float(needed_friction(better[None], weights)[0])
        if best is not None and needed > friction * (1.0 - IMPROVEMENT):
            break
        best, friction = better, needed
    if best is None:
        return None
    return lower_friction(balance, weights, best)


def _toward_less_friction(balance: Balance, friction: float, weights: Array) -> Array:
    """Find balanced forces with the least excess (4) over `friction`.

    The excess t is a further variable. With the forces F0 + null @ z, half the square of
    (sqrt(REGULAR) z, t + 1) is minimised, up to a constant.
    """
    rows = balance.pyramids(friction * weights)
    # the pyramids (3) widened by t: R f <= weight t
    allowance = np.repeat(weights, len(rows) // len(weights))
    C, D = balance.polyhedra(rows)
    excess = np.zeros((len(C), 1))
    excess[: len(rows), 0] = -allowance
    D[:, : len(rows)] -= allowance
    root = math.sqrt(REGULAR)
    z = least_distance(np.hstack([C / root, excess]), D)[:, :-1] / root
    f = balance.checked(balance.F0 + z @ balance.null.T)[0]
    if not np.isnan(f[0]):
        return f
    n = balance.G.shape[1]
    P, q = np.diag([REGULAR] * n + [1.0]), np.array([0.0] * n + [1.0])
    x = _solve(P, q, np.hstack([rows, -allowance[:, None]]), balance, balanced=True)
    return f if x is None else balance.checked(x[None, :n])[0]


def _balance(
    positions: ArrayLike | Grasp, normals: ArrayLike | None, wrenches: Array,
    normal_force: tuple[float, float], center: ArrayLike, *, by_load: bool = False,
) -> Balance:  # fmt: skip
    points, units = contact_arrays(positions, normals)
    _check_limits(normal_force)
    arms = points - frozen(center, (3,), "center")
    return Balance.of(arms, units, wrenches, normal_force, by_load=by_load)


def _check_limits(normal_force: tuple[float, float]) -> None:
    each = partial(number, name="normal_force", least=0.0, most=math.inf)
    limits = several(normal_force, each, "normal_force", "limits")
    if len(limits) != len(("least", "largest")) or not limits[0] < limits[1]:
        raise InputError(f"normal_force must be (least, largest), got {shown(normal_force)}")
    # infinity stands for no upper limit; any other limit must be a force of a plausible size
    if not (SMALLEST <= limits[1] <= LARGEST or (limits[1] == math.inf and limits[0] <= LARGEST)):
        raise InputError(
            f"normal_force: the largest must be {SMALLEST:g} to {LARGEST:g} N, or infinite, got "
            f"{shown(normal_force)}"
        )


def _rows(wrench: ArrayLike) -> tuple[Array, bool]:
    """Return wrenches as rows, and whether the caller gave a single one that was not a row."""
    try:
        single = np.ndim(wrench) != 2  # noqa: PLR2004 - rows and columns
    except ValueError:  # ragged, which `frozen` explains
        single = True
    loads = np.atleast_2d(frozen(wrench, (6,) if single else (None, 6), "wrench"))
    sizes: Array = np.abs(loads).max(axis=1, initial=0.0)
    if ((sizes > 0.0) & (sizes < SMALLEST_SIZE)).any():
        raise InputError(
            f"wrench: the largest component must be 0 or at least {SMALLEST_SIZE:g}, got "
            f"{float(sizes[sizes > 0.0].min()):.3g}"
        )
    return loads, single


def _remedy(normal_force: tuple[float, float]) -> str:
    """Return advice for a wrench that no forces balance.

    Without limits on the forces, the size of the load does not matter.
    """
    if math.isfinite(normal_force[1]):
        return "lower the load or raise the limits"
    return "use more friction or move the contacts"


def _text(friction: Array) -> str:
    return f"{friction[0]:.6g}" if np.ptp(friction) == 0.0 else str(friction)


def _solve(P: Array, q: Array, rows: Array, balance: Balance, *, balanced: bool) -> Array | None:
    """Minimise x'Px/2 + q'x with rows @ x <= 0 by ProxQP, for the first wrench.

    The variables are the forces, and perhaps a last one without bounds.
    """
    forces = balance.G.shape[1]
    lower, upper = np.full(len(q), -np.inf), np.full(len(q), np.inf)
    # (2) as bounds on every third variable, (1) as equations unless its residual is the objective
    lower[0:forces:3], upper[0:forces:3] = balance.least, balance.largest
    map_of_all = np.hstack([balance.G, np.zeros((len(balance.G), len(q) - forces))])
    equations = (map_of_all, -balance.W[0]) if balanced else (map_of_all[:0], np.empty(0))
    return minimize(QuadraticProgram(P, q, rows, np.zeros(len(rows)), *equations, lower, upper))
