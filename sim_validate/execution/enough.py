"""The least push, and stiffness of fingertips, that is proved to be enough for the trials.

The trials ask a squeeze to carry the weight and their largest acceleration a in any direction: the
loads of `any_direction(mass, a)`, a multiple 1 + a / g of the weight. `best_squeeze` finds the
least push that does, where the fingertips are stiff enough for the grip to be stable and for the
object to stay within what counts as held under all these loads. That is the linear model of slow
loads. Springs overshoot, and knocks and shakes about an axis bring torques, so the motion of the
held object in each trial is predicted as well. If it predicts a loss, more is asked: a larger
multiple where contacts slip before, and stiffer fingertips where the object moves too far.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.execution.loads import GRAVITY_M_PER_S2, LoadSet, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import first_best
from scenes.mujoco.held import HeldLayout, gravity_of
from scenes.mujoco.held_mjcf import HeldScene
from sim_validate.execution import paths
from sim_validate.execution.predictions import held_dynamics, predicted_losses
from sim_validate.execution.trials import trials_of
from sim_validate.execution.verdict import Enough
from sim_validate.settings.executions import ExecutionSettings

CLEAR = 1.1
"""Predicted loss of the trials that is asked for: predictions beyond a slip are not exact."""
ROUNDS = 8
"""Most times that more is asked; two are usual."""
NEAR = 1.05
"""Ratio of a stiffness that is enough to one that is not, at which the search for it ends."""
FIRM = 1e4
"""Stiffness at which no squeeze makes a grip unstable, in loads over the object's radius."""
UP = 1.005
"""Factor by which numbers are at least what they were when they are rounded to three digits."""


class NoSqueezeError(NoForcesError):
    """Raised where no squeeze executes a grasp; it knows what would be enough."""

    def __init__(self, reason: str, enough: Enough | None = None) -> None:
        super().__init__(reason if enough is None else f"{reason}; {enough}")
        self.enough = enough


Choose = Callable[[ExecutionSettings, LoadSet | None], BestSqueeze]
"""Chooses the squeeze of an execution with settings, or the least one that survives some loads."""
SceneOf = Callable[[ExecutionSettings, BestSqueeze], HeldScene]
"""Builds the scene in which a squeeze is executed."""


def found_enough(
    body: Polyhedron, settings: ExecutionSettings, choose: Choose, scene_of: SceneOf
) -> Enough:
    """Find the least push, and stiffness, that is enough for the trials of an execution."""
    kinds = ("shake along" if kind == "shake" else kind for kind in settings.trials)
    multiple = 1.0 + max(accelerations_g(settings)[kind] for kind in kinds)
    stiffness = settings.tip_stiffness_n_per_m
    firm = FIRM * multiple * settings.object_kg * GRAVITY_M_PER_S2 / body.radius + stiffness
    try:  # what no push on firm fingertips survives, no push survives
        _least(settings, firm, multiple, choose)
    except NoForcesError as error:
        return Enough(multiple, reason=f"it is proved that {error}")
    except (InputError, SolverError) as error:
        return Enough(multiple, reason=str(error))
    found = None
    for _ in range(ROUNDS):
        own = _stiff_enough(settings, (stiffness, firm), multiple, choose)
        if own is None:
            break
        best = choose(own, None)
        slip, loss = _predicted(body, own, best, scene_of(own, best).layout)
        found = Enough(best.scale, own.push_n, own.tip_stiffness_n_per_m, loss)
        if loss >= CLEAR:
            break
        more, stiffness = NEAR * CLEAR / max(loss, 0.5), own.tip_stiffness_n_per_m
        if slip > loss:
            stiffness *= more
        else:
            multiple *= more
    return found or Enough(multiple, reason="no stiffness of the fingertips is enough")


def accelerations_g(settings: ExecutionSettings) -> dict[str, float]:
    """Compute the largest acceleration of each kind of trial [9.80665 m/s^2].

    It is the palm's, at the object's radius where the palm turns. That of shakes is the one asked
    for, which samples of the sinusoid miss by up to some per cent. For a knock it is that of the
    object if nothing held it.
    """
    gravity, way = gravity_of(settings), np.array([1.0, 0.0, 0.0])
    stop = paths.stop(gravity, way, settings.stop_m_per_s2, settings.stop_from_m_per_s)
    lift, _ = paths.lift(way, settings.lift_m, settings.lift_s)
    knock = paths.knock(gravity, settings.impulse_n_s * way, np.zeros(3))
    return {
        **dict.fromkeys(("weight", "misplaced"), 0.0),
        **dict.fromkeys(("shake along", "shake about"), settings.shake_g),
        "lift": _largest(lift.accelerations),
        "stop": _largest(stop.accelerations),
        "knock": _largest(knock.wrenches) / settings.object_kg,
    }


def _largest(values: Array) -> float:
    return float(np.linalg.norm(values[:, :3], axis=1).max()) / GRAVITY_M_PER_S2


def _least(
    settings: ExecutionSettings, stiffness: float, multiple: float, choose: Choose
) -> tuple[ExecutionSettings, BestSqueeze]:
    """Find the squeeze of least push for a multiple of the weight, and settings with that push."""
    given = stiffness == settings.tip_stiffness_n_per_m
    own = replace(settings, tip_stiffness_n_per_m=stiffness if given else _rounded_up(stiffness))
    best = choose(own, any_direction(own.object_kg, (multiple - 1.0) * GRAVITY_M_PER_S2))
    return replace(own, push_n=_rounded_up(best.max_push_n)), best


def _stiff_enough(
    settings: ExecutionSettings, ends: tuple[float, float], multiple: float, choose: Choose
) -> ExecutionSettings | None:
    """Return the settings with the least stiffness between two that is enough, and its push."""

    def tried(stiffness: float) -> ExecutionSettings | None:
        try:
            own, best = _least(settings, stiffness, multiple, choose)
            choose(own, None)  # refused where rounding makes the grip unstable
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
    while found is not None and high > NEAR * low:
        middle = math.sqrt(low * high)
        if (better := tried(middle)) is None:
            low = middle
        else:
            found, high = better, middle
    return found


def _predicted(
    body: Polyhedron, settings: ExecutionSettings, best: BestSqueeze, layout: HeldLayout
) -> tuple[float, float]:
    """Predict the multiples of first slip and of loss, of the trial that is lost first."""
    dynamics = held_dynamics(best.grip, layout)
    alike = replace(settings, misplacements=1)  # they all have the prediction of the weight
    trials, _ = trials_of(body, layout, alike, dynamics.lowest_frequency)
    slips, losses = predicted_losses(
        dynamics, [trial.expected or trial.drive for trial in trials],
        [trial.turning for trial in trials], settings.most_m, settings.most_rad,
    )  # fmt: skip
    if not trials:
        return math.inf, math.inf
    first = first_best(-losses)
    return float(slips[first]), float(losses[first])


def _rounded_up(value: float) -> float:
    return float(f"{UP * value:.3g}")
