"""Contact forces that balance given wrenches, or come near to it, with checks of what is given.

`force_programs` derives the programs behind the answers and solves them.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, frozen
from grasp_core.checked import LARGEST, SMALLEST, number, one_of, several, shown
from grasp_core.closure.contacts import (
    WRENCH,
    contact_arrays,
    contact_frames,
    contact_frictions,
    grasp_map,
    in_frames,
    unit_size,
)
from grasp_core.closure.soft_contacts import LOCAL, contact_torsions
from grasp_core.closure.wrench_sets import with_torques
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.forces.force_programs import (
    Balance,
    balances,
    in_cones,
    least_friction,
    least_imbalance,
    least_norm,
    least_norm_in_cones,
    lower_friction,
    needed_friction,
)
from grasp_core.solvers.conic import ConicProgram, minimize
from grasp_core.solvers.qp import PROXQP, check_solver
from grasp_core.values import Contact, Grasp

NO_PUSH = 1e-9
"""Share of the largest push below which a push counts as none: a hundred times the solver's error.
"""
IMBALANCE = 1e-9
"""Largest imbalance of the answer, in units of the largest push, for contacts of unit size."""
Objective: TypeAlias = Literal["least_norm", "least_friction", "closest"]


def contact_forces(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None,
    friction: ArrayLike,
    wrench: ArrayLike,
    *,
    objective: Objective = "least_norm",
    normal_force: tuple[float, float] = (0.0, math.inf),
    center: ArrayLike = (0.0, 0.0, 0.0),
    solver: str = PROXQP,
) -> Array:
    """Find forces at the contacts that balance an external wrench, or each of many.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient that the forces must respect, one for all contacts or one
            each, (k,).
        wrench: External (force, torque), (6,), or n of them, (n, 6) [N, N m], torque about
            `center`.
        objective: What to make least: the norm of all forces, in pyramids of 16 sides inside the
            cones or, where these hold no forces, in the cones; or the largest share that a contact
            needs of its friction, found by iteration, which may stop early where limits on the
            forces are far above the load. With `closest` the forces leave the least imbalance,
            and need not balance.
        normal_force: Least and largest normal force of each contact [N].
        center: Point about which torques are taken, (3,) [m].
        solver: Name of a solver of quadratic programs that qpsolvers knows and that is installed.

    Returns:
        Forces on the object, (k, 3), or (n, k, 3) [N], in the frame of `positions`. The forces for
        one of many wrenches are the same as for that wrench alone.

    Raises:
        InputError: Shapes, limits, coefficients or names are wrong.
        NoForcesError: No forces were found that meet the limits and the friction; the text gives
            the index of the first of many wrenches for which there are none.
        SolverError: The solver found no forces at all with the objective `closest`.
    """
    one_of(objective, get_args(Objective), "objective")
    loads, single = _rows(wrench)
    points, units = contact_arrays(positions, normals)
    mu = contact_frictions(friction, len(points))
    check_solver(solver)
    _check_limits(normal_force)
    arms = points - frozen(center, (3,), "center")
    found: list[Array] = []
    for place, balance in enumerate(balances(arms, units, loads, normal_force, by_load=True)):
        f = _found(balance, mu, objective, solver)
        if f is None:
            shared = f"{mu[0]:.6g}" if np.ptp(mu) == 0.0 else str(mu)
            # without limits on the forces, the size of the load does not matter
            remedy = "use more friction or move the contacts"
            if math.isfinite(normal_force[1]):
                remedy = "lower the load or raise the limits"
            which = "this wrench" if single else f"wrench {place}, counting from 0"
            raise NoForcesError(
                f"no forces were found with friction {shared} and normal forces in "
                f"{normal_force} N that balance {which}; {remedy}"
            )
        found.append(balance.in_space(f))
    return found[0] if single else np.array(found).reshape(len(loads), len(points), 3)


def _found(balance: Balance, mu: Array, objective: Objective, solver: str) -> Array | None:
    """Find local forces for one wrench, checked; None if there are none."""
    if objective == "closest":
        return least_imbalance(balance, mu)
    if balance.beyond(mu):
        return None
    if objective == "least_norm":
        f = least_norm(balance, mu, solver)
    else:
        largest = float(mu.max())
        weights = mu / largest if largest > 0.0 else np.ones(len(mu))
        f = least_friction(balance, largest, weights)
        # pyramids may hold no forces that the cones hold, so the iteration starts in the cones then
        if not in_cones(f, mu):
            start = least_norm_in_cones(balance, mu)
            f = None if start is None else lower_friction(balance, weights, start)
    return f if in_cones(f, mu) else None


def least_friction_forces(
    positions: Array, normals: Array, friction: float, wrench: Array, *,
    normal_force: tuple[float, float], center: Array,
) -> tuple[Array, float | None]:  # fmt: skip
    """Find balancing forces (k, 3) [N] of least friction, with that coefficient.

    The search starts at `friction`, but the forces may need more than that. Where the limits on the
    normal forces leave no balance, those in the cones come nearest to it, and no coefficient is
    given.
    """
    (balance,) = balances(positions - center, normals, wrench[None], normal_force, by_load=False)
    alike = np.ones(len(positions))
    f = least_friction(balance, friction, alike)
    if f is None:
        return balance.in_space(least_imbalance(balance, friction * alike)), None
    return balance.in_space(f), needed_friction(f, alike)


def even_forces(
    positions: ArrayLike, normals: ArrayLike, friction: ArrayLike, *, torsion_m: ArrayLike = 0.0
) -> Array:
    """Find balanced forces whose least push is largest, when the largest push is 1 N.

    Solved, with the pushes f_n = n.f and the tangential parts f_t of the contact forces f:

        maximise t  subject to  sum f_i = 0,  sum x_i x f_i = 0,                            (1)
                                t <= f_n <= 1  for all contacts,                            (2)
                                |f_t| <= mu f_n  for all contacts.                          (3)

    Soft fingertips also transmit a torque m about their normal. In units of its coefficient mu_t it
    is one more tangential part, |(f_t / mu, m / mu_t)| <= f_n, and enters (1) as a torque about the
    normal. Zero forces are always allowed, so t is never negative. It is positive iff balanced
    forces in the cones exist with which every finger pushes. The largest push is 1 then: scaling
    would raise t.

    Takes `positions` (k, 3) [m]; `normals` (k, 3); `torsion_m` [m]. Gives forces on the object, (k,
    3) [N], balanced to `IMBALANCE`; with torsion, together with some torques about the normals,
    which come from the contacts by themselves.
    """
    points, units = contact_arrays(positions, normals)
    mu = contact_frictions(friction, len(points))
    arms, _, size = unit_size(points)
    k, torsions = len(points), contact_torsions(torsion_m, mu)
    # tangential unknowns over mu, so that small coefficients are solved as well as large ones
    frames = contact_frames(units) * np.column_stack([np.ones(k), mu, mu])[:, None]
    matrix, width = in_frames(grasp_map(arms), frames), 3
    if torsions is not None:
        matrix, width = with_torques(matrix, units, torsions / size), LOCAL
    n = width * k
    pushes, least = np.eye(n, n + 1)[0::width], np.eye(n + 1)[-1]
    balance = np.hstack([matrix, np.zeros((WRENCH, 1))])
    # rows: (1), the upper and the lower bounds of (2), the cones (3)
    A = np.vstack([balance, pushes, least - pushes, -np.eye(n, n + 1)])
    b = np.concatenate([np.zeros(WRENCH), np.ones(k), np.zeros(k + n)])
    x = minimize(ConicProgram(-least, A, b, WRENCH, 2 * k, (width,) * k)).x[:-1]
    along = x[0::width]
    if not along.min() > NO_PUSH:
        raise NoForcesError(
            f"no balanced forces in which every finger pushes were found at friction {mu}; "
            "more friction may allow them"
        )
    local = x.reshape(k, width)
    forces = np.einsum("kij,kj->ki", frames, local[:, :3]) / along.max()
    wrench = grasp_map(arms) @ forces.ravel()
    if torsions is not None:
        wrench[3:] += (local[:, 3] * torsions / (size * along.max())) @ units
    imbalance = float(np.abs(wrench).max())
    if not imbalance <= IMBALANCE:
        raise SolverError(
            f"the solver's forces miss balance by {imbalance:.3g} of the largest push"
        )
    return forces


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
