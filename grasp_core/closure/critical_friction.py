"""Finds the critical friction, the least coefficient above which contacts are in force closure.

Solved: where the margin of the closure program changes sign as the common friction grows.

Force closure at one friction is force closure at every larger one, so the threshold is unique.
It is bracketed by certificates: balancing forces f_i bound it from above by their own steepest
angle, a separating twist with velocities v_i from below by the friction up to which it separates,

    mu  <=  max_i |tangential part of f_i| / n_i.f_i,                                         (1)
    mu  >=  min_i -n_i.v_i / |tangential part of v_i|.                                        (2)

On either side of its zero the margin is nearly linear in the friction. Its slope follows from the
program's answer: with tau the margin over mu, and the tangential forces in units of mu, friction
enters the program only through the balance, whose multiplier is the twist, so that

    d tau / d mu  =  sum v_i . (tangential part of f_i) / mu,                                 (3)

v_i being the velocity of contact i under the twist. Newton's method says where to try next.

A compiled search of the same kind comes first (see `margin_kernel`). The forces and the twist that
it finds are checked like all others; where there are none, or their interval is not narrow, the
search goes program by program, and what their answers prove is decided in rational arithmetic (see
`friction_interval`). The two ends of the scale come first then: contacts that no friction closes,
and contacts that any friction closes; both are questions of linear programs.

Every friction. Let S be no contacts at first. Seek pushes l_i >= 0 along the normals of the others
that balance with any forces at all at the contacts in S,

    sum over S of wrench(f_i) + sum over the others of l_i wrench(n_i) = 0,                   (4)

with as many l_i > 0 as can be. Add those contacts to S, and go on until nothing is added. If S
holds all contacts and the wrenches span six dimensions, every friction mu > 0 is enough: forces of
each round, times mu or less those of the round before, are inside all cones, since what a later
round does to a contact is small beside the push that the contact has already. Two rounds make a
margin that grows with the square of mu, three one with its cube. Otherwise, by Stiemke's lemma, a
twist leaves S at rest while all others depart along their normals, up to some positive friction.

No friction. Cones grow into the half-spaces n_i.f > 0 with the friction, so none is enough iff no
balanced forces push at all contacts, or the wrenches do not span; that is, iff some twist makes
every contact depart straight along its normal, or leaves it at rest:

    v_i = -c_i n_i,  c_i >= 0.                                                                (5)

Soft contacts keep their torsion whatever the friction. In four dimensions, with torques over mu_t
instead of lengths mu_t / mu (see `proofs`), forces (f, u) and velocities (v, w) bound it by

    mu  <=  max_i |f_t| / sqrt((n.f)^2 - u^2),                                                (6)
    mu  >=  min_i sqrt((n.v)^2 - w^2) / |tangential part of v|,                               (7)

which are (1) and (2) where u and w are zero. Hard contacts need no less friction, so the search
begins below theirs. It is proved in floating point at the frictions that are kept.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.allowed_values import LARGEST_FRICTION
from grasp_core.arrays import Array, cross
from grasp_core.closure.contacts import (
    WRENCH,
    contact_arrays,
    contact_torsions,
    grasp_map,
    normal_and_tangential,
    unit_size,
)
from grasp_core.closure.decision import (
    MARGIN_KERNEL,
    Decision,
    decide,
    deepest_forces,
    margin_program,
    null_space,
)
from grasp_core.closure.friction_interval import (
    FRICTIONLESS,
    NEARLY_AT_REST,
    REPORTED_AS_ZERO,
    FrictionInterval,
    at_the_first,
    closes,
    closing_forces,
    separates,
)
from grasp_core.closure.proofs import (
    CHECK_SLACK,
    LEAST_DIVISOR,
    RANK,
    ContactCones,
    margin_ceiling,
    proves_closure,
)
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.values import Contact, Grasp

LARGEST_VARIABLE = 1e4
"""Largest size of a variable of the programs, whose answers are of order one."""
POSITIVE_OPTIMUM = 1e-6
"""Optima below this count as zero: a hundred times the residual of a linear program."""
FRICTION_ACCURACY = 5e-8
"""Width of the final interval of a critical friction, relative to its upper end."""
FIRST_TRIAL = 0.5
PROOF_SHARES = (0.0, 1e-3, 0.03)
"""Frictions at which closure is tried, as shares of the way from the friction that the forces need
to the trial friction."""
TRIAL_STEPS = ((0.1 * FRICTIONLESS, 3.0), (1e-3, 2.0), (math.inf, 10.0))
"""Pairs of a distance and a factor: up to that distance from an undecided friction, the next trial
is that factor farther away."""
NUDGE = 0.4
"""Trials pass the expected threshold, to close in from both sides: by this share of the accuracy,
and by the error of Newton's method, which is its step's square over the friction."""
MOST_FRICTION_TRIALS = 80
"""Largest number of trials in one search: nine are usual, and some fifty where contacts are nearly
degenerate."""
LITTLE = 1e-3
"""Largest friction that is tried first where any positive friction seems enough."""
RESTING_SPEEDS = (NEARLY_AT_REST, 1e-7, 1e-5, 1e-3)
"""Speeds below which contacts are put to rest under a unit twist, tried in turn: a solver leaves
the square root of its accuracy where two contacts carry nearly all force."""
ADDED, SHAVED = 5e-9, 1e-10
"""Relative allowances for rounding: `ADDED` raises the friction that forces need, `SHAVED` lowers
the friction up to which a twist separates."""
SEARCHED = 0.95
"""Share of the wanted accuracy that the compiled search uses; the rest is left for rounding."""


def critical_friction(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    *,
    torsion_m: ArrayLike = 0.0,
) -> float:
    """Find the least common Coulomb coefficient that is proved enough for force closure.

    It is the upper end of an interval whose lower end is proved to be too little (see
    `critical_friction_interval`). In tests on 20,000 sets of contacts, half of them on grids, the
    interval is at most 6e-8 wide, or that share of its upper end where this is above 1.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]. It stays as it
            is whatever the friction; zero is a hard finger.

    Returns:
        The upper end: every larger coefficient suffices, by balanced forces inside the cones. It is
        0.0 where closure is proved at `REPORTED_AS_ZERO`, and `math.inf` where closure is
        proved at no friction up to `LARGEST_FRICTION`.

    Raises:
        InputError: Shapes or lengths are wrong.
    """
    points, units = contact_arrays(positions, normals)
    torsions = contact_torsions(torsion_m, np.ones(len(points)))
    hard = float(_upper_ends(points[None], units[None])[0])
    if torsions is None or hard == 0.0:
        return hard
    arms, _, size = unit_size(points)
    cones = ContactCones.at(arms, units, np.ones(len(points)), torsions / size)
    upper = min(soft_ends(cones, hard).upper, hard)
    return 0.0 if upper <= REPORTED_AS_ZERO else upper


def critical_frictions(
    positions: ArrayLike | Iterable[Grasp],
    normals: ArrayLike | None = None,
) -> Array:
    """Find the critical friction of each of many sets of contacts.

    `critical_friction` explains how it is found and proved.

    Args:
        positions: Contact points, (g, k, 3) [m], k >= 2; or grasps.
        normals: Unit vectors into the object, (g, k, 3).

    Returns:
        Upper ends of the intervals, (g,).

    Raises:
        InputError: Shapes or lengths are wrong.
    """
    return _upper_ends(*contact_arrays(positions, normals, many=True))


def critical_friction_interval(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
) -> FrictionInterval:
    """Find proved bounds of the critical friction, with the forces and twist as proof.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).

    Returns:
        The interval; its upper end is at least `FRICTIONLESS`, below which closure is not sought.

    Raises:
        InputError: Shapes or lengths are wrong.
    """
    points, units = contact_arrays(positions, normals)
    found, upper, forces, twists = _at_once(points[None], units[None])
    ends = FrictionEnds.of(points, units)
    # the quick answer is proved again in rational arithmetic before it is kept
    if found[0]:
        ends.close(forces[0], float(upper[0]), exactly=True)
        ends.open(twists[0])
    quick = ends.interval(points)
    if ends.settled:
        return quick
    slow = searched(points, units).interval(points)
    # the upper end is the one that `critical_friction` gives
    return slow if quick.forces is None else replace(slow, upper=quick.upper, forces=quick.forces)


def _upper_ends(points: Array, units: Array) -> Array:
    found, upper, _, _ = _at_once(points, units)
    for i in np.flatnonzero(~found):
        upper[i] = searched(points[i], units[i]).upper
    upper[upper <= REPORTED_AS_ZERO] = 0.0
    return upper


def _at_once(points: Array, normals: Array) -> tuple[NDArray[np.bool_], Array, Array, Array]:
    """Search for narrow intervals in compiled code, and prove both of their ends.

    Gives where one was found; upper ends, and forces and twists that prove closure just there.
    """
    arms, _, _ = unit_size(points)
    units = np.array(normals)  # writable, like all that the search is compiled for
    forces, twists = np.zeros_like(arms), np.zeros((len(arms), WRENCH))
    bounds, found = np.zeros((len(arms), 2)), np.zeros(len(arms), dtype=bool)
    compiled(MARGIN_KERNEL).search(
        arms, units, SEARCHED * FRICTION_ACCURACY, forces, twists, bounds
    )
    # (2): the friction for which the search says that its twists separate
    lower = bounds[:, 0]
    bounded = (lower > FRICTIONLESS) & (lower < 0.5 * LARGEST_FRICTION)
    bounded &= _separate(twists, arms, units, lower)
    highest = lower * (1.0 + FRICTION_ACCURACY - 2.0 * SHAVED)
    with np.errstate(over="ignore", invalid="ignore"):  # degenerate contacts, proved nothing below
        along, across = normal_and_tangential(forces, units)
        needed = (across / np.maximum(along, LEAST_DIVISOR)).max(axis=1)
    # (1): the friction that the forces need, raised by a tenth of the width so that they lie inside
    upper = needed * (1.0 + 0.1 * FRICTION_ACCURACY)
    near = np.flatnonzero(bounded & (upper <= highest))
    found[near] = _close(forces[near], arms[near], units[near], upper[near])
    # where these forces do not prove closure, the deepest ones at the highest allowed end may
    left = np.flatnonzero(bounded & ~found)
    upper[left] = highest[left]
    forces[left], _, _ = deepest_forces(arms[left], units[left], highest[left])
    found[left] = _close(forces[left], arms[left], units[left], highest[left])
    return found, upper, forces, twists


def _close(forces: Array, arms: Array, normals: Array, friction: Array) -> NDArray[np.bool_]:
    """Return which forces prove closure at one friction for all contacts of a set."""
    return proves_closure(ContactCones.at(arms, normals, friction[..., None]), forces)


def _separate(twists: Array, arms: Array, normals: Array, friction: Array) -> NDArray[np.bool_]:
    """Return which twists leave each contact at rest, or departing as steeply as (2) asks.

    Each contact may move by the rounding of its own speed only: that of the whole twist is too much
    where the margin grows with the square of the friction.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        sizes = np.linalg.norm(twists, axis=1)[:, None]
        velocities = twists[:, None, :3] + cross(twists[:, None, 3:], arms)
        along, across = normal_and_tangential(velocities, normals)
        departs = along + friction[:, None] * across <= CHECK_SLACK * np.hypot(along, across)
        still = np.hypot(along, across) <= CHECK_SLACK * sizes
    return (np.isfinite(sizes) & (sizes > 0.0) & (departs | still)).all(axis=1)


