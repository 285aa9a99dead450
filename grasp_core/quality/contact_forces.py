"""Finds contact forces that balance given wrenches, or come near to it, and checks what is given.

Programs in pyramids come first, then programs in exact cones. Solved for, with the map G from
forces f to their wrench and the external wrench w,

    G f = -w,                                                                                 (1)
    l <= f_n <= u  for all contacts,                                                          (2)
    |f_t| <= mu f_n  for all contacts.                                                        (3)

Pyramids of 16 sides inside the cones make (3) linear, R f <= 0, and programs strictly convex and
quadratic. They give away 2 % of the friction; where they hold no forces, as just above the critical
friction, a conic program decides (`solvers.conic`). There are three objectives: the least norm |f|
(`solvers.qp`); the least friction, that is, the smallest r = max_i |f_t| / (a f_n), where contacts
whose frictions differ have weights a; and, where nothing balances, the least imbalance. The latter
two are nearest points of polyhedra. The second is found by Dinkelbach's iteration, in pyramids and
then in cones: forces with the least

    excess t,  |f_t| <= a (r f_n + t),                                                        (4)

over the current r need less friction, until they do not.

Forces are local, (normal, tangent, tangent) for each contact, in units of the largest normal force
or of the load, and lengths in units of the longest arm. An answer counts if it meets (1) to (3)
itself, whatever the solver says of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, SMALLEST, number, one_of, several
from grasp_core.arrays import SMALLEST_SIZE, Array, frozen
from grasp_core.closure.contacts import (
    contact_arrays,
    contact_frames,
    contact_frictions,
    contact_torsions,
    grasp_map,
    in_frames,
    unit_size,
)
from grasp_core.closure.proofs import ContactCones
from grasp_core.closure.wrench_sets import contact_program
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns, inscribed_share
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.messages import shown
from grasp_core.solvers import conic, qp
from grasp_core.solvers.conic import ConicProgram
from grasp_core.solvers.qp import PROXQP, check_solver, least_distance
from grasp_core.values import Contact, Grasp

FORCES_RESIDUAL = 1e-6
"""Largest imbalance and cone violation accepted, in units of the largest normal force: a
hundred times the accuracy asked of ProxQP."""
FINE_RESIDUAL = 1e-9
"""Largest imbalance, and distance outside the limits, of forces of least friction in cones."""
CLEARLY = 1.01
"""Factor by which a wrench must exceed all forces, so that rounding does not matter."""
NO_FORCE = 1e-100
KEPT_BACK = 1e-7
"""Share of the friction that is not used in cones, to cover the errors of the solver."""
REGULAR = 1e-3
"""Weight of the forces' own size that keeps programs strictly convex, against the excess (4) and
against the imbalance."""
FRICTIONLESS = 1e-6
"""Friction coefficient below which no lower one is searched for."""
PYRAMID_ROUNDS, IMPROVEMENT = 20, 1e-2
"""Most rounds in pyramids, and the share by which the coefficient must fall in each."""
CONE_ROUNDS, CONE_IMPROVEMENT = 12, 1e-4
"""Most rounds in exact cones, and the share by which the coefficient must fall in each. The excess
falls by half or more in a round, faster unless a finger idles; the search ends some 1e-4 above the
least."""
NO_PUSH = 1e-9
"""Share of the largest push below which a push counts as none: a hundred times the solver's error.
"""
IMBALANCE = 1e-9
"""Largest imbalance of the answer, in units of the largest push, for contacts of unit size."""
Objective: TypeAlias = Literal["least_norm", "least_friction", "closest"]


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """A wrench on contacts, scaled to unit size, and the limits of the forces that balance it."""

    frames: Array
    """Columns (normal, tangent, tangent) of each contact, (k, 3, 3)."""
    G: Array
    """Matrix from stacked local forces to their wrench, (6, 3k)."""
    inverse: Array
    """Pseudo-inverse of G, (3k, 6)."""
    null: Array
    """Orthonormal basis of the forces whose wrench is zero, as columns, (3k, v)."""
    scale: float
    """Unit of force [N]."""
    w: Array
    """External wrench, (6,), in units of `scale` and of the longest arm."""
    least: float
    """Least normal force allowed at any contact."""
    largest: float
    """Largest normal force allowed at any contact."""

    def beyond(self, friction: Array) -> bool:
        """Return whether the wrench exceeds all forces within limits and cones.

        No arm is longer than one, so this bounds forces and torques alike. Wrenches far beyond that
        would keep solvers busy for seconds.
        """
        most = CLEARLY * np.sqrt(1.0 + friction**2).sum()
        return bool(np.linalg.norm(self.w.reshape(2, 3), axis=1).max() > most * self.largest)

    def sides(self, friction: Array) -> tuple[Array, Array]:
        """Return rows C and limits d of forces, C f <= d: pyramids inside the cones, then (2)."""
        count, each = len(friction), np.arange(len(friction))
        rows, along = np.zeros((count, PYRAMID_SIDES, count, 3)), np.eye(3 * count)[0::3]
        rows[each, :, each, 0] = -friction[:, None] * inscribed_share()
        rows[each, :, each, 1:] = facet_turns(PYRAMID_SIDES)
        C, d = [rows.reshape(-1, 3 * count), -along], [np.zeros(count * PYRAMID_SIDES)]
        d.append(np.full(count, -self.least))
        if math.isfinite(self.largest):
            C.append(along)
            d.append(np.full(count, self.largest))
        return np.vstack(C), np.concatenate(d)

    def checked(self, f: Array, residual: float = FORCES_RESIDUAL) -> Array | None:
        """Make forces (3k,) balance to rounding; None where they then break a limit."""
        # the least change that balances f is the pseudo-inverse of what is left
        exact = f - self.inverse @ (self.G @ f + self.w)
        along = exact[0::3]
        wrong = float(np.abs(self.G @ exact + self.w).max())
        wrong = max(wrong, self.least - along.min(), along.max() - self.largest)
        return exact if wrong <= residual else None

    def in_space(self, f: Array) -> Array:
        """Turn local forces into forces in the object's frame, (k, 3) [N]."""
        return self.scale * np.einsum("kij,kj->ki", self.frames, f.reshape(-1, 3))


