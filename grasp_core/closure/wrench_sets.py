"""Describes the wrenches that contacts can apply with bounded forces, in closed form.

Ferrari & Canny bound the contact forces in two ways:

    l1:    the normal forces sum to one; the set is the hull of all single contacts' cones,
           cut at unit normal force;
    linf:  each normal force is at most one; the set is the sum of such hulls with zero.

With s_i(y) the support of cone i cut at unit normal force, (4) of `force_closure`, the support of
the set in the direction y is

    h(y) = max_i s_i(y) for l1,  the sum of the positive s_i(y) for linf.               (1)

The force of contact i that attains s_i(y) is n_i + mu_i t, with t along the tangential part of its
velocity; so the circular cones need no pyramid.

Soft contacts have a fourth local component, u = m mu_i / mu_ti for the torque m about the normal
and the torsional coefficient mu_ti, that is, a torque over the length mu_ti / mu_i. Their cones,
|(t, u)| <= mu_i n, are circular too, in one dimension more; see `proofs`.

Source: Ferrari & Canny, "Planning optimal grasps" (ICRA 1992), with circular cones.
"""

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import Quantity, one_of, value_of
from grasp_core.arrays import Array, Frictions, Shape, frozen
from grasp_core.closure.contacts import (
    LOCAL,
    WRENCH,
    check_spread,
    contact_arrays,
    contact_frictions,
    contact_torsions,
    in_frames,
)
from grasp_core.closure.proofs import ContactCones
from grasp_core.declared import Declared, declared, trusted
from grasp_core.errors import InputError
from grasp_core.messages import shown
from grasp_core.solvers.conic import ConicProgram, minimize
from grasp_core.solvers.ties import on_grid
from grasp_core.values import Contact, Grasp

Norm: TypeAlias = Literal["l1", "linf"]
"""How contact forces are bounded: by the sum of normal forces (`l1`) or one by one (`linf`)."""

ProgramRows: TypeAlias = tuple[Array, Array | float]
"""Rows A and their right-hand sides b of b - A x."""
NO_SLIDE = 1e-290
"""Speed along the surface below which the direction of sliding is undefined."""
SAME_FRAME = 1e-9
"""How far frames may be from orthonormal: normals are unit vectors to nine digits."""
SET_DIGITS = 10
"""Digits after the point that searches are given: frames stay within `SAME_FRAME`."""
LARGEST_SCALE_RATIO = 1e6
"""Largest ratio of torque scale and contacts' extent, and its inverse: beyond it, rounding decides.
"""
LONGEST_LEVER = 2e9
"""Largest entry of a matrix of wrenches: coordinates up to `LARGEST_SCALE_RATIO`, and a thousand
times as much where torques are over a thousandth of the scale (see `measures`)."""


def scaled_arms(points: Array, center: ArrayLike, torque_scale: float) -> Array:
    """Compute levers of contacts about a centre, divided by the torque scale."""
    scale = value_of(Quantity, torque_scale, "torque_scale")
    spread = np.ptp(points, axis=0)
    check_spread(spread)
    apart = points - points.mean(axis=0)
    extent = float(np.linalg.norm(apart, axis=1).max()) if spread.any() else scale
    if not 1.0 / LARGEST_SCALE_RATIO <= scale / extent <= LARGEST_SCALE_RATIO:
        raise InputError(
            f"torque_scale must be within a factor {LARGEST_SCALE_RATIO:g} of the extent of the "
            f"positions, {extent:.3g} m, got {torque_scale}"
        )
    arms = (points - frozen(center, (3,), "center")) / scale
    if float(np.abs(arms).max()) > LARGEST_SCALE_RATIO:
        raise InputError(
            f"center must be within {LARGEST_SCALE_RATIO:g} times torque_scale of the positions, "
            f"got {shown(center)}"
        )
    return arms


