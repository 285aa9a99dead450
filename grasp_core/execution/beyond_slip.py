"""How far a load can grow past the first slip before the object leaves its place.

A contact that slips still pushes, and still rubs with as much as its friction allows: the others
take the rest, and the grip becomes softer. While a load s w grows slowly, the object's small motion
x = (d, t) and the contact forces g_i along the axes of their contacts follow

    g'_i = g_i + D_i dx,   D_i = F_i' (-K_i W_i' + [0, [f_i x]]),                         (1)

as in `grips` (6), where the contact sticks; g_i are the forces at the last balance, dx is the
motion since, and f_i in [f_i x] is along the world's axes. Outside its cone g'_i is brought back
along the tangent, to |t| = mu n, and a normal force below zero to none. The object is in balance
where

    sum_i W_i F_i (g_i - f_i) - C x + s w = 0,   C = K_g + sum_i W_i [0, [f_i x]],        (2)

with g and f both along the contacts' axes; if nothing slips, this is (4) of `grips`. Newton's
method solves (2) with the exact derivative of (1), at multiples in equal ratios, from just below
that of first slip (or a hundredth of the last, if that is larger) to that at which the object
without any slip would leave its place. The object is *lost* where its motion passes what is
allowed, or where no balance is found, not even when the way there is gone in small parts. Halving
the interval of multiples, and then taking the motion in it as linear, shows where.

The load comes once. A load that keeps turning makes contacts slip a little in each round, which
adds up; for it the first slip is the safer answer. The multiple is an estimate, not a proof:
whether a balance past the first slip is stable is not checked, and a contact that opened pushes
again as soon as the object moves back.

Source of the return to the cone: Simo and Hughes, "Computational Inelasticity", 1998, section 3.3.
Following a structure until it yields everywhere is the pushover analysis of earthquake engineers.
"""

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.closure.contacts import WRENCH
from grasp_core.execution.first_slip import slip_steps
from grasp_core.execution.grips import Grip

LOAD_RATIOS = 10
"""Number of equal ratios from the first slip to the farthest load: ranks of grasps do not improve
with more."""
BEFORE_SLIP = 0.98
"""Where the first multiple is, in first slips."""
LONGEST_WAY = 100.0
"""Largest ratio of the farthest load to the first slip; smaller first slips are followed from that
ratio on."""
RATIO_HALVINGS = 4
"""Number of halvings of the last ratio: paths in such steps are no finer than a sixteenth of it."""
MOST_BALANCE_STEPS = 12
"""Most steps of Newton's method: where it finds a balance, it mostly takes fewer."""
WAY_PARTS = 8
"""Number of parts in which a way is gone again on which Newton's method found no balance. It may
swing between contacts that stick and slip, and then the last digits would decide what is lost."""
BALANCE_MET = 1e-7
"""Wrench that is left of (2), relative to the largest force at rest."""
ADDED_STIFFNESS = 1e-9
"""Stiffness that is always added to the matrix of Newton's method, relative to its largest entry:
it can be solved where everything slips."""


def loss_multiples(grip: Grip, loads: Array, most_m: float, most_rad: float) -> Array:
    """Find the multiples, (m,), at which loads, (m, 6), that come once each lose the object."""
    if not grip.stable or not len(loads):
        return np.zeros(len(loads))
    change = np.einsum("kij,mj->mki", grip.response, loads)
    reach = np.repeat([most_m, most_rad], 3)
    slips = slip_steps(grip.local_squeeze, change, grip.friction).min(axis=1)
    with np.errstate(divide="ignore"):
        sticking = 1.0 / _moved(loads @ grip.compliance.T, reach)
    found = sticking.copy()
    beyond = slips < sticking
    if beyond.any():
        begun = np.maximum(slips, sticking / LONGEST_WAY)[beyond]
        found[beyond] = _Followed(grip, loads[beyond], reach).losses(begun, sticking[beyond])
    return found


def _moved(motion: Array, reach: Array) -> Array:
    """Return small motions, (m, 6), as parts of what is allowed, (m,)."""
    moved, turned = (np.linalg.norm(motion[:, part], axis=1) for part in (slice(3), slice(3, 6)))
    return np.maximum(moved / reach[0], turned / reach[3])


