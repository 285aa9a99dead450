"""Decides force closure of soft contacts, and finds the friction from which on they have it.

Solved, in the local coordinates x = (n, a) of `soft_contacts`, with r_i = 1 / mu_i:

    maximise t  subject to  sum A_i x_i = 0,  sum n_i = 1,  |a_i| + r_i t <= n_i.       (1)

Each cone has four dimensions, so the conic solver solves (1); what its answers prove is decided by
`soft_contacts`. As with hard contacts, margins of zero need a twist that lies on the cones, or one
that leaves contacts at rest that balance by themselves.

Critical friction is the least common Coulomb coefficient from which on contacts with given torsion
are in force closure. Their cones grow with it, so the threshold is unique. Balancing forces and
torques bound it from above by the friction they need, a separating twist from below by the friction
up to which it separates, with the notation of `soft_contacts`:

    mu  <=  max_i |t_i| / sqrt(n_i^2 - (m_i / mu_t)^2),                                 (2)
    mu  >=  min_i sqrt((n_i.v_i)^2 - (mu_t w_i)^2) / |tangential part of v_i|.          (3)

Both are proved at the friction that is kept. With all r_i = 1 the program (1) has the margin V as
optimum, and friction enters it through the balance only, whose multiplier is the twist:

    dV / dmu  =  sum v_i.t_i / mu,                                                      (4)

so Newton's method says where to try next. Hard fingers need no less, so the search begins below
their critical friction.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import LARGEST_FRICTION
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.decision import (
    DECIDED,
    INTERIOR,
    NEWTON_STEPS,
    TOUCHING,
    Answer,
    departing_twist,
    null_space,
)
from grasp_core.closure.friction_interval import FRICTIONLESS, NEARLY_AT_REST
from grasp_core.closure.friction_search import (
    FIRST_TRIAL,
    FRICTION_ACCURACY,
    HALVING,
    MOST_TRIALS,
    NUDGE,
    slightly_past,
)
from grasp_core.closure.proofs import RANK, SMALLEST_NORMAL
from grasp_core.closure.soft_contacts import (
    LOCAL,
    SoftContacts,
    depths,
    margin_ceiling,
    proved_margin,
    supports,
)
from grasp_core.errors import SolverError
from grasp_core.solvers.conic import ConicProgram, minimize

INFLATED = (1e-9, 1e-8)
"""Relative amounts by which the friction (2) is raised before its proof, tried in turn."""
WIDENED = 4.0
"""Factor by which trials go away from a friction at which nothing can be proved."""


def decide(contacts: SoftContacts) -> Answer:
    """Decide force closure of soft contacts at unit size; forces are local coordinates (k, 4)."""
    try:
        margin, local, twist = margin_program(contacts.matrix, contacts.shares)
    except SolverError:
        nothing = np.zeros((len(contacts.friction), LOCAL))
        return Answer(math.nan, nothing, np.zeros(WRENCH), closed=None)
    if proved_margin(contacts, local) > 0.0:
        return Answer(margin, local, twist, closed=True)
    candidates = [twist]
    if abs(margin) < DECIDED:
        candidates.append(_touching(contacts, twist))
    sparing = _sparing(contacts, local) if margin > -DECIDED else None
    candidates += [] if sparing is None else [sparing, _touching(contacts, sparing)]
    for each in candidates:
        if margin_ceiling(contacts, each) <= 0.0:
            return Answer(margin, local, each, closed=False)
    return Answer(margin, local, twist, closed=None)


def margin_program(balance: Array, shares: Array) -> tuple[float, Array, Array]:
    """Solve (1) for the margin, local coordinates (k, 4), and the twist of the dual program.

    Takes `balance` (m, 4k); `shares` (k,).
    """
    k, m = len(shares), len(balance)
    n = LOCAL * k
    pushing = np.tile([1.0, 0.0, 0.0, 0.0], k)
    used = (np.abs(balance) > 0.0).any(axis=0) | (pushing > 0.0)
    departing = departing_twist(balance[:, used], pushing[used])
    if departing is not None:
        return -math.inf, np.zeros((k, LOCAL)), departing
    least = float(shares.min())
    A, b, q = np.zeros((m + 1 + n, n + 1)), np.zeros(m + 1 + n), np.zeros(n + 1)
    # equations: balance, and normal parts that sum to one
    A[:m, :n], A[m, :n], b[m], q[-1] = balance, pushing, 1.0, -1.0
    # cones: n - r t >= |a|, with t in units that keep its columns of order one
    A[m + 1 :, :n] = -np.eye(n)
    A[m + 1 :: LOCAL, n] = shares / least
    solution = minimize(ConicProgram(q, A, b, m + 1, 0, (LOCAL,) * k))
    x = solution.x[:-1]
    # what the solver leaves of the imbalance is taken off by least squares
    x = x - np.asarray(np.linalg.lstsq(balance, balance @ x, rcond=None)[0], dtype=np.float64)
    return float(solution.x[-1]) / least, x.reshape(k, LOCAL), -solution.z[:m]


def _touching(contacts: SoftContacts, twist: Array) -> Array:
    """Change a twist by Newton's method, so that nearly zero supports are zero up to rounding."""
    twist = twist / max(float(np.linalg.norm(twist)), SMALLEST_NORMAL)
    for _ in range(NEWTON_STEPS):
        slopes = contacts.slopes(twist)
        across = np.maximum(np.linalg.norm(slopes[:, 1:], axis=1), SMALLEST_NORMAL)
        excess = supports(slopes)
        touched = excess > -TOUCHING
        # the gradient of s_i in y is the wrench of the force in cone i that works most along y
        working = np.hstack([np.ones((len(slopes), 1)), slopes[:, 1:] / across[:, None]])
        gradients = np.einsum("kwj,kj->kw", contacts.A, working)[touched]
        step = np.asarray(
            np.linalg.lstsq(gradients, excess[touched], rcond=RANK)[0], dtype=np.float64
        )
        twist = twist - step
    return twist


