"""Makes negative controls of a hand, which provably lets go, and tries them in simulation.

A negative control is a hand that stands in a grasp, with motors, friction or load changed. It
changes one thing about the weakest wrench that the grasp is tested with, and carries the proof that
the hand cannot hold it then: the upper bound of the wrench's limit (`WrenchLimit`) is below what is
applied, by `EXCESS` at least. Its servos are told what would hold the load if nothing had been
changed, and the proof says that no other commands would do better.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field, computed_field

from grasp_core.allowed_values import FLAT, SMALLEST, Friction
from grasp_core.arrays import Array, Shape, rounded, to_digits
from grasp_core.declared import Declared, declared
from grasp_core.figures import Shown
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limits import WrenchLimit
from scenes.mujoco.hand_scenes import HandScene
from sim_validate.engine.held_or_let_go import LET_GO, HoldVerdict, judge
from sim_validate.engine.planned_loads import LoadPlanner, PlannedLoad
from sim_validate.engine.rig import closed_on
from sim_validate.engine.schedules import TrialLoad, part
from sim_validate.engine.setup import Setup

EXCESS = 0.05
"""Share of the applied load, at least, that no forces of a control can balance."""
OVERLOAD = 1.1
"""Load of the overloaded control, over the predicted limit."""
WEAK_MOTORS = 0.9
"""Torque limits of the control with weak motors, over those that the load needs."""
USUAL_LOAD = 0.8
"""Load of the controls with a dead motor or low friction, over the predicted limit of the hand."""
FRICTIONS = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
"""Frictions that are tried for the control with low friction, over that of the grasp."""


@declared
class HandControl(Declared):
    """A load that a hand provably cannot hold, after one thing has been changed."""

    name: Annotated[str, Shown("control")]
    """`overloaded`, `weak_motors`, `dead_motor` or `low_friction`."""
    explanation: str
    """What was changed, as a sentence."""
    friction: Friction
    """Coulomb coefficient at every contact."""
    limits: Annotated[Array, Shape(None), Field(alias="torque_limits_n_m")]
    """Largest torque of each joint, (joints,) [N m]."""
    share: float
    """What is applied, over the limit before the change."""
    proof: WrenchLimit
    """Proof about what is applied after the change: `upper` is below one."""


@dataclass(frozen=True, slots=True, eq=False)
class HandCase(LoadPlanner):
    """A hand's contacts and motors, from which its controls are made."""

    motors: Motors


def hand_controls(
    case: HandCase, weakest: PlannedLoad, names: tuple[str, ...]
) -> tuple[HandControl, ...]:
    """Make the negative controls that exist for a hand, at most one of each kind."""
    at_limit = weakest.limit.wrench
    explanation = f"the load is {OVERLOAD:g} times the predicted limit"
    found = list(_proved("overloaded", explanation, case, at_limit, OVERLOAD))
    weak = WEAK_MOTORS * case.motors.limits
    if (np.abs(case.motors.gravity) < weak).all():
        motors = replace(case.motors, limits=weak)
        explanation = f"every motor has {WEAK_MOTORS:g} of the torque that the load needs"
        found += _proved("weak_motors", explanation, replace(case, motors=motors), at_limit, 1.0)
    return (*found, *_dead_motor(case, at_limit, names), *_low_friction(case, at_limit))


def _dead_motor(case: HandCase, at_limit: Array, names: tuple[str, ...]) -> Iterator[HandControl]:
    """Switch off the motor without which the hand holds least; none where all carry links."""
    found: list[tuple[float, int, HandCase]] = []
    for joint, lever in enumerate(np.abs(case.motors.levers).max(axis=1).tolist()):
        if lever == 0.0 or case.motors.gravity[joint]:
            continue
        limits = case.motors.limits.copy()
        limits[joint] = SMALLEST
        dead = replace(case, motors=replace(case.motors, limits=limits))
        found.append((rounded(dead.limit(at_limit).upper), joint, dead))
    if found:
        _, joint, dead = min(found, key=lambda each: each[:2])
        explanation = f"the motor of {names[joint]} is dead"
        yield from _proved("dead_motor", explanation, dead, at_limit, USUAL_LOAD)


def _low_friction(case: HandCase, at_limit: Array) -> Iterator[HandControl]:
    for share in FRICTIONS:
        slippery = replace(case, friction=rounded(share * case.friction))
        explanation = f"the friction is {slippery.friction:.3g} instead of {case.friction:.3g}"
        found = list(_proved("low_friction", explanation, slippery, at_limit, USUAL_LOAD))
        if found:
            yield from found
            return


def _proved(
    name: str, explanation: str, case: HandCase, at_limit: Array, share: float
) -> Iterator[HandControl]:
    """Yield a control if the proof leaves no doubt that it cannot hold a share of a wrench."""
    proof = case.limit(to_digits(share * at_limit))
    if proof.upper <= 1.0 - EXCESS:
        yield HandControl(name, explanation, case.friction, case.motors.limits, share, proof)


@declared
class HandControlVerdict(Declared):
    """How a negative control of a hand ended in simulation."""

    control: Annotated[HandControl, FLAT]
    hold: Annotated[HoldVerdict, FLAT]

    @computed_field
    @property
    def let_go(self) -> bool:
        """Whether the object moved, as it must."""
        return self.hold.outcome in LET_GO


def try_hand_control(
    scene: HandScene, control: HandControl, load_at_limit: TrialLoad, setup: Setup
) -> HandControlVerdict:
    """Hold what a control must let go of, after the high friction of the grasp itself."""
    weak = scene.limited(control.limits, control.friction)
    high = setup.hold.settling_friction * scene.layout.friction
    rig = closed_on(weak, setup, control.friction, high)
    (trace,) = rig.traced(rig.holds([part(rig.idle, load_at_limit, control.share)], [high]))
    return HandControlVerdict(control, judge(trace, scene.layout, setup.hold))
