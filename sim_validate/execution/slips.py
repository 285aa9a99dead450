"""What a motion says of a hold: how far contacts slipped, how far the object moved, when it began.

Everything is seen from the palm. In the object's frame the centre of tip i is u_i. A fingertip that
turns against the object by dt since the last sample, as one on springs does when the object turns
by -dt, rolls on it, so with the inward normal n_i the point of contact slides on the object by the
tangential part of

    du_i + rho_i dt x n_i.                                                                (1)

The load of first slip is taken from the contact forces. They are (n, t) at rest and change by
(a, b), in the frames of the contacts, so a load that is larger by the factor s would change them by
s (a, b) as long as motions are small. The least s that brings a contact to its cone, times the
share of the load that is applied, is the multiple of the load at which the first contact slips. It
is taken in the sample before the first contact is on its cone. If none ever is, the least of all
samples under the full load says how far away slip stayed.

An object that leaves a table rocks on its last edge and rings, so that a contact may touch its cone
for some milliseconds, slide by micrometres, and hold. Such a touch is no slip: a row of samples on
the cone counts only if the contact slides by more than `TOUCHED` in it, or if the row reaches the
full load.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, cross
from grasp_core.execution.first_slip import slip_steps
from scenes.mujoco.held import HeldLayout, hinged, rotations
from sim_validate.execution.bench import HeldMotion
from sim_validate.execution.paths import Drive

ON_CONE = 0.9995
"""Tangential force, relative to friction times normal force, at which a contact counts as on its
cone: the simulator's contacts approach it within as much."""
SLID = 2e-3
"""Distance that counts as slipped, in object radii: between two samples a contact may slip and
hold again, and rolling over large turns is known to about a tenth of it."""
TOUCHED = 1e-4
"""Distance that a contact on its cone may slide while an object leaves a table and still count as
held, in object radii: contacts that stick creep by a twentieth of it in a lift."""
IDLE = 1e-3
"""Normal force at rest, relative to the largest, below which a fingertip does not push."""
FULL = 0.999
"""Share of the load above which it is all there."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A motion as the palm sees it, in each of n samples."""

    moved: Array
    """Displacement of the object's centre of mass, (n, 3) [m]."""
    turned: Array
    spun: Array
    """Orientations of the fingertips in the object's frame, (n, k, 3, 3), or (n, 1, 3, 3) where
    they turn alike."""
    tips: Array
    """Centres of the fingertips in the object's frame, (n, k, 3) [m]."""
    forces: Array
    """Contact forces on the object in the frames of the contacts, which turn with it, (n, k, 3)
    [N]: normal, tangent, tangent."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of an object in one trial, against its place when the trial began.

    The figures are those of `ExecutionTrial`.
    """

    slip_m: float
    displacement_m: float
    turn_rad: float
    dropped: bool
    slipped: bool
    """Whether a contact slipped: one was on its cone, or slid by more than `SLID`."""
    first_slip: float
    """Multiple of the trial's load at which the first contact slips; at most one if one did."""


def seen(motion: HeldMotion, layout: HeldLayout) -> Seen:
    """Look at a motion from the palm and from the object."""
    palm = hinged(motion.palm[:, 3:])
    turned = palm.transpose(0, 2, 1) @ rotations(motion.turned)
    moved = np.einsum("nji,nj->ni", palm, motion.moved - motion.palm[:, :3])
    centers = layout.tip_centers + np.einsum("kij,nkj->nki", layout.axes, motion.tips)
    tips = np.einsum("nji,nkj->nki", turned, centers - moved[:, None])
    along = np.einsum("kij,nkj->nki", layout.axes, motion.forces)
    own = np.einsum("nji,nkj->nki", motion.pressed, along)
    back: Array = turned.transpose(0, 2, 1)[:, None]
    spun = back if motion.tip_turns is None else back @ motion.tip_turns
    return Seen(moved, turned, spun, tips, np.einsum("kij,nki->nkj", layout.frames, own))


def outcome(
    motion: HeldMotion, layout: HeldLayout, drive: Drive, friction: Array, begun: int = 0
) -> Outcome:
    """Say what became of the object since a sample of a trial."""
    found = seen(motion, layout)
    relative = found.turned[begun:] @ found.turned[begun].T
    cosines = 0.5 * (np.einsum("nii->n", relative) - 1.0)
    touching = found.forces[-1, :, 0] > 0.0
    slid = float(slides(found, layout, begun).max(initial=0.0))
    leaving = None if drive.table is None else _slid(found, layout, begun) / layout.radius_m
    multiple = _first_slip(found, drive.shares, friction, begun, leaving)
    slipped = multiple <= 1.0 or slid > SLID * layout.radius_m
    return Outcome(
        slip_m=slid,
        displacement_m=float(
            np.linalg.norm(found.moved[begun:] - found.moved[begun], axis=1).max()
        ),
        turn_rad=float(np.arccos(np.clip(cosines, -1.0, 1.0)).max()),
        dropped=not touching.any(),
        slipped=slipped,
        first_slip=min(multiple, 1.0) if slipped else multiple,
    )


