"""Executes grasps with a hand that stands in them, in simulation.

The trials are those of `execute` on chains of joints with servos. The squeeze is the best one for
fingertips on the springs that the servos amount to, within the torques of the motors (see
`scenes.mujoco.hand_scenes`). Servos are told its torques once, and nothing is replanned. Palm and
links touch the object where it comes to them.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from grasp_core.allowed_values import instance
from grasp_core.errors import InputError, NoForcesError
from grasp_core.execution.grips import Grip, unsqueezed
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_grips import hand_grip
from grasp_core.hands.reach import HandReach
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from scenes.mujoco.hand_scenes import (
    finger_springs,
    has_pads,
    held_hand_scene,
    servo_stiffness,
    strong_motors,
    unchosen_squeezes,
)
from scenes.mujoco.held_scene import HeldScene
from sim_validate.execution.execute import execution_of, result_of
from sim_validate.execution.holders import Holder
from sim_validate.execution.verdict import ExecutedGrasp, Execution
from sim_validate.hands.validate import MOST_PUSH_N, closed_stance
from sim_validate.settings import ExecutionSettings


def execute_hand(
    hand: Hand,
    body: Polyhedron,
    reach: HandReach,
    friction: float,
    settings: ExecutionSettings | None = None,
    *,
    threads: int = 1,
    enough: bool = True,
) -> Execution:
    """Simulate a grasp as a hand would execute it, and predict the outcome.

    Args:
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`). Fingertips
            are pads where joints follow others or a finger cannot give in all directions.
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
        friction: Coulomb coefficient at every contact.
        settings: Mass, stiffness, trials and thresholds; None for those of
            `hand_execution_settings`, with the mass of water. The stiffness sets that of the
            servos, and fingertips are those of the hand.
        threads: Number of the simulator's threads; results do not depend on it.
        enough: Whether to find the push within the motors' torques that would be enough where the
            object is lost or has no squeeze (see `Execution.enough`), which takes up to a second.

    Raises:
        InputError: Hand, object and pose do not belong together, or a number is out of range.
        NoForcesError: No squeeze within the motors' torques carries the weight, or the grip is
            unstable under the best one.
        UnfaithfulError: The simulator fails on a case with a known answer.
    """
    check_body(body)
    asked = hand_execution_settings() if settings is None else settings
    instance(asked, ExecutionSettings, "settings")
    holder = HandHolder(body, hand, reach, friction)
    return execution_of(holder, asked.for_body(body), threads=threads, enough=enough)


def hand_execution_settings(
    mass_kg: float | None = None, density_kg_m3: float | None = None
) -> ExecutionSettings:
    """Return the usual settings for hands, in which motors alone limit how hard fingers push.

    Args:
        mass_kg: Mass of the object [kg]; None for that of its density.
        density_kg_m3: Density of the object [kg/m^3]; None for that of water.
    """
    # a hand's fingers are as they are, however small the object is
    return ExecutionSettings(
        mass_kg=mass_kg, density_kg_m3=density_kg_m3, push_n=MOST_PUSH_N, keep_defaults=True
    )


@dataclass(frozen=True, slots=True, eq=False)
class HandHolder(Holder):
    """A hand that stands in a grasp, and holds the object by its motors."""

    hand: Hand
    reach: HandReach
    friction: float

    def loose(self, settings: ExecutionSettings) -> tuple[Grip, Motors]:
        """Return the contacts before they are squeezed, and the motors behind them."""
        hand, reach = self.hand, self.reach
        stance = closed_stance(hand, reach, self.friction)
        motors, spring = strong_motors(hand, reach), settings.tip_stiffness_n_per_m
        pads = has_pads(hand, motors)
        points = np.array([contact.position for contact in stance.contacts])
        if pads and (missing := unchosen_squeezes(motors, points)):
            raise InputError(
                f"hand must be able to choose how it squeezes, but the motors of {hand.name} leave "
                f"{missing} of the squeezes at these contacts to chance, as joints that move "
                "together press as one; use a hand with more motors, or fewer contacts"
            )
        loose = unsqueezed(
            self.body, stance.contacts, self.friction, tip_radius_m=stance.tip_radii,
            stiffness=finger_springs(motors, spring, pads=pads),
        )  # fmt: skip
        servo, give = servo_stiffness(motors, spring), 1.0 / spring if pads else 0.0
        return hand_grip(hand, stance, loose, servo, give), motors

    def scene(self, settings: ExecutionSettings, best: BestSqueeze) -> HeldScene:
        """Build the scene in which a squeeze is executed."""
        near = self.reach_m(settings, best.grip)
        return held_hand_scene(self.hand, self.body, self.reach, best.grip, settings, near)


def executed_by_hand(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, settings: ExecutionSettings,
    *, enough: bool = True,
) -> ExecutedGrasp:  # fmt: skip
    """Execute one grasp with a hand; a grasp that cannot be executed is a result with a reason."""
    execution = partial(execute_hand, hand, body, reach, friction, settings, enough=enough)
    contacts = reach.contacts or ()
    return result_of(reach.grasp, "", contacts, execution, (InputError, NoForcesError))
