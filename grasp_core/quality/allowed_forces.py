"""Contact forces that are proved to balance a load, exactly, within all limits.

*The proof.* Forces f of any origin leave r = G f + w of a load w. The correction -A^+ r, with A the
columns of G for all that can act at contacts that push, balances them, and is no longer than

    c = |r| / sigma,   sigma the least singular value of A.                               (1)

So forces that balance w exactly are allowed if cones, pushes and torques of joints have room for
changes of length c, in which rounding is included. Directions in which A has no range are left to
rounding alone: no forces change what is left in them.

*The search.* Programs know forces to a share of the largest push, and near the critical friction
that is a multiple of the load. Their forces are mixed with forces deep within all limits that
balance nothing, or else a multiple of the load,

    (1 - s) f + s g   balances   (1 - s) w + s m w,                                       (2)

with the least share s for which (1) holds. Where no forces are within all limits by a margin,
contacts that cannot push in any balance are left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.closure.proofs import RANK
from grasp_core.closure.wrench_sets import contact_program
from grasp_core.errors import SolverError
from grasp_core.solvers.conic import minimize

SUM_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
"""Rounding of sums of products, relative to the sizes of their terms."""
MOVED_ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
"""Rounding of arms and loads that are moved from afar, relative to the sizes of their terms."""
ALLOWED_IMBALANCE = 1e-9
"""Largest part of forces by which they may miss balance, although (1) may allow more."""
PUSHING = 1e-3
"""Least push, over the largest, of contacts that can push where all do so as much as they can."""
FORCES_CAUTION = 2.0
"""How much more than rounding the search leaves to it, as forces are turned into the object's frame
and back."""


class AskedLoad(NamedTuple):
    """A wrench, and torques of joints that come with it, as those of links that turn with it do."""

    wrench: Array  # at unit size over the largest push, (6,)
    torques: Array  # over the joints' limits, (joints,)
    felt: float  # size of the terms of which the wrench is made

    def times(self, multiple: float) -> "AskedLoad":
        """Return a multiple of the load."""
        return AskedLoad(multiple * self.wrench, multiple * self.torques, multiple * self.felt)


class Mixture(NamedTuple):
    """Forces that balance a multiple of a load."""

    forces: Array  # in the contacts' frames, (k, w), over the largest push
    multiple: float


@dataclass(frozen=True, eq=False)
class AllowedForces:
    """The forces that contacts can apply, in units of the largest push, in their frames (k, w)."""

    G: Array  # from forces to their wrench at unit size, (6, k w)
    friction: Array  # Coulomb coefficients, (k,)
    acting: NDArray[np.bool_]  # which components can act, (k, w)
    shares: Array  # from forces to torques of joints, over their limits, (joints, k w)
    carried: Array  # torques of the joints without forces, over their limits, (joints,)
    far: float  # one, and the distance of the stated centre from the contacts over their size

    @property
    def count(self) -> int:
        """Return the number of contacts."""
        return len(self.friction)

    @cached_property
    def rates(self) -> Array:
        """How much of each room a change of the forces of length one takes at most, (rows,)."""
        joints = np.linalg.norm(self.shares, axis=1)
        return np.concatenate([1.0 + self.friction, np.ones(self.count), joints, joints])

    def rooms(self, forces: Array, load: AskedLoad) -> Array:
        """Compute the room to each cone, to the largest push, and to both torques, (rows,)."""
        torques = self.carried + load.torques + self.shares @ forces.ravel()
        pushes, across = forces[:, 0], np.linalg.norm(forces[:, 1:], axis=1)
        cones = np.where(self.friction > 0.0, self.friction * pushes - across, pushes)
        return np.concatenate([cones, 1.0 - pushes, 1.0 - torques, 1.0 + torques])

    def range_of(self, pushing: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
        """Return the range of A, (6, m), its singular values, and A^+, (k w, 6), for contacts."""
        key = pushing.tobytes()
        if key not in self._ranges:
            able = np.where((self.acting & pushing[:, None]).ravel(), self.G, 0.0)
            left, sizes, right = np.linalg.svd(able, full_matrices=False)
            known = sizes > max(RANK, 2.0 * SUM_ROUNDING * self.far * self.count)
            left, sizes, right = left[:, known], sizes[known], right[known]
            self._ranges[key] = left, sizes, (right.T / sizes) @ left.T
        return self._ranges[key]

    @cached_property
    def _ranges(self) -> dict[bytes, tuple[Array, Array, Array]]:
        return {}

    def needed(self, forces: Array, load: AskedLoad, rounding: float = 1.0) -> Array:
        """Return the room that forces need to prove by (1) that a load is balanced, (rows,).

        It is infinite where the load is out of range, or the forces are far from balance.
        """
        pushing: NDArray[np.bool_] = np.asarray(forces.any(axis=1), dtype=np.bool_)
        lost = rounding * SUM_ROUNDING
        ways, sizes, _ = self.range_of(pushing)
        left, total = self.G @ forces.ravel() + load.wrench, float(np.abs(forces).sum())
        rounded = lost * total + rounding * MOVED_ROUNDING * (self.far * total + load.felt)
        within = ways.T @ left
        beyond, missed = np.linalg.norm(left - ways @ within), np.linalg.norm(within)
        if not (beyond <= rounded and missed <= ALLOWED_IMBALANCE * total + rounded):
            return np.full(len(self.rates), np.inf)
        # half of sigma is left to rounding of it
        least = 0.5 * float(sizes.min(initial=np.inf))
        changed = (float(missed) + rounded) / least + lost * total
        needed = changed * self.rates
        needed[: self.count] *= pushing
        needed[2 * self.count :] += lost
        return needed

    def balance(self, forces: Array, load: AskedLoad) -> bool:
        """Return whether forces prove by (1) that a load is balanced within all limits."""
        acting, lost = np.where(self.acting, forces, 0.0), np.where(self.acting, 0.0, forces)
        if not acting.any():
            return not (lost.any() or load.wrench.any()) and bool(
                (self.rooms(acting, load) >= 0.0).all()
            )
        return bool(
            float(np.abs(lost).sum()) <= SUM_ROUNDING * float(np.abs(acting).sum())
            and (self.rooms(acting, load) >= self.needed(acting, load)).all()
        )

    def deepest(self, load: AskedLoad | None, pushing: NDArray[np.bool_]) -> Mixture | None:
        """Find forces with the most room that balance nothing, or a multiple of a unit load.

        None where the forces of contacts that may push, (k,), have no room at all.
        """
        k, width = self.acting.shape
        n, more = width * k, 1 if load is None else 2
        forces, room, multiple = np.eye(n, n + more), np.eye(n + more)[n], np.eye(n + more)[-1]
        pushes, shares, balance = forces[::width], self.shares @ forces, self.G @ forces
        if load is not None:
            shares = shares + load.torques[:, None] * multiple
            balance = balance + load.wrench[:, None] * multiple
        still = forces[np.repeat(~pushing, width)]
        joints = np.linalg.norm(self.shares, axis=1)[:, None] * room
        free = [] if load is None else [(-multiple[None], 0.0)]
        program = contact_program(
            -room, self.friction, width, [(balance, 0.0), (still, 0.0)],
            [(pushes + room, 1.0), (shares + joints, 1.0 - self.carried),
             (joints - shares, 1.0 + self.carried), *free],
            room=(1.0 + self.friction) * pushing,
        )  # fmt: skip
        try:
            found = minimize(program).x
        except SolverError:
            return None
        return Mixture(found[:n].reshape(k, width), 0.0 if load is None else float(found[-1]))

    @cached_property
    def _at_rest(self) -> Mixture | None:
        return self.deepest(None, np.ones(self.count, dtype=bool))

    def anchors(self, load: AskedLoad) -> Iterator[tuple[Mixture, NDArray[np.bool_]]]:
        """Find forces g of (2) with room, and the contacts that push, (k,), fewer each time."""
        pushing = np.ones(self.count, dtype=bool)
        if self._at_rest is not None:
            yield self._at_rest, pushing
        while pushing.any():
            found = self.deepest(load, pushing)
            if found is None:
                return
            yield found, pushing
            pushes = found.forces[:, 0]
            fewer = pushing & (pushes > PUSHING * pushes.max())
            if (fewer == pushing).all():
                return
            pushing = fewer

    def settled(self, found: Mixture, load: AskedLoad) -> Mixture:
        """Find a multiple of a unit load that is balanced by (1), the most near that of a program.

        No forces, and the multiple zero, where none is proved.
        """
        for anchor, pushing in self.anchors(load) if found.multiple > 0.0 else ():
            ends = [self._balanced(each, load, pushing) for each in (found, anchor)]
            needed = np.maximum(*(self._needed(each, load) for each in ends))
            lacking, room = needed - self._rooms(ends[0], load), self._rooms(ends[1], load) - needed
            if not (room >= 0.0).all():
                continue
            # the room of a mixture is no less than the mixture of rooms, but for rounding
            lacks = lacking > 0.0
            share = float((lacking[lacks] / (lacking + room)[lacks]).max(initial=SUM_ROUNDING))
            for grown in (share, min(2.0 * share, 1.0)):
                mixed = Mixture(
                    *((1.0 - grown) * a + grown * b for a, b in zip(*ends, strict=True))
                )
                if (self._rooms(mixed, load) >= self._needed(mixed, load)).all():
                    return mixed
        return Mixture(np.zeros(self.acting.shape), 0.0)

    def _rooms(self, mixed: Mixture, load: AskedLoad) -> Array:
        return self.rooms(mixed.forces, load.times(mixed.multiple))

    def _needed(self, mixed: Mixture, load: AskedLoad) -> Array:
        return self.needed(mixed.forces, load.times(mixed.multiple), FORCES_CAUTION)

    def _balanced(self, found: Mixture, load: AskedLoad, pushing: NDArray[np.bool_]) -> Mixture:
        """Correct the forces of contacts that push by (1), and leave the others out."""
        multiple, chosen = max(found.multiple, 0.0), self.acting & pushing[:, None]
        forces = np.where(chosen, found.forces, 0.0)
        left = self.G @ forces.ravel() + multiple * load.wrench
        changed = (self.range_of(pushing)[2] @ left).reshape(forces.shape)
        return Mixture(np.where(chosen, forces - changed, 0.0), multiple)