def combined(rounds: list[Array], friction: float, normals: Array) -> Array:
    """Combine the forces of some rounds to balanced ones inside the cones of a friction, (k, 3)."""
    total = rounds[0]
    for forces in rounds[1:]:
        along, across = normal_and_tangential(total, normals)
        sizes = np.linalg.norm(forces, axis=1)
        room, taken = (friction * along - across)[along > 0.0], sizes[along > 0.0]
        # half of what is left of a cone
        share = 0.5 / (1.0 + friction) * np.min(room / np.maximum(taken, RANK))
        total = total + min(float(share), 1.0) * forces
    return total


def rounds(arms: Array, normals: Array) -> list[Array]:
    """Return the balanced forces of each round if every positive friction closes; else none."""
    maps = grasp_map(arms).reshape(WRENCH, -1, 3)
    pushes = np.einsum("wki,ki->wk", maps, normals)
    settled, found = np.zeros(len(arms), dtype=bool), list[Array]()
    # each turn settles a contact: weights may be scaled up until a share is one
    while not settled.all():
        free = np.flatnonzero(~settled)
        held = maps[:, settled].reshape(WRENCH, -1)
        # (4), seen only in the directions of wrenches that the contacts of S cannot apply
        outside = null_space(held.T)
        weights = _most_pushes(outside.T @ pushes[:, free])
        if weights is None:
            return []
        forces = np.zeros_like(arms)
        forces[free] = weights[:, None] * normals[free]
        needed = -pushes[:, free] @ weights
        supporting = np.asarray(np.linalg.lstsq(held, needed, rcond=RANK)[0], dtype=np.float64)
        forces[settled] = supporting.reshape(-1, 3)
        found.append(forces)
        settled[free[weights > 0.0]] = True
    return [] if null_space(grasp_map(arms).T).shape[1] else found


