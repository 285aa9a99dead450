"""Finds the critical friction of a grasp in simulation.

Fingers squeeze with forces that balance at the predicted one, mu*, and need it, and friction falls
until the object slips. Above mu* these forces are inside their friction cones. Below mu* there are
no balanced forces with which all of these fingers push, so the object must move. Where two fingers
alone need mu*, the others must push as well: otherwise the object turns about the line between the
two far above mu*. Therefore the forces are planned for a friction just above mu*, with the smallest
push as large as possible.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from grasp_core.allowed_values import OrInfinity
from grasp_core.arrays import Array
from grasp_core.declared import Declared, declared
from grasp_core.errors import NoForcesError, SolverError, UndecidedError
from grasp_core.quality.contact_forces import even_forces
from scenes.mujoco.closure_scene import GENTLE_SQUEEZE, Scene
from scenes.mujoco_options import HARD_TIPS, Softness
from sim_validate.engine.rig import squeezed
from sim_validate.engine.setup import Setup
from sim_validate.engine.stepping import Bench
from sim_validate.settings import FrictionProtocol

PLANNED_ABOVE = (5e-4, 1e-3, 2e-3, 3e-3)
"""Excess of the friction that forces are planned for, relative to the critical friction. The values
are tried in turn. The simulated critical friction is too high by the same excess."""
LEAST_PUSHING = 1e-3
"""Least normal force that counts as pushing, relative to the largest one. With less than half of
it, boxes were seen to turn up to 9 % above their critical friction."""
TILT_ALLOWED = 2e-3
"""Largest displacement at which the object still counts as staying, relative to the grasp size
times the critical friction. A tilt of the object acts like that much additional friction; servos
hide a force imbalance of five times as much, in largest normal forces."""


@declared
class CriticalFriction(Declared):
    """The critical friction that the analysis predicts, and the one that simulation finds."""

    predicted: OrInfinity
    """The critical friction by analysis."""
    simulated: float | None = None
    """The middle of the bracket. It is zero if the object stays even at `least_friction`, and None
    if nothing was measured or the object does not begin to slip near the prediction."""
    bracket: tuple[float, float] | None = None
    """The object slipped at the first friction and stayed at the second."""


def released_friction(
    bench: Bench[Scene], positions: Array, normals: Array, predicted: float, setup: Setup, *,
    whole: bool = False,
) -> CriticalFriction:  # fmt: skip
    """Measure the critical friction of a grasp whose scene is compiled with any friction."""
    protocol = setup.friction
    high = protocol.settling_friction * max(predicted, protocol.least_friction)
    # The excess is relative, so a prediction of zero needs a friction to be relative to.
    least = max(predicted, 0.5 * protocol.least_friction)
    forces = forces_just_above(positions, normals, least, setup.physics)
    forces *= GENTLE_SQUEEZE * setup.fingers.max_normal_force_n
    rig = replace(squeezed(bench, setup, forces, predicted, high).at_rest(high), whole=whole)

    share = min(protocol.threshold, TILT_ALLOWED * max(predicted, protocol.least_friction))

    def stays(frictions: list[float]) -> list[bool | None]:
        threshold = share * bench.scene.layout.grasp_size_m
        trials = rig.releases(high, frictions, threshold)
        return [trace.stayed(threshold) for trace in rig.traced(trials)]

    if predicted < protocol.least_friction:
        (held,) = stays([protocol.least_friction])
        bracket = (0.0, protocol.least_friction) if held else None
        return CriticalFriction(predicted, 0.0 if held else None, bracket)
    bracket = bisected(stays, predicted, protocol)
    middle = None if bracket is None else 0.5 * (bracket[0] + bracket[1])
    return CriticalFriction(predicted, middle, bracket)


def bisected(
    stays: Callable[[list[float]], list[bool | None]], predicted: float, protocol: FrictionProtocol
) -> tuple[float, float] | None:
    """Bracket the friction at which the object begins to stay; None if not near the prediction."""
    for span in protocol.spans:
        lower, upper = (1.0 - span) * predicted, (1.0 + span) * predicted
        if stays([lower, upper]) == [False, True]:
            for _ in range(protocol.rounds):
                middle = 0.5 * (lower + upper)
                (stayed,) = stays([middle])
                if stayed is None:
                    return None
                lower, upper = (lower, middle) if stayed else (middle, upper)
            return lower, upper
    return None


def forces_just_above(
    positions: Array, normals: Array, critical: float, physics: Softness = HARD_TIPS
) -> Array:
    """Find balanced forces that need almost the critical friction, (k, 3), largest push 1 N.

    Every finger pushes enough with them, or they are for the largest friction in `PLANNED_ABOVE`.
    """
    forces = None
    for above in PLANNED_ABOVE:
        try:
            forces = even_forces(
                positions, normals, (1.0 + above) * critical, torsion_m=physics.torsion_m
            )
        except (NoForcesError, SolverError):
            continue
        if np.einsum("ki,ki->k", forces, normals).min() >= LEAST_PUSHING:
            break
    if forces is None:
        raise UndecidedError(
            "no balanced forces were found in which every finger pushes, at frictions just above "
            f"the critical friction {critical:.6g}"
        )
    return forces