@declared
class WrenchSet(Declared):
    """The set of wrenches that contacts can apply with bounded normal forces.

    Contact forces are local here: components (normal, tangent, tangent) of each contact in turn,
    or (normal, tangent, tangent, torque over a length) of soft ones.
    """

    G: Annotated[Array, Shape(WRENCH, None)]
    """Matrix from local contact forces to their wrench, with torques over the torque scale, (6,
    3k), or (6, 4k) with torsion."""
    friction: Frictions
    """Coulomb coefficients, (k,)."""
    norm: Norm
    """How normal forces are bounded: their sum is one newton (`l1`), or each is at most one newton
    (`linf`)."""

    @classmethod
    def of(
        cls,
        positions: ArrayLike | Grasp | Sequence[Contact],
        normals: ArrayLike | None,
        friction: ArrayLike,
        *,
        center: ArrayLike,
        torque_scale: float,
        norm: Norm = "l1",
        torsion_m: ArrayLike = 0.0,
    ) -> Self:
        """Make the wrench set of contacts; torques are about `center`, over `torque_scale`."""
        points, units = contact_arrays(positions, normals)
        one_of(norm, get_args(Norm), "norm")
        arms = scaled_arms(points, center, torque_scale)
        mu = contact_frictions(friction, len(points))
        torsions = contact_torsions(torsion_m, mu)
        torsion = None if torsions is None else torsions / torque_scale
        return cls.within(ContactCones.at(arms, units, mu, torsion), norm)

    @classmethod
    def at(cls, arms: Array, normals: Array, friction: Array) -> Self:
        """Make the `l1` set of contacts with levers and inward unit normals, unchecked."""
        return cls.within(ContactCones.at(arms, normals, friction), "l1")

    @classmethod
    def within(cls, cones: ContactCones, norm: Norm) -> Self:
        """Make the set of forces within cones, unchecked."""
        G = in_frames(cones.maps, cones.frames)
        return trusted(cls, G=G, friction=cones.friction, norm=norm)

    def on_grid(self) -> "WrenchSet":
        """Round the set to a grid, so that searches do not depend on last digits."""
        G, friction = on_grid(self.G, SET_DIGITS), on_grid(self.friction, SET_DIGITS)
        return trusted(WrenchSet, G=G, friction=friction, norm=self.norm)

    def _is_consistent(self) -> bool:
        """Return whether this is the wrench set of some contacts, up to `SAME_FRAME`."""
        k = len(self.friction)
        if not (k and self.G.shape[1] in (3 * k, LOCAL * k)):
            return False
        each = self.G.reshape(2, 3, k, -1).transpose(0, 2, 1, 3)
        frames, turns = each[..., :3]
        square = frames @ frames.transpose(0, 2, 1)
        levers = turns @ frames.transpose(0, 2, 1)
        slack = SAME_FRAME * np.maximum(np.abs(levers).max(axis=(1, 2), keepdims=True), 1.0)
        # G = (F; [x] F) for an orthonormal frame F at each contact's point x, so that F F' = 1,
        # and G_torque F' = [x] is skew
        return (
            bool((np.abs(square - np.eye(3)) <= SAME_FRAME).all())
            and bool((np.abs(levers + levers.transpose(0, 2, 1)) <= slack).all())
            and float(np.abs(self.G).max()) <= LONGEST_LEVER
            and (self.width != LOCAL or _are_torques(each[..., 3], frames[..., 0]))
        )

    @property
    def width(self) -> int:
        """Return the number of local components of a contact: three, or four with torsion."""
        return self.G.shape[1] // len(self.friction)

    @property
    def size(self) -> float:
        """Return the length [N] of the longest wrench of a unit normal force, to a factor 1.5."""
        longest = np.linalg.norm(self.G, axis=0).max()
        return float(longest * np.sqrt(1.0 + self.friction.max() ** 2))

    def supports(self, directions: Array) -> Array:
        """Compute how far the set reaches in several directions (n, 6), its support (1), (n,)."""
        slopes = (directions @ self.G).reshape(len(directions), -1, self.width)
        each = slopes[:, :, 0] + self.friction * _across(slopes)
        return each.max(axis=1) if self.norm == "l1" else np.maximum(each, 0.0).sum(axis=1)

    def support(self, direction: Array) -> tuple[float, Array]:
        """Compute how far the set reaches in a direction, and the local forces that attain it."""
        return self.reach(direction @ self.G)

    def reach(self, slopes: Array) -> tuple[float, Array]:
        """Compute the largest value of a linear function on the set, and forces that have it."""
        slopes = slopes.reshape(-1, self.width)
        across = _across(slopes)
        each = slopes[:, 0] + self.friction * across
        # all of it is one contact's for l1, and every positive one's for linf
        pushing = each > 0.0 if self.norm == "linf" else np.arange(len(each)) == each.argmax()
        forces = np.zeros_like(slopes)
        forces[pushing, 0] = 1.0
        sliding = pushing & (across > NO_SLIDE)
        ratios = self.friction[sliding] / across[sliding]
        forces[sliding, 1:] = slopes[sliding, 1:] * ratios[:, None]
        return float(each[pushing].sum()), forces.ravel()

    def edges(self) -> Array:
        """Return local forces, one a row, whose wrenches span the same space as the set."""
        k, width = len(self.friction), self.width
        each, ways = np.arange(k), np.eye(width)[1:]
        forces = np.zeros((k, 2 * (width - 1), k, width))
        slides = np.stack([ways, -ways], axis=1).reshape(-1, width)
        forces[each, :, each] = self.friction[:, None, None] * slides
        forces[each, :, each, 0] = 1.0
        rows = forces.reshape(-1, width * k)
        # no force at all belongs to linf only
        return np.vstack([rows, np.zeros(width * k)]) if self.norm == "linf" else rows

    def holds(self, forces: Array, slack: float | Array) -> bool:
        """Return whether local forces, (n, 3k) or (n, 4k), are within cones and bounds."""
        each = forces.reshape(len(forces), -1, self.width)
        pushes, slides = each[:, :, 0], _across(each)
        if self.norm == "l1":
            bounded = np.abs(pushes.sum(axis=1) - 1.0) <= slack
        else:
            bounded = pushes.max(axis=1) <= 1.0 + slack
        rooms = np.reshape(slack, (-1, 1))
        in_cones = (slides <= self.friction * pushes + rooms).all(axis=1)
        return bool((bounded & in_cones & (pushes.min(axis=1) >= -slack)).all())