def hopeless_twist(arms: Array, normals: Array) -> Array | None:
    """Find a twist (6,) that separates at every friction, by (5); None if there is none."""
    at_rest = null_space(grasp_map(arms).T)
    if at_rest.shape[1]:
        return at_rest[:, 0]
    k = len(arms)
    # (5) as a null space: the variables are the twist and the speeds c_i, whose sum is maximised
    departing = np.zeros((k, 3, k))
    departing[np.arange(k), :, np.arange(k)] = normals
    basis = null_space(np.hstack([grasp_map(arms).T, departing.reshape(3 * k, k)]))
    speeds = basis[WRENCH:]
    n, total = basis.shape[1], speeds.sum(axis=0)
    rows = np.vstack([-speeds, total, np.eye(n), -np.eye(n)])
    found = _best(total, rows, np.repeat([0.0, 1.0, LARGEST_VARIABLE], [k, 1, 2 * n]))
    return None if found is None else basis[:WRENCH] @ found


def _most_pushes(rows: Array) -> Array | None:
    """Find weights (n,) >= 0 with rows @ weights = 0, as many of them positive as possible."""
    basis = null_space(rows)
    k, n = basis.shape
    # shares from 0 to 1, each at most its weight: their sum counts the weights that can be positive
    shares = np.eye(k)
    nothing = np.zeros((k, n))
    limits = np.repeat([0.0, 0.0, 1.0, LARGEST_VARIABLE], k)
    found = _best(
        np.repeat([0.0, 1.0], [n, k]),
        np.block([[-basis, shares], [nothing, -shares], [nothing, shares], [basis, 0.0 * shares]]),
        limits,
    )
    if found is None:
        return None
    # pushes that can be positive can be one
    return np.where(found[n:] > 0.5, basis @ found[:n], 0.0)  # noqa: PLR2004 - between 0 and 1