def _sparing(contacts: SoftContacts, local: Array) -> Array | None:
    """Find a separating twist where some contacts balance each other, as for hard contacts.

    Such a twist leaves the balanced contacts at rest. Among these twists the program is solved
    again for the other contacts, until its optimum is negative or no contact is left.
    """
    rest, twists = np.arange(len(local)), np.eye(WRENCH)
    while True:  # each turn takes balanced contacts from the rest, or returns
        balanced = depths(local) > INTERIOR
        if not balanced.any():
            return None
        # a force inside its cone can work along all that its contact feels, so that must be zero
        held = contacts.A[rest[balanced]].transpose(0, 2, 1).reshape(-1, WRENCH)
        twists = null_space(held @ twists, twists)
        rest = rest[~balanced]
        if not twists.shape[1]:
            return None
        if not rest.size:
            return twists[:, 0]
        left = contacts.A[rest].transpose(1, 0, 2).reshape(WRENCH, -1)
        try:
            margin, local, reduced = margin_program(twists.T @ left, contacts.shares[rest])
        except SolverError:
            return None
        if margin < -DECIDED:
            return twists @ reduced
        if margin > DECIDED:
            return None


@dataclass(slots=True)
class SoftInterval:
    """Friction up to `lower`, without force closure, and from `upper` on, with force closure."""

    contacts: SoftContacts
    """The contacts, at any friction."""
    lower: float
    upper: float
    twist: Array | None = None
    """Twist that separates at `lower`, at unit size, (6,)."""
    local: Array | None = None
    """Local coordinates that prove closure at `upper`, (k, 4)."""

    def proved(self) -> bool:
        """Check both ends in plain arithmetic; an end without proof claims nothing."""
        below = self.twist is not None and _open(self.contacts, self.twist, self.lower)
        above = self.local is not None and _closed(self.contacts, self.local, self.upper)
        unclaimed = self.twist is None and self.lower == 0.0
        return (below or unclaimed) and (above or self.local is None)

    @property
    def narrow(self) -> bool:
        """Whether the interval is as narrow as asked for."""
        return (
            self.upper - self.lower <= FRICTION_ACCURACY * self.lower or self.upper <= FRICTIONLESS
        )

    def close(self, forces: Array, torques: Array, friction: float) -> None:
        """Lower the upper end to the friction that forces need, or at which they were found."""
        contacts = self.contacts
        needed = needed_friction(contacts, forces, torques)
        for tried in (*(needed * (1.0 + more) for more in INFLATED), friction):
            tried = max(tried, FRICTIONLESS)
            if not tried <= min(friction, self.upper):
                continue
            local = contacts.at_friction(tried).local(forces, torques)
            if _closed(contacts, local, tried):
                self.upper, self.local = tried, local
                return

    def open(self, twist: Array, friction: float) -> None:
        """Raise the lower end to the friction up to which a twist separates, or at least did."""
        for tried in (self._separated(twist), friction):
            if self.lower < tried < self.upper and _open(self.contacts, twist, tried):
                self.lower, self.twist = tried, twist
                return

    def _separated(self, twist: Array) -> float:
        slopes = self.contacts.at_friction(1.0).slopes(twist)
        slopes = slopes[np.abs(slopes).max(axis=1) > NEARLY_AT_REST * float(np.linalg.norm(twist))]
        along, across = np.minimum(slopes[:, 0], 0.0), np.hypot(slopes[:, 1], slopes[:, 2])
        room = np.sqrt(np.maximum(along**2 - slopes[:, 3] ** 2, 0.0))
        tiny = np.finfo(np.float64).tiny
        return float((room / np.maximum(across, tiny)).min(initial=LARGEST_FRICTION))