def balances(
    arms: Array, normals: Array, wrenches: Array, normal_force: tuple[float, float], *,
    by_load: bool,
) -> list[Balance]:  # fmt: skip
    """Scale contacts, (k, 3) [m], and wrenches, (n, 6) [N, N m], to unit size."""
    least, largest = normal_force
    size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
    frames = contact_frames(normals)
    G = in_frames(grasp_map(arms / size), frames)
    U, sizes, Vt = np.linalg.svd(G)
    rank = int(np.count_nonzero(sizes > max(G.shape) * np.finfo(np.float64).eps * sizes[0]))
    inverse, null = (Vt[:rank].T / sizes[:rank]) @ U[:, :rank].T, Vt[rank:].T
    found: list[Balance] = []
    for wrench in wrenches:
        scale = largest
        # the unit of force, the load or the limit, keeps all numbers of order one
        if by_load or not math.isfinite(largest):
            load = float(np.linalg.norm(wrench / np.repeat([1.0, size], 3)))
            scale = min(max(load, least), largest) or 1.0
        w = wrench / scale
        w[3:] /= size
        found.append(Balance(frames, G, inverse, null, scale, w, least / scale, largest / scale))
    return found


def needed_friction(f: Array, weights: Array, slack: float = FORCES_RESIDUAL) -> float:
    """Return the largest ratio of tangential to weighted normal force of forces (3k,).

    Tangential forces up to the slack count as none, and with a slack of zero those of contacts
    without weight.
    """
    along, across = f[0::3], np.hypot(f[1::3], f[2::3])
    ratios = across / np.maximum(weights * along, NO_FORCE)
    counted = across > slack if slack > 0.0 else weights > 0.0
    return float(ratios[counted].max(initial=0.0))


def in_cones(f: Array | None, friction: Array) -> bool:
    """Return whether local forces (3k,) are there and need no more than the friction."""
    return f is not None and needed_friction(f, friction) <= 1.0 + FORCES_RESIDUAL


def least_norm(balance: Balance, friction: Array, solver: str) -> Array | None:
    """Find balanced forces of least norm, (3k,), in pyramids or else in cones; None without any."""
    f = qp.least_norm(*balance.sides(friction), balance.G, -balance.w, solver)
    f = None if f is None else balance.checked(f)
    return f if in_cones(f, friction) else least_norm_in_cones(balance, friction)


def least_norm_in_cones(balance: Balance, friction: Array) -> Array | None:
    """Find balanced forces of least norm in the exact cones, (3k,), or None.

    Forces just above the critical friction are many times the load: the program is solved once to
    find their size, and again in units of it.
    """
    unit = 1.0
    for _ in range(2):
        program = _cone_program(balance, friction * (1.0 - KEPT_BACK), unit=unit)
        try:
            f = unit * conic.minimize(program).x[:-1]
        except SolverError:
            return None
        found = balance.checked(f)
        if in_cones(found, friction):
            return found
        unit = max(float(np.abs(f).max()), 1.0)
    return None


def least_friction(balance: Balance, start: float, weights: Array) -> Array | None:
    """Find forces (3k,) of least r, the friction being r times a weight, from some coefficient."""
    best, friction = None, start
    for _ in range(PYRAMID_ROUNDS):
        better = _toward_less_friction(balance, friction, weights)
        if better is None:
            break
        needed = needed_friction(better, weights)
        if best is not None and needed > friction * (1.0 - IMPROVEMENT):
            break
        best, friction = better, needed
    return None if best is None else lower_friction(balance, weights, best)