def _best(c: Array, A: Array, b: Array) -> Array | None:
    """Return where c.x is largest subject to A x <= b; None if it is not clearly positive there."""
    if not A.shape[1]:
        return None
    try:
        found = maximize(LinearProgram(c, A, b))
    except SolverError:
        return None
    return found.x if isinstance(found, Optimum) and found.value > POSITIVE_OPTIMUM else None


def searched(points: Array, units: Array) -> "FrictionEnds":
    """Find ends of the critical friction as near each other as accuracy or proofs allow."""
    ends = FrictionEnds.of(points, units)
    hopeless = hopeless_twist(ends.cones.arms, units)
    if hopeless is not None:
        ends.opened(hopeless, math.inf)
    if ends.lower < math.inf:
        _try_little(ends)
        _close_in(ends, max(FIRST_TRIAL, 2.0 * ends.lower))
    return ends


def soft_ends(cones: ContactCones, highest: float) -> "FrictionEnds":
    """Find the ends for soft contacts; hard ones have the critical friction `highest`."""
    ends = FrictionEnds(cones.at_friction(1.0))
    _try(ends, min(2.0 * highest, LARGEST_FRICTION))
    if math.isfinite(ends.upper):
        _close_in(ends, max(min(FIRST_TRIAL, 0.5 * highest), FRICTIONLESS))
    return ends


def _close_in(ends: "FrictionEnds", trial: float) -> None:
    """Try one friction after the other, as Newton's method says, until the ends are settled."""
    for _ in range(MOST_FRICTION_TRIALS):
        if ends.settled:
            break
        trial = min(trial, LARGEST_FRICTION)
        answer = _try(ends, trial)
        if ends.lower < trial < ends.upper:
            _try_evened(ends, trial, answer.forces)
        ends.decided(trial)
        # the slope of the margin over mu with respect to the logarithm of mu
        cones = ends.cones.at_friction(trial)
        along, _ = normal_and_tangential(answer.forces, cones.normals)
        slides = answer.forces - along[:, None] * cones.normals
        slope = float((cones.velocities(answer.twist) * slides)[:, :3].sum())
        trial = ends.next_trial(trial, answer.margin, slope)