def slides(found: Seen, layout: HeldLayout, begun: int = 0) -> Array:
    """Return how far each point of contact has slid by (1) since a sample, (n, k) [m]."""
    return np.linalg.norm(_slid(found, layout, begun), axis=2)


def _slid(found: Seen, layout: HeldLayout, begun: int) -> Array:
    """Return the displacement of each point of contact by (1) since a sample, (n, k, 3) [m]."""
    normals = layout.frames[:, :, 0]
    steps = np.diff(found.tips[begun:], axis=0)
    spun = found.spun[begun:]
    change: Array = spun[:-1] @ spun[1:].transpose(0, 1, 3, 2)  # its axis is that of minus dt
    turns = 0.5 * np.stack(
        [change[..., 2, 1] - change[..., 1, 2], change[..., 0, 2] - change[..., 2, 0],
         change[..., 1, 0] - change[..., 0, 1]], axis=-1,
    )  # fmt: skip
    rolled = layout.tip_radius_m[:, None] * cross(turns, normals)
    slid = steps - rolled
    slid -= np.einsum("nki,ki->nk", slid, normals)[..., None] * normals
    return np.concatenate([np.zeros((1, *slid.shape[1:])), np.cumsum(slid, axis=0)])


def first_trouble(motion: HeldMotion, layout: HeldLayout, friction: Array, begun: int) -> int:
    """Return the first sample in which a contact slips or opens, or the simulator fails; else n."""
    found = seen(motion, layout)
    on_cone = _on_cone(found, friction, begun)[1].any(axis=1)
    troubled = np.flatnonzero(on_cone | ~np.isfinite(motion.joints).all(axis=1))
    return int(troubled[0]) if len(troubled) else len(motion.moved)


def _on_cone(
    found: Seen, friction: Array, begun: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which contacts push at rest, (k,), and when those slip or are open, (n, pushing)."""
    rest_n = found.forces[begun, :, 0]
    pushing = rest_n > IDLE * rest_n.max()  # a fingertip that pushes at nothing cannot slip
    forces = found.forces[:, pushing]
    across = np.linalg.norm(forces[..., 1:], axis=2)
    on_cone = across >= ON_CONE * friction[pushing] * forces[..., 0]
    on_cone[: begun + 1] = False
    return pushing, on_cone


def _first_slip(
    found: Seen, shares: Array, friction: Array, begun: int, leaving: Array | None = None
) -> float:
    pushing, on_cone = _on_cone(found, friction, begun)
    if not pushing.any():
        return 0.0
    found, friction = replace(found, forces=found.forces[:, pushing]), friction[pushing]
    if leaving is not None:
        on_cone[begun:] &= ~_touches(on_cone[begun:], shares[begun:], leaving[:, pushing])
    slipping = on_cone.any(axis=1)
    if not slipping.any():
        loaded = np.flatnonzero(shares >= FULL)
        return float(_extrapolated(found, shares, friction, begun, loaded).min(initial=np.inf))
    at = int(np.argmax(slipping))
    before, after = sorted((float(shares[at - 1]), float(shares[at])))
    (multiple,) = _extrapolated(found, shares, friction, begun, np.array([at - 1]))
    return min(max(float(multiple), before), after)


def _touches(on_cone: NDArray[np.bool_], shares: Array, slid: Array) -> NDArray[np.bool_]:
    """Return which samples on the cone only touch it before the full load comes, (n, k)."""
    found = np.zeros_like(on_cone)
    last = len(on_cone) - 1
    for contact, own in enumerate(on_cone.T):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], own, [0]])))
        for first, end in edges.reshape(-1, 2):
            by = slid[min(end, last), contact] - slid[first - 1, contact]
            little = np.linalg.norm(by) <= TOUCHED
            found[first:end, contact] = little and shares[end - 1] < FULL
    return found


def _extrapolated(found: Seen, shares: Array, friction: Array, begun: int, at: Indices) -> Array:
    """Return the multiple of the load at first slip as it is seen in samples `at`, (m,)."""
    rest = found.forces[begun]
    changes = (found.forces[at] - rest).reshape(-1, 3)
    steps = slip_steps(np.tile(rest, (len(at), 1)), changes, np.tile(friction, len(at)))
    least = steps.reshape(len(at), -1).min(axis=1)
    return np.multiply(shares[at], least, out=np.full(len(at), np.inf), where=np.isfinite(least))
