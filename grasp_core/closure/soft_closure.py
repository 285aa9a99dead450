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

from grasp_core.arrays import Array, Indices
from grasp_core.closure import friction_search
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.decision import (
    DECIDED,
    Answer,
    departing_twist,
    sparing_twist,
    touching_twist,
)
from grasp_core.closure.friction_interval import FRICTIONLESS, NEARLY_AT_REST
from grasp_core.closure.proofs import SMALLEST_NORMAL
from grasp_core.closure.soft_contacts import (
    LOCAL,
    SoftContacts,
    depths,
    margin_ceiling,
    proved_margin,
    supports,
)
from grasp_core.errors import SolverError
from grasp_core.kinds import LARGEST_FRICTION
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

    def pushed(twist: Array) -> tuple[Array, Array]:
        slopes = contacts.slopes(twist)
        across = np.maximum(np.linalg.norm(slopes[:, 1:], axis=1), SMALLEST_NORMAL)
        working = np.hstack([np.ones((len(slopes), 1)), slopes[:, 1:] / across[:, None]])
        return supports(slopes), np.einsum("kwj,kj->kw", contacts.A, working)

    def held(some: Indices) -> Array:
        return contacts.A[some].transpose(0, 2, 1).reshape(-1, WRENCH)

    def solved(twists: Array, rest: Indices) -> tuple[float, Array, Array]:
        left = contacts.A[rest].transpose(1, 0, 2).reshape(WRENCH, -1)
        try:
            margin, local, reduced = margin_program(twists.T @ left, contacts.shares[rest])
        except SolverError:
            return math.inf, np.zeros(len(rest)), np.zeros(0)
        return margin, depths(local), reduced

    candidates = [twist]
    if abs(margin) < DECIDED:
        candidates.append(touching_twist(twist, pushed))
    sparing = sparing_twist(depths(local), held, solved) if margin > -DECIDED else None
    if sparing is not None:
        candidates += [sparing, touching_twist(sparing, pushed)]
    for each in candidates:
        if margin_ceiling(contacts, each) <= 0.0:
            return Answer(margin, local, each, closed=False)
    return Answer(margin, local, twist, closed=None)


def margin_program(balance: Array, shares: Array) -> tuple[float, Array, Array]:
    """Solve (1) for the margin, local coordinates (k, 4), and the twist of the dual program, (m,).

    They balance if `balance`, (m, 4k), maps them to zero; `shares` are the r_i.
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


@dataclass(slots=True)
class SoftInterval:
    """Friction up to `lower`, without force closure, and from `upper` on, with force closure.

    A twist at unit size, (6,), proves the one, and local coordinates, (k, 4), the other.
    """

    contacts: SoftContacts
    lower: float
    upper: float
    twist: Array | None = None
    local: Array | None = None

    def close(self, forces: Array, torques: Array, friction: float) -> None:
        """Lower the upper end to the friction that forces need, or at which they were found."""
        contacts = self.contacts
        needed = needed_friction(contacts, forces, torques)
        for tried in (*(needed * (1.0 + more) for more in INFLATED), friction):
            tried = max(tried, FRICTIONLESS)
            if not tried <= min(friction, self.upper):
                continue
            local = contacts.at_friction(tried).local(forces, torques)
            if proved_margin(contacts.at_friction(tried), local) > 0.0:
                self.upper, self.local = tried, local
                return

    def open(self, twist: Array, friction: float) -> None:
        """Raise the lower end to the friction up to which a twist separates, or at least did."""
        slopes = self.contacts.at_friction(1.0).slopes(twist)
        slopes = slopes[np.abs(slopes).max(axis=1) > NEARLY_AT_REST * float(np.linalg.norm(twist))]
        along, across = np.minimum(slopes[:, 0], 0.0), np.hypot(slopes[:, 1], slopes[:, 2])
        room = np.sqrt(np.maximum(along**2 - slopes[:, 3] ** 2, 0.0))
        # by (3), of contacts that are not at rest
        separated = (room / np.maximum(across, SMALLEST_NORMAL)).min(initial=LARGEST_FRICTION)
        for tried in (float(separated), friction):
            within = self.lower < tried < self.upper
            if within and margin_ceiling(self.contacts.at_friction(tried), twist) <= 0.0:
                self.lower, self.twist = tried, twist
                return


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
    trial, away = min(friction_search.FIRST_TRIAL, 0.5 * highest), 0.0
    for count in range(friction_search.MOST_TRIALS):
        narrow = found.upper - found.lower <= friction_search.FRICTION_ACCURACY * found.lower
        if narrow or found.upper <= FRICTIONLESS or not math.isfinite(found.upper):
            break
        root = _try(found, max(trial, FRICTIONLESS))
        if found.lower < trial < found.upper:
            # nothing is proved at the trial, probably the threshold: close in from both sides
            away = max(
                WIDENED * away, friction_search.NUDGE * friction_search.FRICTION_ACCURACY * trial
            )
            above = trial + away if trial + away < found.upper else found.upper
            below = max(trial - away, found.lower)
            _try(found, above)
            _try(found, max(below, FRICTIONLESS))
            if found.upper <= above and found.lower >= below:
                break
            continue
        lower, upper, away = found.lower, found.upper, 0.0
        if lower < root < upper and count % friction_search.HALVING != friction_search.HALVING - 1:
            trial = friction_search.slightly_past(root, trial, lower, upper)
        else:
            trial = math.sqrt(lower * upper) if lower > 0.0 else 0.1 * upper
    return found


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
