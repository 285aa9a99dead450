"""Finds where a hand stands in a grasp, what it carries there, and what it does in simulation.

The command `reach` and datasets ask the same of each grasp. Only a hand whose joints have torque
limits is simulated.
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import partial

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError, SolverError
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import hand_payload
from grasp_core.hands.reach import HandReach, reach_with
from grasp_core.hands.settings import ReachSettings
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.engine.setup import Agenda
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.hands.execute import executed_by_hand, hand_execution_settings
from sim_validate.hands.reaches import CarriedMass, ReachedGrasp
from sim_validate.hands.torques import too_weak
from sim_validate.hands.validate import MOST_PUSH_N, validate_hand
from sim_validate.hands.verdict import HandVerdict
from sim_validate.settings import ExecutionSettings, HandTrials

HAND_AGENDA = Agenda(critical_friction=False)
"""What hands are tested with."""


@dataclass(frozen=True, slots=True)
class HandTask:
    """What is asked of a hand in each grasp."""

    pose: ReachSettings
    simulate: bool = False
    """Whether it holds test wrenches, and negative controls are tried."""
    execution: ExecutionSettings | None = None
    """How it executes the grasp; None where it does not."""
    enough: bool = True
    """Whether an execution that loses the object finds the push that would be enough."""


def reached_grasp(
    hand: Hand, body: Polyhedron, grasp: Grasp, friction: float, task: HandTask
) -> ReachedGrasp:
    """Look for a pose in a grasp; there hold test wrenches and execute the grasp, if asked to."""
    reach = reach_with(hand, body, grasp, friction, task.pose)
    found = partial(ReachedGrasp, reach, contacts_sha256(grasp.contacts))
    if not reach.reached:
        return found()
    held: HandVerdict | None = None
    executed: ExecutedGrasp | None = None
    if task.simulate:
        held = validate_hand(hand, body, reach, friction, agenda=HAND_AGENDA)
    if task.execution is not None:
        executed = executed_by_hand(hand, body, reach, friction, task.execution, enough=task.enough)
    weak = too_weak(hand, body, reach, friction, executed, task.execution)
    return found(carried(hand, body, reach, friction), held, executed, weak)


def carried(hand: Hand, body: Polyhedron, reach: HandReach, friction: float) -> CarriedMass | None:
    """Find the mass held in any orientation; None if the hand is not known well enough or weak."""
    with suppress(InputError, SolverError):  # a figure beside the pose, which is there without it
        found = hand_payload(hand, body, reach, friction, max_push_n=MOST_PUSH_N)
        return CarriedMass(found.lower, found.upper, found.weakest)
    return None


def execution_with(trials: HandTrials, body: Polyhedron) -> ExecutionSettings | None:
    """Return how a hand executes grasps of an object; None where it does not."""
    if trials.mass_kg is None and trials.density_kg_m3 is None:
        return None
    return hand_execution_settings(trials.mass_kg, trials.density_kg_m3).for_body(body)


def with_motors(hand: Hand, trials: HandTrials, source: str, *, flags: bool) -> Hand:
    """Return the hand with the torque limits that are given, strong enough for what is asked.

    Messages name settings as they are, or as flags.
    """

    def called(name: str) -> str:
        return f"--{name.replace('_', '-')}" if flags else name

    if trials.torque_limit_n_m is not None:
        hand = hand.with_torque_limits(trials.torque_limit_n_m, source)
    if trials.needs_motors:
        asked = called(trials.needs_motors)
        missing = [joint.name for joint in hand.free_joints if joint.torque_limit_n_m is None]
        if missing:
            raise InputError(
                f"{asked} needs a torque limit for each joint, but {hand.name} has none for "
                f"{missing[0]}; give one for all joints with {called('torque_limit_n_m')}, or each "
                "in the hand's file (actuatorfrcrange of its joint)"
            )
    return hand