def _across(local: Array) -> Array:
    """Compute the lengths of what is not normal in local forces, (..., 3) or (..., 4)."""
    slides = np.hypot(local[..., 1], local[..., 2])
    return np.hypot(slides, local[..., 3]) if local.shape[-1] == LOCAL else slides


def _are_torques(columns: Array, normals: Array) -> bool:
    """Return whether columns (2, k, 3) are no force and a torque along the normals (k, 3)."""
    forces, torques = columns
    levers = np.einsum("ki,ki->k", torques, normals)
    missed = np.abs(torques - levers[:, None] * normals).max(axis=1)
    straight = (missed <= SAME_FRAME * np.maximum(levers, 1.0)).all()
    return not forces.any() and bool(straight and (levers >= 0.0).all())


def contact_program(
    objective: Array, friction: Array, width: int, equal: Sequence[ProgramRows],
    least: Sequence[ProgramRows] = (), cones: Sequence[ProgramRows] = (), room: Array | None = None,
) -> ConicProgram:  # fmt: skip
    """Build a conic program over the local forces of contacts, side by side, and other numbers.

    What is listed as (A, b) makes b - A x zero, not negative, or a vector in a cone of its own. The
    friction cones come last. Without friction a cone is a ray: the other parts of the force are
    zero. With `room` r, (k,), the first of the other numbers, t, brings forces by r_i t into the
    cones, |f_t| <= mu f_n - r_i t.
    """
    n, count, flat = width * len(friction), len(objective), friction == 0.0
    parts = np.eye(n, count).reshape(-1, width, count)
    inside = -parts
    inside[:, 0] *= np.where(flat, 1.0, friction)[:, None]
    if room is not None:
        inside[:, 0, n] = room
    zeros = [*equal, (parts[flat, 1:].reshape(-1, count), 0.0)]
    positive = [*least, (inside[flat, 0], 0.0)]
    every = [*zeros, *positive, *cones, (inside[~flat].reshape(-1, count), 0.0)]
    A = np.concatenate([rows for rows, _ in every])
    b = np.concatenate([np.full(len(rows), right) for rows, right in every])
    equations, bounds = (sum(len(rows) for rows, _ in kind) for kind in (zeros, positive))
    lengths = (*(len(rows) for rows, _ in cones), *(width,) * int((~flat).sum()))
    return ConicProgram(objective, A, b, equations, bounds, lengths)


def nearest_wrench(wrenches: WrenchSet) -> tuple[Array, Array]:
    """Find forces, whose normal parts sum to one, of the wrench nearest to zero.

    The direction from it to zero, (m,), is a twist in which no contact has more support than minus
    the distance. The program always has a solution.
    """
    m, n = wrenches.G.shape
    forces, distance = np.eye(n, n + 1), np.eye(n + 1)[n]
    pushes = forces[:: wrenches.width].sum(axis=0)
    reached = np.vstack([-distance, -wrenches.G @ forces / wrenches.size])
    program = contact_program(
        distance, wrenches.friction, wrenches.width, [(pushes[None], 1.0)], cones=[(reached, 0.0)]
    )
    answer = minimize(program)
    start = program.zeros + program.nonnegatives + 1
    return into_cones(answer.x[:n], wrenches.friction), answer.z[start : start + m]


def into_cones(forces: Array, friction: Array) -> Array:
    """Move forces into the cones and scale them so that normal parts sum to one exactly."""
    each = forces.reshape(len(friction), -1).copy()
    each[:, 0] = np.maximum(each[:, 0], 0.0)
    across, allowed = _across(each), friction * each[:, 0]
    outside = across > allowed
    each[outside, 1:] *= (allowed[outside] / across[outside])[:, None]
    return each.ravel() / each[:, 0].sum()