def _try(ends: "FrictionEnds", friction: float) -> Decision:
    """Move the ends as far as the margin program's answer at a friction proves."""
    try:
        answer = decide(ends.cones.at_friction(friction))
    except SolverError:  # zeros prove nothing
        nothing = np.zeros_like(ends.cones.normals), np.zeros(WRENCH)
        answer = Decision(math.nan, *nothing, closed=None)
    ends.close(answer.forces, friction)
    ends.open(answer.twist)
    return answer


def _try_little(ends: "FrictionEnds") -> None:
    """Look for a proof of closure at very small friction, or else for a first lower end."""
    units = ends.cones.inward
    every, friction = rounds(ends.cones.arms, units), FRICTIONLESS
    # friction is doubled: ten times from `FRICTIONLESS` to `LITTLE`
    while every and friction <= LITTLE and ends.forces is None:
        ends.close(combined(every, friction, units), friction, exactly=True)
        friction *= 2.0
    if ends.forces is None and ends.lower < FRICTIONLESS:
        _try(ends, FRICTIONLESS)


def _try_evened(ends: "FrictionEnds", friction: float, forces: Array) -> None:
    """Solve the margin program again in units of the pushes of its own answer.

    Near a threshold, some contacts push so much less than others that a solver cannot tell their
    depth from zero. In units of their own pushes, they are as deep.
    """
    cones = ends.cones.at_friction(friction)
    for _ in range(3):
        pushes, _ = normal_and_tangential(forces, cones.normals)
        pushes = np.maximum(pushes, 1e-10 * np.abs(pushes).max())
        if not pushes.min() > 0.0:
            return
        rows = np.linalg.qr((cones.maps * np.repeat(pushes, cones.width)).T)[0].T
        try:
            _, forces, _ = margin_program(cones, rows)
        except SolverError:
            return
        forces = pushes[:, None] * forces
        ends.close(forces, friction)
        if ends.upper <= friction:
            return