class _Followed:
    """Loads past their first slips: the last balance of each, and where each was lost first."""

    def __init__(self, grip: Grip, loads: Array, reach: Array) -> None:
        count = len(loads)
        self.grip, self.loads, self.reach = grip, loads, reach
        self.multiples = np.zeros(count)
        self.forces = np.tile(grip.local_squeeze, (count, 1, 1))
        self.motion = np.zeros((count, WRENCH))
        # the motion as a part of what is allowed, at the last balance and where the object is lost;
        # that and the multiple there are infinite where nothing balances, or is lost
        self.share, self.beyond = np.zeros(count), np.full(count, np.inf)
        self.lost = np.full(count, np.inf)

    def losses(self, begun: Array, last: Array) -> Array:
        """Find the multiples at which the object is lost, at most the last, (m,)."""
        first = BEFORE_SLIP * begun
        for part in np.linspace(0.0, 1.0, LOAD_RATIOS + 1):
            self._raise(first * (last / first) ** part)
        for _ in range(RATIO_HALVINGS):
            self._raise(0.5 * (self.multiples + self.lost))
        between, room = np.full(len(last), 0.5), self.beyond - self.share
        np.divide(1.0 - self.share, room, out=between, where=np.isfinite(self.beyond))
        lost = np.where(np.isinf(self.lost), last, self.lost)
        return np.minimum(self.multiples + between * (lost - self.multiples), last)

    def _raise(self, multiples: Array) -> None:
        """Raise loads to multiples, (m,), below those at which the object is known to be lost."""
        own = np.flatnonzero(multiples < self.lost)
        if not len(own):
            return
        tried, begun = multiples[own], (self.forces[own], self.motion[own])
        forces, motion, met = self._balanced(*begun, tried[:, None] * self.loads[own])
        again = np.flatnonzero(~met)
        if len(again):
            # in parts, each from the balance before
            ends = np.linspace(self.multiples[own[again]], tried[again], WAY_PARTS + 1)[1:, :, None]
            at, moved, found = begun[0][again], begun[1][again], np.ones(len(again), dtype=bool)
            for load in ends * self.loads[own[again]]:
                at, moved, met_here = self._balanced(at, moved, load)
                found &= met_here
                if not found.any():
                    break
            forces[again], motion[again], met[again] = at, moved, found
        share = np.where(met, _moved(motion, self.reach), np.inf)
        kept = share < 1.0
        held, gone = own[kept], own[~kept]
        self.multiples[held], self.share[held] = tried[kept], share[kept]
        self.forces[held], self.motion[held] = forces[kept], motion[kept]
        self.lost[gone], self.beyond[gone] = tried[~kept], share[~kept]

    def _balanced(
        self, forces: Array, start: Array, loads: Array
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Solve (2) for loads, (m, 6), from known forces, (m, k, 3), and motions, (m, 6)."""
        grip, count = self.grip, len(loads)
        scale, rest = np.repeat([1.0, 1.0 / grip.size], 3), grip.local_squeeze
        stiff, maps = grip.response @ grip.grasp_stiffness, grip.local_maps  # D_i and W_i F_i
        softening = grip.grasp_stiffness + np.einsum("kij,kjl->il", maps, stiff)  # C of (2)
        rows, columns = stiff.reshape(-1, WRENCH), maps.transpose(1, 0, 2).reshape(WRENCH, -1)
        most = BALANCE_MET * float(np.abs(rest).max())
        motion, after, found = start.copy(), forces, np.zeros(count, dtype=bool)
        for _ in range(MOST_BALANCE_STEPS):
            tried = forces + ((motion - start) @ rows.T).reshape(forces.shape)
            after, slope = _returned(tried, grip.friction)
            left: Array = (after - rest).reshape(count, -1) @ columns.T
            left = left - motion @ softening.T + loads
            found = np.abs(left * scale).max(axis=1) <= most
            if found.all():
                break
            tangent = (maps @ slope @ stiff).sum(axis=1) - softening
            tangent *= scale[:, None] * scale
            size = np.abs(tangent).max(axis=(1, 2), keepdims=True)
            tangent -= ADDED_STIFFNESS * size * np.eye(WRENCH)
            solved = np.asarray(np.linalg.solve(tangent, -(left * scale)[..., None]), dtype=float)
            step = np.where(found[:, None], 0.0, solved[..., 0] * scale)
            # no step is longer than the reach: near the end of balance it would fly
            longest = np.abs(step / self.reach).max(axis=1, keepdims=True)
            motion = motion + step / np.maximum(longest, 1.0)
        return after, motion, found


def _returned(tried: Array, friction: Array) -> tuple[Array, Array]:
    """Return forces, (m, k, 3), to their cones along the tangent, with derivatives."""
    pushing = tried[..., 0] > 0.0
    n = np.where(pushing, tried[..., 0], 0.0)
    across = np.linalg.norm(tried[..., 1:], axis=-1)
    slipping = across > friction * n
    along = tried[..., 1:] / np.where(across > 0.0, across, 1.0)[..., None]
    kept = np.where(slipping, friction * n / np.where(slipping, across, 1.0), 1.0)
    slope = np.zeros((*tried.shape, 3))
    slope[..., 0, 0] = pushing
    slope[..., 1:, 0] = (slipping & pushing)[..., None] * friction[:, None] * along
    sideways = np.eye(2) - slipping[..., None, None] * along[..., :, None] * along[..., None, :]
    slope[..., 1:, 1:] = kept[..., None, None] * sideways
    return np.concatenate([n[..., None], kept[..., None] * tried[..., 1:]], axis=-1), slope
