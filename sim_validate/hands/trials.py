"""Tests a hand that stands in a grasp, and executes the grasp with it, in simulation.

For each test wrench the analysis predicts the largest multiple that contacts and motors resist. A
share of it is applied in simulation to a hand with its real chains of links, whose servos are told
the joint torques of the planned contact forces and are limited as the motors are. On request the
limits are found in simulation too.

A negative control is the same hand with motors, friction or load changed so that it provably lets
go. It changes one thing about the weakest wrench that a grasp is tested with, and carries the proof
that the hand cannot hold it then: the upper bound of the wrench's limit (`WrenchLimit`) is below
what is applied, by `EXCESS` at least. Its servos are told what would hold the load if nothing had
been changed, and the proof says that no other commands would do better.

The simulator is checked on a hand with known answers before any hand is simulated. Four fingers
with one hinge each hold a cube. Each hinge stands straight above its contact, at the height l, so
that a torque tau presses with tau / l along the inward normal, and no force across it loads the
hinge. With torque limits c, the cube of half-width a, and the friction mu, the hand resists

    across the plane of the contacts     4 mu c / l,
    about that axis                      4 mu a c / l,
    against one finger                   (1 + 2 mu) c / l:                              (1)

the finger in front presses with all it has, and two of the others rub. On slippery contacts only
the two fingers along a load oppose it, by their servos of stiffness k:

    displacement = F / (2 k / l^2).                                                     (2)

Executions are the trials of `execute` on the same chains of joints with servos. The squeeze is the
best one for fingertips on the springs that the servos amount to, within the torques of the motors
(see `scenes.mujoco.hand_scenes`). Servos are told its torques once, and nothing is replanned. Palm
and links touch the object where it comes to them.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated

import numpy as np
from pydantic import Field, computed_field

from grasp_core.arrays import Array, Shape, rounded, to_digits
from grasp_core.by_value import summary
from grasp_core.closure.force_closure import force_closure
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, NoForcesError
from grasp_core.execution.grips import Grip, unsqueezed
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.figures import Shown
from grasp_core.files.records import UNRECORDED
from grasp_core.hands.hand import Fingertip, Hand, HandFinger, Joint, Link
from grasp_core.hands.hand_motors import hand_grip
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.kinds import FLAT, SMALLEST, Friction, Quantity, instance
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limits import WrenchLimit, limit_of
from scenes.example_objects import example_object
from scenes.mujoco.hand_scenes import (
    HandScene,
    build_hand_scene,
    finger_springs,
    hand_physics,
    held_hand_scene,
    servo_stiffness,
    strong_motors,
)
from scenes.mujoco.held_scene import HeldScene
from scenes.settings import FingerSettings
from sim_validate.closure.validate import held_wrenches
from sim_validate.closure.verdict import HoldsWrenches, WrenchVerdict
from sim_validate.engine.gate import ClosureCase
from sim_validate.engine.known_cases import GateCheck, checked, two_digits
from sim_validate.engine.planned_loads import LoadPlanner, PlannedLoad
from sim_validate.engine.rig import closed_on, squeezed
from sim_validate.engine.schedules import TrialLoad, part
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.engine.simulated_limits import ramped_limits
from sim_validate.engine.stepping import Bench
from sim_validate.engine.traces import LET_GO, HoldVerdict, judge
from sim_validate.execution.execute import asked_settings, execution_of, result_of
from sim_validate.execution.predictions import Holder
from sim_validate.execution.verdict import ExecutedGrasp, Execution
from sim_validate.settings import ExecutionSettings

MOST_PUSH_N = 100.0
"""Largest normal force of a fingertip unless stated [N]: more than hands' motors give."""

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
    told = f"the load is {OVERLOAD:g} times the predicted limit"
    found = list(_proved("overloaded", told, case, at_limit, OVERLOAD))
    weak = WEAK_MOTORS * case.motors.limits
    if (np.abs(case.motors.gravity) < weak).all():
        motors = replace(case.motors, limits=weak)
        told = f"every motor has {WEAK_MOTORS:g} of the torque that the load needs"
        found += _proved("weak_motors", told, replace(case, motors=motors), at_limit, 1.0)
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
        told = f"the motor of {names[joint]} is dead"
        yield from _proved("dead_motor", told, dead, at_limit, USUAL_LOAD)


