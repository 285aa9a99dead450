"""The largest multiples of wrenches that contacts resist, one by one and hundreds at once.

The program and its dual are in `wrench_body`, and what proves their answers in `wrench_limit`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import Array, frozen
from grasp_core.checked import LARGEST, SMALLEST
from grasp_core.closure.contact_arrays import contact_arrays
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_body import WrenchBody
from grasp_core.quality.wrench_limit import WrenchLimit, body_of, limit_of
from grasp_core.values import Contact, Grasp

KERNEL = "grasp_core.quality.wrench_limits_kernel"
CLOSE = 1e-7
"""Distance up to which two bounds of a limit count as one, relative to it: the accuracy of the
conic programs that the compiled code stands for."""
HALF = 0.5
"""Largest normal force from which the compiled code starts, in units of f_max: as far from the
largest as from zero, so that it starts inside both bounds."""


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


def many_limits(
    positions: Array, normals: Array, friction: float, wrenches: Array, inside: Array, *,
    max_normal_force: float, center: Array,
) -> Array:  # fmt: skip
    """Find the largest multiple of each of hundreds of wrenches that contacts resist, (n,).

    Compiled code finds them, and a wrench whose two bounds are farther apart than `CLOSE` is
    solved for by itself.

    Takes `positions` (k, 3) [m]; `normals`, `inside` (k, 3); `wrenches` (force, torque) or (n, 6)
    [N, N m]; `max_normal_force` [N]; `center` (3,) [m].
    """
    _check_sizes(wrenches, "wrenches")
    mu = np.full(len(positions), friction)
    body = WrenchBody(positions - center, normals, mu, max_normal_force)
    units = np.array([body.about_middle(wrench) for wrench in wrenches])
    lengths = np.linalg.norm(units, axis=1)
    found, close = _compiled_limits(body, units / lengths[:, None], inside)
    limits = body.max_normal_force / lengths * found
    for place in np.flatnonzero(~close):
        limits[place] = limit_of(body, wrenches[place]).limit
    return limits


def _compiled_limits(
    body: WrenchBody, loads: Array, inside: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Find limits of unit loads (n, 6) on hard contacts without motors, by the compiled code.

    Gives the limits over the largest normal force, (n,), and whether both bounds of each are close
    to each other, (n,).
    """
    local = np.einsum("kij,ki->kj", body.frames, inside)
    start = (HALF / local[:, 0].max() * local).ravel()
    found, facets = np.empty(len(loads)), np.empty(loads.shape)
    forces = np.empty((len(loads), len(start)))
    mu = body.bounded.friction
    kernel = compiled(KERNEL)
    kernel.limits(kernel.Contacts(body.G, mu, start), loads, found, forces, facets)
    upper = body.bounded.supports(facets) / -np.einsum("ij,ij->i", facets, loads)
    close: NDArray[np.bool_] = np.abs(upper - found) <= CLOSE * np.abs(upper)
    close &= np.abs(forces @ body.G.T + found[:, None] * loads).max(axis=1) <= CLOSE * upper
    normal, *across = forces.reshape(len(loads), -1, 3).transpose(2, 0, 1)
    close &= (np.hypot(*across) <= mu * normal).all(axis=1) & (normal <= 1.0).all(axis=1)
    return found, close


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
