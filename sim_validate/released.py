"""The critical friction of a grasp in simulation: friction is lowered until the object lets go.

Fingers squeeze with forces that balance at the predicted critical friction mu*, and need it. Above
mu* these forces are inside their cones. Below it no balanced forces are, whatever the fingers do,
so the object must move. The forces come from the closure program just above mu*.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure import force_closure
from grasp_core.critical import critical_friction
from grasp_core.errors import InputError, UndecidedError
from grasp_core.on_faces import check_on_faces
from grasp_core.values import Grasp, Polyhedron
from scenes.layout import SQUEEZE
from scenes.mjcf import build_scene
from sim_validate.gate import require_faithful
from sim_validate.protocol import FrictionProtocol
from sim_validate.rig import squeezed
from sim_validate.setup import Setup
from sim_validate.simulate import Bench
from sim_validate.traces import Trace

ABOVE = (2e-7, 1e-6, 1e-5, 1e-4, 1e-3)
"""How far above the critical friction closure is proved, tried in turn, relative to it."""


@dataclass(frozen=True, slots=True)
class CriticalFriction:
    """Where the analysis puts the least friction, and where simulation finds it."""

    predicted: float
    simulated: float | None = None
    """The middle of a bracket; zero where a tiny friction is enough; None where it was not
    measured, or not found near the prediction."""
    bracket: tuple[float, float] | None = None
    """A friction at which the object slipped, and one at which it stayed."""


def simulated_critical_friction(
    body: Polyhedron, grasp: Grasp, setup: Setup | None = None
) -> float:
    """Smallest friction at which a squeezed object stays where it is in simulation.

    Args:
        body: The object.
        grasp: On its faces.
        setup: How trials are simulated.

    Returns:
        The friction; zero if less than `FrictionProtocol.least_friction` is enough; infinity
        if it was not found within a factor of 1.5 of the predicted critical friction.

    Raises:
        InputError: The contacts are not on the body's faces, or never in force closure.
        UnfaithfulError: The simulator fails the gate with these settings.
    """
    setup = setup or Setup()
    check_on_faces(body, grasp)
    require_faithful(setup)
    predicted = critical_friction(grasp)
    if not np.isfinite(predicted):
        raise InputError(f"grasp {grasp.id}: no friction gives force closure")
    scene = build_scene(
        body, grasp, max(predicted, setup.friction.least_friction),
        fingers=setup.fingers, physics=setup.physics, surface=setup.surface,
    )  # fmt: skip
    found = released_friction(Bench(scene, threads=setup.threads), grasp, predicted, setup)
    return np.inf if found.simulated is None else found.simulated


def released_friction(
    bench: Bench, grasp: Grasp, predicted: float, setup: Setup
) -> CriticalFriction:
    """Critical friction on a bench; its scene's own friction does not matter."""
    protocol = setup.friction
    high = protocol.settling_friction * max(predicted, protocol.least_friction)
    forces = forces_just_above(grasp, max(predicted, 0.5 * protocol.least_friction))
    forces *= SQUEEZE * setup.fingers.max_normal_force_n
    rig = squeezed(bench, setup, forces, predicted, high)

    def stays(frictions: list[float]) -> list[bool]:
        return [_stays(motion, rig.bench.scene.layout.grasp_size_m, protocol)
                for motion in rig.release(high, frictions)]  # fmt: skip

    if predicted < protocol.least_friction:
        (held,) = stays([protocol.least_friction])
        bracket = (0.0, protocol.least_friction) if held else None
        return CriticalFriction(predicted, 0.0 if held else None, bracket)
    bracket = bisected(stays, predicted, protocol)
    middle = None if bracket is None else 0.5 * (bracket[0] + bracket[1])
    return CriticalFriction(predicted, middle, bracket)


def bisected(
    stays: Callable[[list[float]], list[bool]], predicted: float, protocol: FrictionProtocol
) -> tuple[float, float] | None:
    """Frictions between which the object begins to stay, near the predicted one."""
    for span in protocol.spans:
        lower, upper = (1.0 - span) * predicted, (1.0 + span) * predicted
        if stays([lower, upper]) == [False, True]:
            for _ in range(protocol.rounds):
                middle = 0.5 * (lower + upper)
                lower, upper = (lower, middle) if stays([middle])[0] else (middle, upper)
            return lower, upper
    return None


def _stays(trace: Trace, size: float, protocol: FrictionProtocol) -> bool:
    return trace.sound and bool((trace.displacements_m < protocol.threshold * size).all())


def forces_just_above(grasp: Grasp, critical: float) -> Array:
    """Balanced forces that need almost exactly the critical friction, the largest push 1 N, (4, 3).

    Raises:
        UndecidedError: Closure is not proved up to a thousandth above it.
    """
    for above in ABOVE:
        try:
            forces = force_closure(grasp, friction=(1.0 + above) * critical).forces
        except UndecidedError:
            continue
        if forces is not None:
            return forces / float(np.einsum("ki,ki->k", forces, grasp.normals).max())
    raise UndecidedError(f"closure just above the critical friction {critical:.6g} is not decided")