def _low_friction(case: HandCase, at_limit: Array) -> Iterator[HandControl]:
    for share in FRICTIONS:
        slippery = replace(case, friction=rounded(share * case.friction))
        told = f"the friction is {slippery.friction:.3g} instead of {case.friction:.3g}"
        found = list(_proved("low_friction", told, slippery, at_limit, USUAL_LOAD))
        if found:
            yield from found
            return


def _proved(
    name: str, told: str, case: HandCase, at_limit: Array, share: float
) -> Iterator[HandControl]:
    """Yield a control if the proof leaves no doubt that it cannot hold a share of a wrench."""
    proof = case.limit(to_digits(share * at_limit))
    if proof.upper <= 1.0 - EXCESS:
        yield HandControl(name, told, case.friction, case.motors.limits, share, proof)


HALF, HEIGHT, TIP, TORQUE = 0.03, 0.08, 0.01, 0.35
"""Half-width of the cube, height of the hinges over the contacts, radius of the fingertips [m], and
torque limit [N m]: those of a hand that people use."""
LIMIT = (0.996, 1.006)
"""Interval of simulated over exact limits."""
SOFTER = (0.99, 1.01)
"""Interval of simulated over exact displacements."""
SLIPPERY = 1e-4
"""Friction of the contacts that slide."""
SETTLE_S = 0.5
"""Time in which the slippery cube comes to rest: five times what others are given [s]."""
GENTLE = 0.1
"""Load of the slippery cube, over what one finger presses with."""
OUTWARD = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -0.0, -0.0], [-0.0, -1.0, -0.0]])
"""Outward normals at the contacts, (4, 3)."""


@dataclass(frozen=True, slots=True)
class KnownHand:
    """The settings and the friction with which the simulator is checked on the known hand."""

    setup: Setup
    friction: float

    def checks(self) -> tuple[GateCheck, ...]:
        """Measure what it resists, and how far it gives way, over the exact figures."""
        body, reach, setup = cube(), stance(self.friction), self.setup
        scene = build_hand_scene(hinged_hand(), body, reach, self.friction, physics=setup.physics)
        return (*_limits(scene, body, reach, setup), _displaced(scene, setup))


def require_faithful_hands(setup: Setup, friction: float) -> tuple[GateCheck, ...]:
    """Check the simulator on the known hand, and refuse settings under which a check fails."""
    plain = replace(setup, threads=1, timeout_s=math.inf)
    return checked(KnownHand(plain, two_digits(friction))).checks


def cube() -> Polyhedron:
    """Return the cube that the known hand holds."""
    box = example_object("box")
    vertices = box.vertices - box.center_of_mass
    return Polyhedron.from_mesh(
        HALF * vertices / np.abs(vertices).max(axis=0), box.triangles, name="cube"
    )


def hinged_hand() -> Hand:
    """Return the hand with one hinge a finger."""
    fingers = list[HandFinger]()
    for number, out in enumerate(OUTWARD):
        axis, place = np.cross(np.eye(3)[2], out), HALF * out + np.array([0.0, 0.0, HEIGHT])
        hinge = Joint(f"hinge{number}", place, np.eye(3), axis, -1.0, 1.0, TORQUE)
        tip = Fingertip(TIP * out + np.array([0.0, 0.0, -HEIGHT]), TIP)
        link = Link(f"link{number}", hinge, (), None, None)
        fingers.append(HandFinger(f"finger{number}", (link,), tip))
    return Hand("known hand", (), tuple(fingers))


def stance(friction: float) -> HandReach:
    """Return the pose in which it holds the cube, with its proof at a friction."""
    proof = force_closure(HALF * OUTWARD, -OUTWARD, friction)
    return HandReach(
        "known hand", "cube", "", "", 1, 0.0, np.arange(4), np.zeros(4), np.eye(4), proof
    )


