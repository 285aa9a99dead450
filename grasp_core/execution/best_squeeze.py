"""The squeeze that survives most: least push for stated loads, or most load for a stated push.

Fingers squeeze with forces that balance, and whose commands stay as they are when loads come.
Given the response of the grip, what a squeeze survives are rows that are linear in the squeeze, the
scale s of the loads and the limit N on pushes (see `squeeze_certificate`). So the largest scale for
a limit, and the least limit for the scale one, are linear programs with a row for every contact and
tangent direction. The response depends on the squeeze, but only through the geometric stiffness:
each round takes the response anew at the squeeze found so far, solves the program, and adds the
rows that the squeeze found breaks most. Of equal optima the one nearest to zero is taken
(see `ties`), so that squeezes move continuously with the response.

Multipliers of the rows at the last squeeze, with its own response, bound what any squeeze with
this response survives (see `squeeze_certificate`).

Source of the program as a cone program in the forces: Boyd & Wegbreit, "Fast computation of optimal
contact forces", IEEE T-RO (2007), for forces that are computed anew for each load.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import Quantity, instance, value_of
from grasp_core.arrays import Array
from grasp_core.closure.contacts import WRENCH
from grasp_core.errors import NoForcesError, SolverError
from grasp_core.execution.grips import STIFFNESS_N_PER_M, TIP_RADIUS_M, Grip, unsqueezed
from grasp_core.execution.loads import LoadSet
from grasp_core.execution.squeeze_certificate import (
    PROOF_SLACK,
    BestSqueeze,
    Cuts,
    SlipRows,
    Survival,
    no_scale,
)
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import first_best, nearest_optimum
from grasp_core.values import Contact, Grasp

MOST_SQUEEZE_PROGRAMS = 60
"""Most programs that are solved; ten are usual."""
SQUEEZE_GAP = 1e-4
"""Gap between scale and upper bound, relative to it, at which no more rounds follow: the nearest of
all optima gives up a fifth of it."""
ASKED_ABOVE_ONE = 1e-4
"""By how much more than scale one the least push is asked to survive: rows are met to less."""
UNUSED_AT_REST = 1e-5
"""Share of the friction that the search leaves unused at rest, where rows are met to less."""
VALUE = 0.25
"""Value of a program for weak motors, in its own units: optima are told apart by a share of one."""
SAFE = (1e-9, 1e-8, 1e-7, 1e-6)
"""Shares of the scale that are given away, tried in turn, so that rounding spoils no proof."""
SMALLER_PUSH = (
    "a smaller limit of pushes, with which it may be stable (max_push_n; of executions push_n, or "
    "--push-n)"
)
SMALLER_LOADS = "smaller loads, whose smaller pushes may leave it stable"
"""Advice where the best squeeze is unstable; commands and executions call the limit otherwise."""


def best_squeeze(
    body: Polyhedron,
    contacts: Grasp | Iterable[Contact],
    friction: ArrayLike,
    loads: LoadSet,
    *,
    max_push_n: float | None = None,
    stiffness: ArrayLike = STIFFNESS_N_PER_M,
    tip_radius_m: ArrayLike = TIP_RADIUS_M,
    motors: Motors | None = None,
) -> BestSqueeze:
    """Find the squeeze that survives most without replanning, in the linear model.

    With a limit on pushes the scale of the loads' ellipsoid is as large as possible. Without one
    the largest push is as small as possible, and the scale is one.

    Args:
        body: The object, whose centre of mass the torques of loads are about.
        contacts: A grasp, or contacts, at least two.
        friction: Coulomb coefficient, one for all contacts or one each.
        loads: Loads that must be survived (see `any_direction`).
        max_push_n: Largest normal force of a finger, at rest and under all loads [N]; None for the
            least that survives the loads at scale one.
        stiffness: Stiffness of the fingertips' springs [N/m]: one number, one each, or a symmetric
            matrix each, (k, 3, 3).
        tip_radius_m: Radius of the fingertips [m], one for all or one each.
        motors: Joints that the contact forces load, with the torques of their motors, which also
            carry the links at rest and under all loads; None for fingers that are as strong as
            `max_push_n` says.

    Raises:
        InputError: Shapes or ranges are wrong, or the contacts have no stiffness in some motion.
        NoForcesError: No squeeze survives the loads, or the grip is unstable under the best one.
        SolverError: A program's answer failed its check.
    """
    start = unsqueezed(body, contacts, friction, stiffness=stiffness, tip_radius_m=tip_radius_m)
    instance(loads, LoadSet, "loads", "gc.any_direction makes one")
    most = None if max_push_n is None else value_of(Quantity, max_push_n, "max_push_n")
    return searched(start, loads, most, motors)


def searched(
    start: Grip, loads: LoadSet, most: float | None, motors: Motors | None = None
) -> BestSqueeze:
    """Find the best squeeze of contacts, (see `best_squeeze`), starting from any squeeze."""
    survival = Survival.of(start, loads, motors)
    cuts = Cuts.first(len(survival.friction))
    best: _Round | None = None
    for _ in range(MOST_SQUEEZE_PROGRAMS):
        found = _solved(start, loads, survival, cuts, most, motors)
        if best is None or found.gap < best.gap:
            best = found
        allowed = SQUEEZE_GAP if most else SQUEEZE_GAP + ASKED_ABOVE_ONE
        if found.gap <= allowed * found.upper + found.nothing:
            break
        start, survival, cuts = found.grip, found.survival, found.more_cuts()
    if best is None or np.isinf(best.gap):
        raise SolverError("no squeeze was found to survive the loads, though its program has one")
    if not best.grip.stable:
        raise NoForcesError(
            "the grip is unstable under the best squeeze, whatever its force closure: its least "
            f"stiffness is {best.grip.least_stiffness:.3g} N/m; use stiffer or larger fingertips, "
            f"or {SMALLER_LOADS if most is None else SMALLER_PUSH}"
        )
    return _certified(best, loads, motors)


@dataclass(frozen=True, slots=True, eq=False)
class _Round:
    """A squeeze with its own response, and what it survives."""

    grip: Grip
    survival: Survival
    cuts: Cuts
    multipliers: Array
    balance: Array
    max_push_n: float
    worst: Cuts  # the worst angle of each case, in their order
    scales: Array
    """Scale at which the rows at these angles reach their limits, (rows,)."""
    upper: float
    least: float
    """Scale below which the squeeze is no answer: one where the least push is sought, else zero."""

    @property
    def reached(self) -> float:
        """Scale that the squeeze survives."""
        return float(self.scales.min())

    @property
    def gap(self) -> float:
        """What the upper bound leaves open."""
        return self.upper - self.reached if self.reached >= self.least else np.inf

    @property
    def nothing(self) -> float:
        """Scale that is none."""
        return no_scale(self.survival, self.max_push_n)

    def more_cuts(self) -> Cuts:
        """Return the rows so far and those that the squeeze breaks most."""
        slips = self.scales[: len(self.worst.cases)]
        broken = np.flatnonzero(slips < self.upper * (1.0 - PROOF_SLACK))
        angles = np.append(self.cuts.angles, self.worst.angles[broken])
        return Cuts(angles, np.append(self.cuts.cases, broken))


def _solved(
    start: Grip, loads: LoadSet, survival: Survival, cuts: Cuts, most: float | None,
    motors: Motors | None,
) -> _Round:  # fmt: skip
    local, multipliers = _program(survival, cuts, most)
    grip = start.squeezed(np.einsum("kij,kj->ki", start.frames, local))
    own = Survival.of(grip, loads, motors)
    local = grip.local_squeeze
    angles, slips = own.reactions(local).worst_angles()
    worst = Cuts(angles, np.arange(len(angles)))
    rows = own.rows(worst)
    pushes = rows.reached(local, 1.0)[rows.d > 0.0]
    limit = most or float(pushes.max()) * (1.0 + 2.0 * SAFE[-1])
    # of nearly equal angles a rule takes one, so that its row may end a little later
    scales = np.append(slips, rows.scales(local, limit)[len(slips) :])
    y, z = multipliers[:-WRENCH], multipliers[-WRENCH:]
    upper = max(own.bound(own.rows(cuts), y, z, limit), float(scales.min()))
    least = 0.0 if most else 1.0 + SAFE[-1]
    return _Round(grip, own, cuts, y, z, limit, worst, scales, upper, least)


def _program(survival: Survival, cuts: Cuts, most: float | None) -> tuple[Array, Array]:
    """Find the nearest optimal squeeze, (k, 3) local [N], and multipliers of all rows."""
    k, change = survival.contacts, np.linalg.norm(survival.change, axis=(1, 2))
    used = np.repeat([1.0, 1.0 - UNUSED_AT_REST], k)[: len(change)]  # under the loads, and at rest
    rows = replace(survival, friction=used * survival.friction).rows(cuts)
    unit = most or max(float(change.max()), float(np.abs(survival.offset).max()))
    program, answer = _optimum(survival, rows, most, unit)
    # weak motors let loads end far below the limit on pushes, which is no unit for them then
    if most and survival.torque_rows and 0.0 < answer.value < VALUE:
        unit *= answer.value / VALUE
        program, answer = _optimum(survival, rows, most, unit)
    x = nearest_optimum(program, answer)
    y = np.maximum(answer.multipliers[: len(rows.b)], 0.0)
    return unit * x[:-1].reshape(k, 3), np.append(y, answer.multipliers[-WRENCH:])


def _optimum(
    survival: Survival, rows: SlipRows, most: float | None, unit: float
) -> tuple[LinearProgram, Optimum]:
    """Solve the program of some rows with forces in a unit [N]."""
    goal = np.append(np.zeros(survival.G.shape[1]), 1.0)
    if most is None:  # the last unknown is minus the limit
        last, b = rows.d, (rows.b - (1.0 + ASKED_ABOVE_ONE) * rows.c) / unit
    else:
        largest = float(np.linalg.norm(survival.change, axis=(1, 2)).max())
        last, b = rows.c / largest, rows.b / unit + most / unit * rows.d
    # the last row: the scale, or minus the limit, is not negative, or not positive
    sign = -1.0 if most else 1.0
    A = np.vstack([np.column_stack([rows.R, last]), sign * goal])
    balance = np.column_stack([survival.G, np.zeros(WRENCH)])
    program = LinearProgram(goal, A, np.append(b, 0.0), balance, np.zeros(WRENCH))
    answer = maximize(program)
    if not isinstance(answer, Optimum):
        raise NoForcesError(_refusal(most, strong=not survival.torque_rows))
    return program, answer


def _refusal(most: float | None, *, strong: bool) -> str:
    within = "" if strong else " within the torques of the joints"
    stronger = "" if strong else "stronger motors, "
    if most is None:
        return (
            f"no balanced squeeze{within} survives the loads, however hard the fingers push; "
            f"{stronger}more friction, or contacts in force closure, may allow one"
        )
    return (
        f"no balanced squeeze{within} with pushes up to {most:.6g} N survives the offset of the "
        f"loads; {'' if strong else 'use stronger motors, '}allow larger pushes, or use more "
        "friction"
    )


def _certified(found: _Round, loads: LoadSet, motors: Motors | None) -> BestSqueeze:
    reactions = found.survival.reactions(found.grip.local_squeeze)
    for share in SAFE:
        scale = found.reached * (1.0 - share)
        proofs = reactions.multipliers(scale)
        if reactions.survives(scale, proofs):
            break
    else:
        raise SolverError("the proof that the squeeze survives its loads fails our check")
    contact, joint, direction = _first_reached(found)
    return BestSqueeze(
        found.grip, loads, found.max_push_n, scale, found.upper, contact, direction, proofs,
        found.cuts, found.multipliers, found.balance, motors, joint,
    )  # fmt: skip


def _first_reached(found: _Round) -> tuple[int, int, Array]:
    survival, numbers = found.survival, np.arange(len(found.scales))
    k, cases = survival.contacts, len(found.worst.cases)
    torques = survival.torques(numbers)[:, 0]
    # only what the loads do counts: nothing grows at rest
    loaded = np.concatenate([numbers[:k], numbers[cases : cases + k], torques.ravel()])
    place = first_best(-found.scales[loaded])
    way = survival.rows(found.worst).worst_of(int(loaded[place]))
    if place < 2 * k:
        return place % k, -1, way
    return -1, (place - 2 * k) % len(survival.motors.limits), way
