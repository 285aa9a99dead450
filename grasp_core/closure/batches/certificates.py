"""Finds certificates of force closure, and of its opposite, for many sets of contacts at once.

Forces, twists and margins are those of `force_closure`, and are checked as `verify` checks them, on
arrays of all sets. What compiled code does not decide is left to `force_closure`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import UNIT_SLACK, Array, cross
from grasp_core.by_value import trusted
from grasp_core.closure.batches.margins import margin_ceilings, proved_margins
from grasp_core.closure.contact_arrays import unit_size
from grasp_core.closure.decision import DECIDED, FAR, PRECISE
from grasp_core.closure.force_closure import CAUTION, FAR_BELOW, SUMMED, ClosureCertificate
from grasp_core.closure.margin_program import deepest_forces
from grasp_core.closure.proofs import proves_closure, refutes_closure, without_giants


@dataclass(frozen=True, slots=True, eq=False)
class _Decided:
    """Verdicts of compiled code on many sets of contacts, each proved or left open."""

    closed: NDArray[np.bool_]
    """Where `forces` prove closure, (g,)."""
    separated: NDArray[np.bool_]
    """Where `twists` prove its opposite, (g,)."""
    forces: Array
    """Balancing forces whose normal parts sum to one, (g, k, 3)."""
    wrenches: Array
    """Separating wrenches about the frame's origin, (g, 6)."""
    margins: Array
    """Proved margins, (g,); NaN where nothing is proved."""


def closing_margins(positions: Array, normals: Array, friction: float) -> Array:
    """Compute the margins of certificates of force closure for many sets of contacts, (g,).

    Each is, up to rounding, the margin of the certificate that `force_closure` gives.

    Takes `positions` (g, k, 3) [m]; `normals` (g, k, 3). Gives proved margins, above zero; NaN
    where compiled code does not prove closure, which tells nothing: `force_closure` decides such
    contacts.
    """
    decided = _decided(positions, normals, friction)
    return np.where(decided.closed, decided.margins, math.nan)


def certificates(
    positions: Array, normals: Array, friction: float
) -> list[ClosureCertificate | None]:
    """Find the certificates that `force_closure` gives for many sets of contacts.

    Takes `positions` (g, k, 3) [m]; `normals` (g, k, 3). Gives a certificate for each set, as
    `ClosureCertificate.verify` accepts it; None leaves the set undecided.
    """
    decided = _decided(positions, normals, friction)
    points, units, forces, wrenches = (
        np.array(each) for each in (positions, normals, decided.forces, decided.wrenches)
    )
    mu = np.full(points.shape[1], friction)
    for array in (points, units, forces, wrenches, mu):
        array.setflags(write=False)
    return [
        trusted(
            ClosureCertificate, closed=closed, margin=margin, positions=points[i],
            normals=units[i], friction=mu, forces=forces[i] if closed else None,
            separating_wrench=None if closed else wrenches[i], torsion_m=None, torques=None,
        )
        if closed or separated
        else None
        for i, (closed, separated, margin) in enumerate(
            zip(
                decided.closed.tolist(), decided.separated.tolist(), decided.margins.tolist(),
                strict=True,
            )
        )
    ]  # fmt: skip


def _decided(positions: Array, normals: Array, friction: float) -> _Decided:
    """Decide what compiled code can prove, with the checks of `force_closure` and `verify`."""
    count = len(positions)
    if not (friction > 0.0 and count):
        never = np.zeros(count, dtype=bool)
        nothing = np.full(count, math.nan)
        return _Decided(never, never, np.zeros_like(positions), np.zeros((count, 6)), nothing)
    arms, centers, sizes = unit_size(positions)
    every = np.full(count, friction)
    forces, twists, margins = deepest_forces(arms, normals, every, PRECISE)
    forces, twists = without_giants(forces, 2), without_giants(twists, 1)
    lower, upper = margins.T
    with np.errstate(invalid="ignore"):  # a search that broke down ends with NaN
        close = np.abs(upper - lower) <= DECIDED * np.maximum(friction, np.abs(lower))
        close &= np.abs(lower) <= FAR * friction
        close &= (np.abs(np.linalg.norm(normals, axis=-1) - 1.0) <= UNIT_SLACK).all(axis=-1)
        closed, separated = close & (lower > DECIDED), close & (upper < -DECIDED)
    closed &= proves_closure(forces, arms, normals, every[:, None])
    separated &= refutes_closure(twists, arms, normals, every[:, None])
    found = np.full(count, math.nan)
    pushes = np.einsum("gki,gki->g", forces, normals)
    forces = forces / np.where(closed, pushes, 1.0)[:, None, None]
    turning = twists[:, 3:] / sizes[:, None]
    wrenches = np.concatenate([twists[:, :3] - cross(turning, centers), turning], axis=1)
    units = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    found[closed] = _verified_closed(forces[closed], arms[closed], units[closed], friction)
    # `verify` moves the wrench back to the mean contact, at unit size
    moved = wrenches[:, :3] + cross(wrenches[:, 3:], centers)
    back = np.concatenate([moved, wrenches[:, 3:] * sizes[:, None]], axis=1)
    found[separated] = _verified_open(back[separated], arms[separated], units[separated], friction)
    proved = ~np.isnan(found)
    return _Decided(closed & proved, separated & proved, forces, wrenches, found)


def _verified_closed(forces: Array, arms: Array, normals: Array, friction: float) -> Array:
    """Return the margins that forces prove, (g,); NaN where `verify` would not accept them."""
    found = proved_margins(forces, arms, normals, friction, CAUTION)
    verified = (found > 0.0) & (found <= proved_margins(forces, arms, normals, friction))
    wrenches = np.concatenate([forces.sum(axis=1), cross(arms, forces).sum(axis=1)], axis=1)
    pushes = np.einsum("gki,gki->g", forces, normals)
    verified &= np.abs(wrenches).max(axis=1, initial=0.0) <= SUMMED
    verified &= np.abs(pushes - 1.0) <= SUMMED
    return np.where(verified, found, math.nan)


def _verified_open(twists: Array, arms: Array, normals: Array, friction: float) -> Array:
    """Return the margins that twists prove, (g,); NaN where `verify` would not accept them."""
    found, bound = (
        np.where(ceilings <= FAR_BELOW, -math.inf, ceilings)
        for ceilings in (
            margin_ceilings(twists, arms, normals, friction, caution) for caution in (CAUTION, 1.0)
        )
    )
    return np.where((found <= 0.0) & (found >= bound), found, math.nan)