def _limits(
    scene: HandScene, body: Polyhedron, reach: HandReach, setup: Setup
) -> tuple[GateCheck, ...]:
    friction, press = scene.layout.friction, TORQUE / HEIGHT
    exact = {
        "across the contacts": (np.eye(6)[2], 4.0 * friction * press),
        "about the axis across them": (np.eye(6)[5], 4.0 * friction * HALF * press),
        "against one finger": (np.eye(6)[0], (1.0 + 2.0 * friction) * press),
    }
    rig = closed_on(scene, setup, friction)
    resisted = LoadPlanner(body, reach.contacts or (), friction, setup, scene.hand.motors).resisted
    loads = [
        TrialLoad(size * wrench, limit_of(resisted, wrench).forces)
        for wrench, size in exact.values()
    ]
    found = ramped_limits(rig, loads)
    return tuple(
        GateCheck(
            f"limit of motors {name}, over the exact one", math.nan if at is None else at.share,
            *LIMIT,
        )
        for name, at in zip(exact, found, strict=True)
    )  # fmt: skip


def _displaced(scene: HandScene, setup: Setup) -> GateCheck:
    smooth = scene.limited(scene.hand.motors.limits, SLIPPERY)
    layout = smooth.layout
    # without the grasp's own friction forces, which slippery contacts do not carry
    forces = np.einsum("kij,kj->ki", layout.frames * np.array([1.0, 0.0, 0.0]), layout.squeeze)
    patient = replace(setup, hold=replace(setup.hold, settle_s=SETTLE_S))
    rig = squeezed(Bench(smooth), patient, forces, SLIPPERY)
    size = GENTLE * TORQUE / HEIGHT
    (poses,) = rig.joints(rig.holds([TrialLoad(size * np.eye(6)[0], forces)]))
    exact = size * HEIGHT**2 / (2.0 * smooth.hand.servo)
    return GateCheck(
        "displacement by the servos, over the exact one", float(poses[-1, 0]) / exact, *SOFTER
    )


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


@declared
class HandVerdict(HoldsWrenches):
    """The result of simulating a hand in a grasp: what it held, and whether that was predicted."""

    hand: str
    """Name of the hand."""
    grasp: Annotated[str, Field(alias="id"), Shown("grasp")]
    """Id of the grasp."""
    friction: Friction
    radius_m: Quantity
    """Radius of the object, over which torques count in the size of a wrench."""
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[HandControlVerdict, ...]
    setup: Setup
    agenda: Agenda
    checks: Annotated[tuple[GateCheck, ...], UNRECORDED] = field(default=(), compare=False)
    """Cases with known answers on which the simulator was checked first."""
    scene: Annotated[HandScene | None, UNRECORDED] = field(default=None, compare=False)
    """The scene that was simulated; None if the verdict was read from a file."""

    def _check_together(self) -> None:
        if WEAKEST not in {trial.name for trial in self.wrenches}:
            raise InputError(f"wrenches must have one that is named {WEAKEST!r}, got none")

    @computed_field
    @property
    def weakest_n(self) -> Annotated[float, Shown("weakest wrench N", ".3g")]:
        """Size of the weakest wrench that was found, at its predicted limit, torques over radius.

        It is what contacts and motors resist by the analysis.
        """
        return self._largest_n(self.radius_m)

    @computed_field
    @property
    def held(self) -> Annotated[bool, Shown("held")]:
        """Whether every wrench held, at 80 % of what contacts and motors resist by the analysis."""
        return not self.failures

    @computed_field
    @property
    def not_held(self) -> Annotated[tuple[str, ...], Shown("not held")]:
        """Names of the wrenches that were not held."""
        return tuple(trial.name for trial in self.failures)

    @computed_field
    @property
    def controls_let_go(self) -> Annotated[bool, Shown("controls let go")]:
        """Whether every negative control let go of the object, as it must."""
        return all(control.let_go for control in self.controls)

    @computed_field
    @property
    def mismatches(self) -> tuple[str, ...]:
        """Where simulation contradicts the analysis, one sentence each."""
        return tuple(self._contradictions())

    @computed_field
    @property
    def good(self) -> bool:
        """Whether wrenches held, controls let go, and nothing was contradicted."""
        return self.held and self.controls_let_go and not self.mismatches

    def __repr__(self) -> str:
        told = "held" if self.held else f"{len(self.failures)} of {len(self.wrenches)} not held"
        return summary("HandVerdict", self.hand, self.grasp, told)


