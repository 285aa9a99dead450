"""Executes grasps with a hand: the trials of `execute` on real chains of joints with servos.

The squeeze is the best one for fingertips on the springs that the servos amount to, within the
torques of the motors (see `scenes.mujoco.held_hand`). Servos are told its torques once, and nothing
is replanned. Palm and links touch the object where it comes to them.
"""

from dataclasses import dataclass
from functools import partial

from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError, NoForcesError
from grasp_core.execution.best_squeeze import searched
from grasp_core.execution.grips import unsqueezed
from grasp_core.execution.loads import LoadSet, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import hand_grip
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.held_hand import finger_springs, held_hand_scene, servo_stiffness, strong_motors
from scenes.mujoco.held_mjcf import HeldScene
from sim_validate.execution.execute import asked_settings, execution_of, result_of, surface_reach
from sim_validate.execution.verdict import ExecutedGrasp, Execution
from sim_validate.hands.validate_hand import MOST_PUSH_N
from sim_validate.settings import ExecutionSettings


def execute_hand(
    hand: Hand,
    body: Polyhedron,
    reach: HandReach,
    friction: float,
    settings: ExecutionSettings | None = None,
    *,
    mass_kg: float | None = None,
    threads: int = 1,
    enough: bool = True,
) -> Execution:
    """Simulate a grasp as a hand would execute it, and predict the outcome.

    Args:
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`), whose
            fingers have at least three joints.
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
        friction: Coulomb coefficient at every contact.
        settings: Mass, stiffness, trials and thresholds; None for those of
            `hand_execution_settings`. The stiffness sets that of the servos, and fingertips are
            those of the hand.
        mass_kg: Mass of the object, in place of that of the settings [kg].
        threads: Number of the simulator's threads; results do not depend on it.
        enough: Whether to find the push within the motors' torques that would be enough where the
            object is lost or has no squeeze (see `Execution.enough`), which takes up to a second.

    Raises:
        InputError: Hand, object and pose do not belong together, a finger cannot give in all
            directions, or a number is out of range.
        NoForcesError: No squeeze within the motors' torques carries the weight, or the grip is
            unstable under the best one.
        UnfaithfulError: The simulator fails on a case with a known answer.
    """
    settings = asked_settings("execute_hand", settings, mass_kg, hand_execution_settings)
    holder = HandHolder(hand, body, reach, friction)
    return execution_of(holder, settings.for_body(body), threads=threads, enough=enough)


def hand_execution_settings(mass_kg: float) -> ExecutionSettings:
    """Return the usual settings for hands, in which motors alone limit how hard fingers push."""
    return ExecutionSettings(mass_kg=mass_kg, push_n=MOST_PUSH_N)


@dataclass(frozen=True, slots=True, eq=False)
class HandHolder:
    """A hand that stands in a grasp, and holds the object by its motors (see `Holder`)."""

    hand: Hand
    body: Polyhedron
    reach: HandReach
    friction: float

    def squeeze(self, settings: ExecutionSettings, loads: LoadSet | None = None) -> BestSqueeze:
        """Choose the squeeze that carries most, or needs least push for loads, by its torques."""
        hand, body, reach = self.hand, self.body, self.reach
        check_body(body)
        stance, spring = stance_of(hand, reach), settings.tip_stiffness_n_per_m
        if not force_closure(stance.contacts, friction=self.friction).closed:
            raise InputError(
                f"the contacts of {reach.grasp} are not in force closure at friction "
                f"{self.friction}"
            )
        motors = strong_motors(hand, reach)
        loose = unsqueezed(
            body, stance.contacts, self.friction, tip_radius_m=stance.tip_radii,
            stiffness=finger_springs(motors, spring),
        )  # fmt: skip
        start = hand_grip(hand, stance, loose, servo_stiffness(motors, spring))
        most = settings.push_n if loads is None else None
        best = searched(start, loads or any_direction(settings.object_kg), most, motors)
        if best.scale == 0.0:
            raise NoForcesError(
                "no squeeze within the motors' torques carries any part of the weight in every "
                "direction; use stronger motors, another pose, or more friction"
            )
        return best

    def scene(self, settings: ExecutionSettings, best: BestSqueeze) -> HeldScene:
        """Build the scene in which a squeeze is executed."""
        near = surface_reach(self.body, best.grip, settings)
        return held_hand_scene(self.hand, self.body, self.reach, best.grip, settings, near)


def executed_by_hand(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, settings: ExecutionSettings
) -> ExecutedGrasp:
    """Execute one grasp with a hand; a grasp that cannot be executed is a result with a reason."""
    execution = partial(execute_hand, hand, body, reach, friction, settings)
    refused = (InputError, NoForcesError)
    return result_of(reach.grasp, "", reach.contacts or (), execution, refused)
