"""Contact forces that balance given wrenches, or come near to it, with checks of what is given.

`force_programs` derives the programs behind the answers and solves them.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, frozen
from grasp_core.checked import LARGEST, SMALLEST, number, one_of, several, shown
from grasp_core.closure.contacts import contact_arrays, contact_frictions
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.forces.balance import Balance, needed_friction
from grasp_core.forces.force_programs import (
    in_cones,
    least_friction,
    least_friction_each,
    least_imbalance,
    least_norm,
)
from grasp_core.values import Contact, Grasp


def contact_forces(
    positions: ArrayLike | Grasp | Sequence[Contact],
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
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts, with `normals` None.
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
    missing = np.flatnonzero([not in_cones(f, mu) for f in F])
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

    Gives the forces [N] and the coefficient; None when the limits on the normal forces leave no
    balance.
    """
    load = frozen(wrench, (6,), "wrench")[None]
    balance = _balance(positions, normals, load, normal_force, center)
    # one coefficient for all contacts: weights of one
    alike = np.ones(len(balance.frames))
    f = least_friction(balance, friction, alike)
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
    f = least_imbalance(balance, friction)
    if f is None:
        raise SolverError(
            "the solver found no forces in the friction cones, though pure pushes are some"
        )
    return balance.in_space(balance.into_cones(f[None], friction))[0]


def _objective(name: str) -> Callable[[Balance, Array], Array]:
    known = {"least_norm": least_norm, "least_friction": least_friction_each}
    one_of(name, known, "objective")
    return known[name]


def _balance(
    positions: ArrayLike | Grasp | Sequence[Contact], normals: ArrayLike | None, wrenches: Array,
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