def hand_setup() -> Setup:
    """Return the usual setup for hands: harder contacts, and fingertips as strong as motors."""
    fingers = FingerSettings(max_normal_force_n=MOST_PUSH_N)
    return Setup(fingers=fingers, physics=hand_physics())


def validate_hand(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float = 0.5, *,
    down: tuple[float, float, float] | None = None,
    agenda: Agenda | None = None, setup: Setup | None = None,
) -> HandVerdict:  # fmt: skip
    """Test a hand that stands in a grasp, and its negative controls, in simulation.

    Args:
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`).
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
    scene = build_hand_scene(hand, body, reach, friction, down=down, physics=setup.physics)
    contacts = stance_of(hand, reach).contacts
    if not force_closure(contacts, friction=friction).closed:
        raise InputError(f"the contacts of {reach.grasp} are not in force closure at {friction}")
    gate = checked(ClosureCase.of(setup, friction, body.radius))
    checks = (*gate.checks, *require_faithful_hands(setup, friction))
    layout, high = scene.layout, setup.hold.settling_friction * friction
    rig = closed_on(scene, setup, layout.friction, high)
    case = HandCase(body, contacts, layout.friction, setup, scene.hand.motors)
    loads = case.planned(rig.idle, agenda)
    wrenches, tried = held_wrenches(rig, loads, agenda), tuple[HandControlVerdict, ...]()
    if agenda.controls:
        weakest = next(planned for planned in loads if planned.name == WEAKEST)
        names = tuple(joint.name for joint in scene.hand.hand.joints)
        tried = tuple(
            HandControlVerdict(control, _held(scene, setup, high, control, weakest.limit))
            for control in hand_controls(case, weakest, names)
        )
    return HandVerdict(
        hand.name, reach.grasp, friction, layout.radius_m, wrenches, tried, setup, agenda, checks,
        scene,
    )  # fmt: skip


def _held(
    scene: HandScene, setup: Setup, high: float, control: HandControl, limit: TrialLoad
) -> HoldVerdict:
    """Hold what a control must let go of, after the high friction of the grasp itself."""
    weak = scene.limited(control.limits, control.friction)
    rig = closed_on(weak, setup, weak.layout.friction, high)
    (trace,) = rig.traced(rig.holds([part(rig.idle, limit, control.share)], [high]))
    return judge(trace, scene.layout, setup.hold)


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
    holder = HandHolder(body, hand, reach, friction)
    return execution_of(holder, settings.for_body(body), threads=threads, enough=enough)


def hand_execution_settings(mass_kg: float) -> ExecutionSettings:
    """Return the usual settings for hands, in which motors alone limit how hard fingers push."""
    # a hand's fingers are as they are, however small the object is
    return ExecutionSettings(mass_kg=mass_kg, push_n=MOST_PUSH_N, keep_defaults=True)


@dataclass(frozen=True, slots=True, eq=False)
class HandHolder(Holder):
    """A hand that stands in a grasp, and holds the object by its motors."""

    hand: Hand
    reach: HandReach
    friction: float

    def loose(self, settings: ExecutionSettings) -> tuple[Grip, Motors]:
        """Return the contacts before they are squeezed, and the motors behind them."""
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
        return hand_grip(hand, stance, loose, servo_stiffness(motors, spring)), motors

    def scene(self, settings: ExecutionSettings, best: BestSqueeze) -> HeldScene:
        """Build the scene in which a squeeze is executed."""
        near = self.reach_m(settings, best.grip)
        return held_hand_scene(self.hand, self.body, self.reach, best.grip, settings, near)


def executed_by_hand(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, settings: ExecutionSettings
) -> ExecutedGrasp:
    """Execute one grasp with a hand; a grasp that cannot be executed is a result with a reason."""
    execution = partial(execute_hand, hand, body, reach, friction, settings)
    contacts = reach.contacts or ()
    return result_of(reach.grasp, "", contacts, execution, (InputError, NoForcesError))
