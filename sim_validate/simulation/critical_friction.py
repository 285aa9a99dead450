"""The critical friction of a grasp in simulation: friction is lowered until the object lets go.

Fingers squeeze with forces that balance at the predicted critical friction mu*, and need it. Above
mu* these forces are inside their cones. Below it no balanced forces are with which all of these
fingers push, so the object must move. Where two fingers alone need mu*, the others must push as
well, or the object turns about the line between the two far above mu*: the forces are those just
above mu* whose least push is largest.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import NoForcesError, SolverError, UndecidedError
from grasp_core.forces.even_forces import even_forces
from scenes.layout import SQUEEZE
from sim_validate.simulation.protocol import FrictionProtocol
from sim_validate.simulation.rig import squeezed
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import Bench

ABOVE = (5e-4, 1e-3, 2e-3, 3e-3)
"""How far above the critical friction the forces are, tried in turn, relative to it: as far as the
simulated friction is then above the critical one, too."""
LEAST_PUSH = 1e-3
"""Least push that is enough, in largest pushes: with less than half of it boxes were seen to turn
up to 9 % above their critical friction."""
TILT = 2e-3
"""Largest displacement, in grasp sizes and critical frictions: a tilt acts like as much friction,
and servos hide five times as much, in largest normal forces."""


@dataclass(frozen=True, slots=True)
class CriticalFriction:
    """Where the analysis puts the least friction, and where simulation finds it."""

    predicted: float
    simulated: float | None = None
    """The middle of a bracket; zero where a tiny friction is enough; None where it was not
    measured, or not found near the prediction."""
    bracket: tuple[float, float] | None = None
    """A friction at which the object slipped, and one at which it stayed."""


def released_friction(
    bench: Bench, positions: Array, normals: Array, predicted: float, setup: Setup
) -> CriticalFriction:
    """Critical friction on a bench; its scene's own friction does not matter.

    Args:
        bench: Where fingertips stand at the contacts.
        positions: (k, 3) [m]
        normals: (k, 3)
        predicted: What the analysis says.
        setup: How trials are simulated.

    Raises:
        UndecidedError: No forces with which every finger pushes were found just above it.
    """
    protocol = setup.friction
    high = protocol.settling_friction * max(predicted, protocol.least_friction)
    least = max(predicted, 0.5 * protocol.least_friction)
    forces = forces_just_above(positions, normals, least)
    forces *= SQUEEZE * setup.fingers.max_normal_force_n
    rig = squeezed(bench, setup, forces, predicted, high)

    share = min(protocol.threshold, TILT * max(predicted, protocol.least_friction))

    def stays(frictions: list[float]) -> list[bool | None]:
        threshold = share * bench.scene.layout.grasp_size_m
        return [trace.stayed(threshold) for trace in rig.release(high, frictions)]

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
    """Frictions between which the object begins to stay, near the predicted one.

    None if it does so elsewhere, or if a trial says nothing about the object.
    """
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


def forces_just_above(positions: Array, normals: Array, critical: float) -> Array:
    """Balanced forces that need almost exactly the critical friction, the largest push 1 N, (k, 3).

    Those nearest to it with which every finger pushes enough, or else those farthest above.

    Raises:
        UndecidedError: None with which every finger pushes were found.
    """
    forces = None
    for above in ABOVE:
        try:
            forces = even_forces(positions, normals, (1.0 + above) * critical)
        except (NoForcesError, SolverError):
            continue
        if np.einsum("ki,ki->k", forces, normals).min() >= LEAST_PUSH:
            break
    if forces is None:
        raise UndecidedError(
            f"no forces with which every finger pushes were found just above the critical "
            f"friction {critical:.6g}"
        )
    return forces
