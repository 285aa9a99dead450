"""The largest multiples of wrenches that contacts resist, one by one and hundreds at once.

The program and its dual are in `wrench_body`, and what proves their answers in `wrench_limit`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen
from grasp_core.checked import LARGEST, SMALLEST
from grasp_core.closure.contact_arrays import contact_arrays
from grasp_core.errors import InputError
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limit import WrenchLimit, body_of, limit_of
from grasp_core.values import Contact, Grasp


def max_resisted_wrench(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None,
    friction: ArrayLike,
    wrench: ArrayLike,
    *,
    max_normal_force: float,
    center: ArrayLike = (0.0, 0.0, 0.0),
    motors: Motors | None = None,
    torsion_m: ArrayLike = 0.0,
) -> float:
    """Find the largest multiple of an external wrench that the contacts can resist.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each.
        wrench: External (force, torque), (6,) [N, N m], torque about `center`.
        max_normal_force: Largest normal force of each contact [N].
        center: Point about which torques are taken, (3,) [m].
        motors: Joints that the contact forces load, with the torques of their motors; None for
            fingers that are as strong as `max_normal_force` says.
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]; zero is a hard
            finger. With motors it must be zero.

    Raises:
        InputError: Shapes or limits are wrong, or the wrench is zero.
    """
    loads = frozen(wrench, (6,), "wrench")[None]
    _check_sizes(loads, "wrench")
    return wrench_limits(
        positions, normals, friction, loads, max_normal_force=max_normal_force, center=center,
        motors=motors, torsion_m=torsion_m,
    )[0].limit  # fmt: skip


def wrench_limits(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None,
    friction: ArrayLike,
    wrenches: ArrayLike,
    *,
    max_normal_force: float,
    center: ArrayLike = (0.0, 0.0, 0.0),
    motors: Motors | None = None,
    torsion_m: ArrayLike = 0.0,
) -> tuple[WrenchLimit, ...]:
    """Find the largest multiple of each wrench that contacts resist, with forces and a bound.

    The weakest of the limits is `min(limits, key=lambda found: found.limit)`.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each.
        wrenches: External (force, torque), (n, 6) [N, N m], torque about `center`.
        max_normal_force: Largest normal force of each contact [N].
        center: Point about which torques are taken, (3,) [m].
        motors: Joints that the contact forces load, with the torques of their motors; None for
            fingers that are as strong as `max_normal_force` says.
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]; zero is a hard
            finger. With motors it must be zero.

    Raises:
        InputError: Shapes or limits are wrong, or a wrench is zero.
        SolverError: A program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals)
    loads = frozen(wrenches, (None, 6), "wrenches")
    _check_sizes(loads, "wrenches")
    about = frozen(center, (3,), "center")
    body = body_of(points - about, units, friction, max_normal_force, motors, torsion_m)
    return tuple(limit_of(body, load) for load in loads)


def _check_sizes(loads: Array, name: str) -> None:
    """Refuse wrenches (n, 6) that are zero, because every multiple of zero is resisted."""
    sizes = np.abs(loads).max(axis=1)
    if len(loads) and not SMALLEST <= float(sizes.min()) <= float(sizes.max()) <= LARGEST:
        wrong = sizes[(sizes < SMALLEST) | (sizes > LARGEST)][0]
        raise InputError(
            f"{name} must not be zero nor huge: its largest component must be from {SMALLEST:g} to "
            f"{LARGEST:g}, got {float(wrong):.6g}"
        )


def axis_wrenches(torque_scale: float) -> Array:
    """Return the twelve unit wrenches along and against each axis, (12, 6) [N, N m].

    Takes `torque_scale` [m].
    """
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    return np.vstack([np.eye(6), -np.eye(6)]) * scale