@dataclass(slots=True)
class FrictionEnds:
    """The proved ends of an interval of friction, and where to try next."""

    cones: ContactCones
    """The contacts at a friction of one."""
    points: Array | None = None
    """Positions of hard contacts, (k, 3) [m], for proofs in rational arithmetic; None of soft ones,
    whose proofs are in floating point."""
    lower: float = 0.0
    upper: float = math.inf
    forces: Array | None = None
    """Forces (k, w) that prove the upper end, at that friction."""
    twist: Array | None = None
    """Twist at unit size that proves the lower end."""
    center: float = math.nan
    """Friction at which neither side could be proved, probably the threshold; NaN if there is none.
    """
    spread: float = 0.0
    """Distance from `center` at which the next proofs are tried."""

    @classmethod
    def of(cls, points: Array, units: Array) -> "FrictionEnds":
        """Begin with nothing proved of hard contacts."""
        return cls(ContactCones.at(unit_size(points)[0], units, np.ones(len(points))), points)

    @property
    def settled(self) -> bool:
        """Return whether the interval is as narrow as asked for, or as proofs allow."""
        narrow = self.upper - self.lower <= FRICTION_ACCURACY * self.lower
        around = self.upper <= self.center + self.spread and self.lower >= self.center - self.spread
        beyond = max(self.lower, self.spread) >= LARGEST_FRICTION
        return self.upper <= FRICTIONLESS or narrow or around or beyond

    def interval(self, points: Array) -> FrictionInterval:
        """Return the proved interval of hard contacts, with forces that balance as floats can."""
        forces, contacts = self.forces, (points, self.cones.inward)
        twist = None if self.twist is None else at_the_first(self.twist, points)
        if forces is not None:
            exact = closing_forces(forces, *contacts, self.upper)
            if exact is not None and closes(exact, *contacts, self.upper):
                forces = exact
        return FrictionInterval(self.lower, self.upper, *contacts, forces, twist)

    def decided(self, friction: float) -> None:
        """Look farther away from a friction at which nothing was proved, or give up there."""
        undecided = self.lower < friction < self.upper
        if undecided and math.isnan(self.center):
            self.center, self.spread = friction, NUDGE * FRICTION_ACCURACY * friction
        elif undecided:
            self.spread *= next(factor for far, factor in TRIAL_STEPS if self.spread < far)
        elif self.upper <= self.center or self.lower >= self.center:
            self.center, self.spread = math.nan, 0.0  # the threshold turned out to be elsewhere

    def close(self, forces: Array, friction: float, *, exactly: bool = False) -> None:
        """Lower the upper end to the friction that forces need, or at which they were found."""
        along, _ = normal_and_tangential(forces, self.cones.normals)
        torques = forces[:, 3:] / friction  # over the lengths at a friction of one
        room = (along - np.abs(torques).sum(axis=1)) * (along + np.abs(torques).sum(axis=1))
        if not (along.min() > 0.0 and room.min() > 0.0):
            return
        _, across = normal_and_tangential(forces[:, :3], self.cones.inward)
        # by (6), and a little more
        needed = float((across / np.sqrt(room)).max()) * (1.0 + ADDED)
        tried = [needed + share * (friction - needed) for share in PROOF_SHARES]
        for enough in (friction,) if exactly else (*tried, friction):
            enough = max(enough, FRICTIONLESS)
            if not (enough <= friction and enough < self.upper):
                continue
            there = np.hstack([forces[:, :3], torques * enough])
            if self.points is None:
                proved = bool(proves_closure(self.cones.at_friction(enough), there))
            else:
                proved = closes(there, self.points, self.cones.inward, enough)
            if proved:
                self.upper, self.forces = enough, there
                return

    def open(self, twist: Array) -> None:
        """Raise the lower end to the friction up to which a twist separates."""
        length = float(np.linalg.norm(twist))
        if not 0.0 < length < math.inf:
            return
        speeds = np.linalg.norm(self.cones.velocities(twist / length), axis=1)
        # fewest at rest first, and the same contacts once
        for resting in np.unique([speeds <= slow for slow in RESTING_SPEEDS], axis=0):
            still, friction = _put_to_rest(twist / length, self.cones, resting)
            friction *= 1.0 - SHAVED
            if self.lower < friction < self.upper:
                self.opened(still, friction)

    def opened(self, twist: Array, friction: float) -> None:
        """Raise the lower end to a friction, where a twist separates there."""
        if self.points is None:
            proved = bool(margin_ceiling(self.cones.at_friction(friction), twist) <= 0.0)
        else:
            at_first = at_the_first(twist, self.points)
            proved = separates(at_first, self.points, self.cones.inward, friction)
        if proved:
            self.lower, self.twist = friction, twist

    def next_trial(self, friction: float, margin: float, slope: float) -> float:
        """Return the root of the margin by Newton's method, moved slightly past it."""
        if not math.isnan(self.center):
            above = self.center + self.spread
            return above if self.upper > above else self.center - self.spread
        root = friction - margin / slope if slope > 0.0 and math.isfinite(margin) else math.nan
        if self.lower < root < self.upper:
            # past itself, towards the wider side of the interval
            past = NUDGE * FRICTION_ACCURACY * root + (root - friction) ** 2 / root
            if self.upper - root > root - self.lower:
                return root + min(past, 0.5 * (self.upper - root))
            return root - min(past, 0.5 * (root - self.lower))
        highest = min(self.upper, 4.0 * LARGEST_FRICTION)
        if self.lower == 0.0:  # fast towards the least friction
            return max(math.sqrt(0.25 * FRICTIONLESS * highest), FRICTIONLESS)
        # in the middle, measured by the cones' half-angles
        return math.tan(0.5 * (math.atan(self.lower) + math.atan(highest)))


def _put_to_rest(
    twist: Array, cones: ContactCones, slowest: NDArray[np.bool_]
) -> tuple[Array, float]:
    """Put slow contacts to rest under a unit twist, which separates at most up to a friction."""
    if slowest.any():
        resting = cones.only(slowest).maps.T
        for _ in range(2):  # once more for what rounding leaves
            twist = twist - np.linalg.lstsq(resting, resting @ twist, rcond=NEARLY_AT_REST)[0]
    if not np.linalg.norm(twist) > 1e-3:  # noqa: PLR2004 - what is left is only rounding
        return twist, 0.0
    velocities = cones.velocities(twist)[~slowest]
    along, across = normal_and_tangential(velocities[:, :3], cones.inward[~slowest])
    turning = np.abs(velocities[:, 3:]).sum(axis=1)
    # (7), of contacts that depart
    departing = np.sqrt(np.maximum(-along - turning, 0.0) * np.maximum(turning - along, 0.0))
    with np.errstate(over="ignore"):  # contacts that hardly slide are separated at any friction
        ratios = departing / np.maximum(across, LEAST_DIVISOR)
    return twist, float(ratios.min(initial=2.0 * LARGEST_FRICTION))