def needed_friction(contacts: SoftContacts, forces: Array, torques: Array) -> float:
    """Compute the friction (2) that forces (k, 3), torques (k,) need; infinite if none allows."""
    local = contacts.at_friction(1.0).local(forces, torques)
    room = np.maximum(local[:, 0], 0.0) ** 2 - local[:, 3] ** 2
    across = np.hypot(local[:, 1], local[:, 2])
    if ((room <= 0.0) & (across > 0.0)).any():
        return math.inf
    return float(np.sqrt(across**2 / np.where(room > 0.0, room, 1.0)).max())


def friction_interval(contacts: SoftContacts, highest: float) -> SoftInterval:
    """Find the interval of the critical friction, as narrow as accuracy or proofs allow."""
    found = SoftInterval(contacts, 0.0, math.inf)
    start = 2.0 * highest if highest < 0.5 * LARGEST_FRICTION else LARGEST_FRICTION
    _try(found, start)
    trial, away = min(FIRST_TRIAL, 0.5 * highest), 0.0
    for count in range(MOST_TRIALS):
        if found.narrow or not math.isfinite(found.upper):
            break
        root = _try(found, max(trial, FRICTIONLESS))
        if found.lower < trial < found.upper:
            # nothing is proved at the trial, probably the threshold: close in from both sides
            away = max(WIDENED * away, NUDGE * FRICTION_ACCURACY * trial)
            above = trial + away if trial + away < found.upper else found.upper
            below = max(trial - away, found.lower)
            _try(found, above)
            _try(found, max(below, FRICTIONLESS))
            if found.upper <= above and found.lower >= below:
                break
            continue
        trial, away = _next(found, root, trial, halve=count % HALVING == HALVING - 1), 0.0
    return found


def _next(found: SoftInterval, root: float, trial: float, *, halve: bool) -> float:
    lower, upper = found.lower, found.upper
    if lower < root < upper and not halve:
        return slightly_past(root, trial, lower, upper)
    return math.sqrt(lower * upper) if lower > 0.0 else 0.1 * upper


def _try(found: SoftInterval, friction: float) -> float:
    """Move the ends as far as the program's answer at a friction proves; return Newton's root."""
    contacts = found.contacts.at_friction(friction)
    try:
        margin, local, twist = margin_program(contacts.matrix, np.ones(len(contacts.friction)))
    except SolverError:
        return math.nan
    if margin > 0.0:
        found.close(*contacts.in_space(local), friction)
    else:
        found.open(twist, friction)
    if found.lower < friction < found.upper:
        # contacts that balance by themselves, with a margin of zero, must be left at rest
        answer = decide(contacts)
        if answer.closed is False:
            found.open(answer.twist, friction)
    slides = local[:, 1:3] * contacts.slopes(twist)[:, 1:3]
    # (4), over the logarithm of the friction
    slope = float(slides.sum())
    return friction * (1.0 - margin / slope) if slope > 0.0 and math.isfinite(margin) else math.nan


def _closed(contacts: SoftContacts, local: Array, friction: float) -> bool:
    return proved_margin(contacts.at_friction(friction), local) > 0.0


def _open(contacts: SoftContacts, twist: Array, friction: float) -> bool:
    return margin_ceiling(contacts.at_friction(friction), twist) <= 0.0
