"""Tests a hand that stands in a grasp in simulation, with negative controls.

For each test wrench the analysis predicts the largest multiple that contacts and motors resist. A
share of it is applied in simulation to a hand with its real chains of links, whose servos are told
the joint torques of the planned contact forces and are limited as the motors are. On request the
limits are found in simulation too.
"""

from grasp_core.allowed_values import instance
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, Stance, stance_of
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.hand_scenes import build_hand_scene, hand_physics
from scenes.settings import FingerSettings
from sim_validate.closure.validate import held_wrenches
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.rig import closed_on
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.hands.controls import (
    HandCase,
    HandControlVerdict,
    hand_controls,
    try_hand_control,
)
from sim_validate.hands.known_hand import KnownHand
from sim_validate.hands.verdict import HandVerdict
from sim_validate.settings import USUAL_FRICTION

MOST_PUSH_N = 100.0
"""Largest normal force of a fingertip unless stated [N]: more than hands' motors give."""


def hand_setup() -> Setup:
    """Return the usual setup for hands: harder contacts, and fingertips as strong as motors."""
    fingers = FingerSettings(max_normal_force_n=MOST_PUSH_N)
    return Setup(fingers=fingers, physics=hand_physics())


def validate_hand(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float = USUAL_FRICTION, *,
    down: tuple[float, float, float] | None = None,
    agenda: Agenda | None = None, setup: Setup | None = None,
) -> HandVerdict:  # fmt: skip
    """Test a hand that stands in a grasp, and its negative controls, in simulation.

    Args:
        hand: The hand, with a torque limit for each joint that follows no other
            (`hand.with_torque_limits`).
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
        friction: Coulomb coefficient at every contact.
        down: Direction of gravity in the object's frame, which pulls at the links, (3,); None for
            links without weight. The object's weight is a wrench like any other.
        agenda: Which wrenches to hold, and whether to find limits and to try controls. Its other
            trials are not run for hands.
        setup: How trials are simulated; None for that of `hand_setup`.

    Raises:
        InputError: Hand, object and pose do not belong together, or are not in force closure.
        UnfaithfulError: The simulator fails its checks with these settings.
    """
    agenda = Agenda() if agenda is None else instance(agenda, Agenda, "agenda")
    setup = hand_setup() if setup is None else instance(setup, Setup, "setup")
    setup.physics.require_hard(
        "for a hand", "levers of motors have no column for the torque of a contact"
    )
    contacts = closed_stance(hand, reach, friction).contacts
    scene = build_hand_scene(hand, body, reach, friction, down=down, physics=setup.physics)
    gate = checked(ClosureCase.of(setup, friction, body.radius))
    known = checked(KnownHand.of(setup, friction, coupled=bool(hand.couplings)))
    rig = closed_on(scene, setup, friction, setup.hold.settling_friction * friction)
    case = HandCase(body, contacts, friction, setup, scene.hand.motors)
    loads = case.planned(rig.idle, agenda)
    wrenches = held_wrenches(rig, loads, agenda)
    controls = list[HandControlVerdict]()
    if agenda.controls:
        weakest = next(planned for planned in loads if planned.name == WEAKEST)
        names = tuple(joint.name for joint in hand.free_joints)
        for control in hand_controls(case, weakest, names):
            controls.append(try_hand_control(scene, control, weakest.limit, setup))
    return HandVerdict(
        hand.name, reach.grasp, friction, scene.layout.radius_m, wrenches, tuple(controls), setup,
        agenda, (*gate.checks, *known.checks), scene,
    )  # fmt: skip


def closed_stance(hand: Hand, reach: HandReach, friction: float) -> Stance:
    """Return where a hand stands, at contacts that are proved closed at this friction."""
    stance = stance_of(hand, reach)
    if not force_closure(stance.contacts, friction=friction).closed:
        raise InputError(
            f"the contacts of {reach.grasp} are not in force closure at friction {friction}"
        )
    return stance
