"""Finds what is enough: the least push, and stiffness, with which an object survives its trials.

The trials ask a squeeze to carry the weight and their largest acceleration a in any direction: the
loads of `any_direction(mass, a)`, a multiple 1 + a / g of the weight. `best_squeeze` finds the
least push that does, where the fingertips are stiff enough for the grip to be stable and for the
object to stay within what counts as held under all these loads. That is the linear model of slow
loads. Springs overshoot, and knocks and shakes about an axis bring torques, so the motion of the
held object in each trial is predicted as well. If it predicts a loss, more is asked: a larger
multiple where contacts slip before, and stiffer fingertips where the object moves too far.
"""

import math
from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.execution.loads import GRAVITY_M_PER_S2, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.solvers.ties import first_best
from scenes.mujoco.held_scene import gravity_of
from sim_validate.execution import paths
from sim_validate.execution.holders import Holder, planned
from sim_validate.execution.verdict import Enough
from sim_validate.settings import ExecutionSettings

NO_LOSS = 1.1
"""Predicted loss of the trials that is asked for: predictions beyond a slip are not exact."""
MOST_ASKED = 8
"""Most times that more is asked; two are usual."""
FINE_RATIO = 1.05
"""Ratio of a stiffness that is enough to one that is not, at which the search for it ends."""
FIRM = 1e4
"""Stiffness at which no squeeze makes a grip unstable, in loads over the object's radius."""
ROUNDED_BY = 1.005
"""Factor by which numbers are at least what they were when they are rounded to three digits."""


class NoSqueezeError(NoForcesError):
    """Raised where no squeeze executes a grasp; it knows what would be enough."""

    def __init__(self, reason: str, enough: Enough | None = None) -> None:
        super().__init__(reason if enough is None else f"{reason}; {enough}")
        self.enough = enough


def found_enough(holder: Holder, settings: ExecutionSettings) -> Enough:
    """Find the least push, and stiffness, that is enough for the trials of an execution."""
    kinds = ("shake along" if kind == "shake" else kind for kind in settings.trials)
    multiple = 1.0 + max(accelerations_g(settings)[kind] for kind in kinds)
    stiffness = settings.tip_stiffness_n_per_m
    weight_n = settings.object_kg * GRAVITY_M_PER_S2
    firm = FIRM * multiple * weight_n / holder.body.radius + stiffness
    try:  # what no push on firm fingertips survives, no push survives
        _least(holder, settings, firm, multiple)
    except NoForcesError as error:
        return Enough(multiple, reason=f"it is proved that {error}")
    except (InputError, SolverError) as error:
        return Enough(multiple, reason=str(error))
    found = None
    for _ in range(MOST_ASKED):
        own = _stiff_enough(holder, settings, (stiffness, firm), multiple)
        if own is None:
            break
        best = holder.squeeze(own)
        slip, loss = _predicted(holder, own, best)
        found = Enough(best.scale, own.push_n, own.tip_stiffness_n_per_m, loss)
        if loss >= NO_LOSS:
            break
        more, stiffness = FINE_RATIO * NO_LOSS / max(loss, 0.5), own.tip_stiffness_n_per_m
        if slip > loss:
            stiffness *= more
        else:
            multiple *= more
    return found or Enough(multiple, reason="no stiffness of the fingertips is enough")


def accelerations_g(settings: ExecutionSettings) -> dict[str, float]:
    """Compute the largest acceleration of each kind of trial, in units of gravity."""
    gravity, way = gravity_of(settings), np.array([1.0, 0.0, 0.0])
    stop = paths.stop(gravity, way, settings.stop_m_per_s2, settings.stop_from_m_per_s)
    lift, _ = paths.lift(way, settings.lift_m, settings.lift_s)
    knock = paths.knock(gravity, settings.impulse_n_s * way, np.zeros(3))
    return {
        **dict.fromkeys(("weight", "misplaced"), 0.0),
        **dict.fromkeys(("shake along", "shake about"), settings.shake_g),
        "lift": _largest(lift.accelerations),
        "stop": _largest(stop.accelerations),
        # of an object that nothing holds
        "knock": _largest(knock.wrenches) / settings.object_kg,
    }


def _largest(values: Array) -> float:
    return float(np.linalg.norm(values[:, :3], axis=1).max()) / GRAVITY_M_PER_S2


def _least(
    holder: Holder, settings: ExecutionSettings, stiffness: float, multiple: float
) -> tuple[ExecutionSettings, BestSqueeze]:
    """Find the squeeze of least push for a multiple of the weight, and settings with that push."""
    given = stiffness == settings.tip_stiffness_n_per_m
    own = replace(settings, tip_stiffness_n_per_m=stiffness if given else _rounded_up(stiffness))
    loads = any_direction(own.object_kg, (multiple - 1.0) * GRAVITY_M_PER_S2)
    best = holder.squeeze(own, loads)
    return replace(own, push_n=_rounded_up(best.max_push_n)), best


def _stiff_enough(
    holder: Holder, settings: ExecutionSettings, ends: tuple[float, float], multiple: float
) -> ExecutionSettings | None:
    """Return the settings with the least stiffness between two that is enough, and its push."""

    def tried(stiffness: float) -> ExecutionSettings | None:
        try:
            own, best = _least(holder, settings, stiffness, multiple)
            holder.squeeze(own)  # refused where rounding makes the grip unstable
        except (InputError, NoForcesError, SolverError):
            return None
        # the farthest that the loads move and turn the object
        moves = np.linalg.solve(best.grip.grasp_stiffness, best.loads.axes)
        moved, turned = (float(np.linalg.norm(part, 2)) for part in (moves[:3], moves[3:]))
        return own if moved <= own.most_m and turned <= own.most_rad else None

    low, high = ends
    if (found := tried(low)) is not None:
        return found
    found = tried(high)
    while found is not None and high > FINE_RATIO * low:
        middle = math.sqrt(low * high)
        if (better := tried(middle)) is None:
            low = middle
        else:
            found, high = better, middle
    return found


def _predicted(
    holder: Holder, settings: ExecutionSettings, best: BestSqueeze
) -> tuple[float, float]:
    # all misplacements have the prediction of the weight
    _, dynamics, trials, _ = planned(holder, replace(settings, misplacements=1), best)
    found = dynamics.losses(trials, settings)
    if not found:
        return math.inf, math.inf
    return found[first_best([-loss for _, loss in found])]


def _rounded_up(value: float) -> float:
    return float(f"{ROUNDED_BY * value:.3g}")