def _toward_less_friction(balance: Balance, friction: float, weights: Array) -> Array | None:
    """Find balanced forces (3k,) in pyramids with the least excess (4) over `friction`.

    The forces that solve (1) are f0 + N z with the null space N of G. With the excess t, what is
    minimised is, but for a constant, half the square of (sqrt(REGULAR) z, t + 1), so that the
    answer is the nearest point of a polyhedron.
    """
    f0, root = -balance.inverse @ balance.w, math.sqrt(REGULAR)
    C, d = balance.sides(friction * weights)
    # the pyramids, which come first, are widened by t: R f <= weight t
    excess = np.zeros(len(C))
    excess[: len(weights) * PYRAMID_SIDES] = np.repeat(weights, PYRAMID_SIDES)
    sides = np.column_stack([C @ balance.null / root, -excess])
    z = least_distance(sides, d - C @ f0 - excess)[:-1] / root
    return None if np.isnan(z).any() else balance.checked(f0 + balance.null @ z)


def lower_friction(balance: Balance, weights: Array, forces: Array) -> Array:
    """Find forces (3k,) in cones that need the least friction; the given ones if none need less."""
    best, friction = forces, needed_friction(forces, weights, 0.0)
    for _ in range(CONE_ROUNDS):
        if friction <= FRICTIONLESS:
            break
        program = _cone_program(balance, friction * weights, excess=weights)
        try:
            better = balance.checked(conic.minimize(program).x[:-1], FINE_RESIDUAL)
        except SolverError:
            break
        needed = math.inf if better is None else needed_friction(better, weights, 0.0)
        if better is None or not needed < friction:
            break
        # an improvement is kept, but a small one ends the search
        improved = needed < friction * (1.0 - CONE_IMPROVEMENT)
        best, friction = better, needed
        if not improved:
            break
    return best


def least_imbalance(balance: Balance, friction: Array) -> Array:
    """Find forces (3k,) in cones and limits that leave the least imbalance.

    The square of what (1) leaves, and a little of the forces' own size, is f'Pf/2 + q'f but for a
    constant: with P = L L', the least |L'f + inv(L) q|.
    """
    L = np.linalg.cholesky(balance.G.T @ balance.G + REGULAR * np.eye(balance.G.shape[1]))
    back, shift = np.linalg.inv(L).T, np.linalg.solve(L, balance.G.T @ balance.w)
    C, d = balance.sides(friction)
    z = least_distance(C @ back, d + C @ back @ shift)
    if np.isnan(z).any():
        raise SolverError("no forces were found in the friction cones, though pure pushes are some")
    f = back @ (z - shift)
    # normal parts are brought into the limits first, since they say how far slides may reach
    along = np.clip(f[0::3], balance.least, balance.largest)
    across = np.hypot(f[1::3], f[2::3])
    shrink = np.minimum(1.0, friction * along / np.maximum(across, NO_FORCE))
    return np.stack([along, shrink * f[1::3], shrink * f[2::3]], axis=1).ravel()


def _cone_program(
    balance: Balance, friction: Array, *, excess: Array | None = None, unit: float = 1.0
) -> ConicProgram:
    """Build the program with (1) to (3): of least norm or, with weights a, of least excess (4).

    Its last variable is a bound on the norm, or the excess. Forces are in units of `unit`.
    """
    n = balance.G.shape[1]
    forces, last = np.eye(n, n + 1), np.eye(n + 1)[n]
    pushes = forces[0::3]
    limits = [(-pushes, -balance.least / unit)]
    if math.isfinite(balance.largest):
        limits.append((pushes, balance.largest / unit))
    norm = [] if excess is not None else [(-np.vstack([last, forces]), 0.0)]
    room = None if excess is None else -excess
    equal = [(balance.G @ forces, -balance.w / unit)]
    return contact_program(last, friction, 3, equal, limits, norm, room)


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
    torsions = contact_torsions(torsion_m, mu)
    cones = ContactCones.at(arms, units, mu, None if torsions is None else torsions / size)
    # tangential unknowns over mu, so that small coefficients are solved as well as large ones
    frames, (k, width) = cones.frames, cones.normals.shape
    frames[:, :, 1:] *= mu[:, None, None]
    n = width * k
    unknowns, least = np.eye(n, n + 1), np.eye(n + 1)[n]
    pushes, balance = unknowns[::width], in_frames(cones.maps, frames) @ unknowns
    program = contact_program(
        -least, np.sign(mu), width, [(balance, 0.0)], [(pushes, 1.0), (least - pushes, 0.0)]
    )
    local = conic.minimize(program).x[:-1].reshape(k, width)
    if not local[:, 0].min() > NO_PUSH:
        raise NoForcesError(
            f"no balanced forces in which every finger pushes were found at friction {mu}; "
            "more friction may allow them"
        )
    forces = np.einsum("kij,kj->ki", frames, local) / local[:, 0].max()
    imbalance = float(np.abs(cones.wrench(forces)).max())
    if not imbalance <= IMBALANCE:
        raise SolverError(
            f"the solver's forces miss balance by {imbalance:.3g} of the largest push"
        )
    return np.array(forces[:, :3])


def _check_limits(normal_force: tuple[float, float]) -> None:
    each = partial(number, name="normal_force", ge=0.0, le=math.inf)
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
