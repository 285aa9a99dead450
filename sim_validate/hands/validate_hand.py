"""Tests a hand that stands in a grasp: from its motors through simulation to a verdict.

For each test wrench the analysis predicts the largest multiple that contacts and motors resist. A
share of it is applied in simulation to a hand with its real chains of links, whose servos are told
the joint torques of the planned contact forces and are limited as the motors are. On request the
limits are found in simulation too. Controls are the same hand with one thing changed that provably
makes it let go.
"""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from grasp_core.checked import instance
from grasp_core.closure.force_closure import force_closure
from grasp_core.declared import Declared, summary
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.files.records import FLAT, UNRECORDED, Key, recorded
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.kinds import Friction, Quantity
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.hand_scene import HandScene, build_hand_scene, hand_physics, limited
from scenes.settings import FingerSettings
from sim_validate.closure.validate import held_wrenches
from sim_validate.closure.verdict import WrenchVerdict
from sim_validate.engine.bench import Load
from sim_validate.engine.gate import Check, require_faithful
from sim_validate.engine.limits import part
from sim_validate.engine.rig import closed_on
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.engine.traces import LET_GO, HoldVerdict, Outcome, judge
from sim_validate.hands.hand_controls import HandCase, HandControl, hand_controls
from sim_validate.hands.hand_gate import require_faithful_hands

MOST_PUSH_N = 100.0
"""Largest normal force of a fingertip in predictions, unless stated [N]: more than hands' motors
give, so that they are what limits."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandControlVerdict(Declared):
    """How a negative control of a hand ended in simulation."""

    control: Annotated[HandControl, FLAT]
    hold: Annotated[HoldVerdict, FLAT]

    @recorded
    def let_go(self) -> bool:
        """Whether the object moved, as it must."""
        return self.hold.outcome in LET_GO


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandVerdict(Declared):
    """The result of simulating a hand in a grasp: what it held, and whether that was predicted."""

    hand: str
    """Name of the hand."""
    grasp: Annotated[str, Key("id"), Shown("grasp")]
    """Id of the grasp."""
    friction: Friction
    radius_m: Quantity
    """Radius of the object, over which torques count in the size of a wrench."""
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[HandControlVerdict, ...]
    setup: Setup
    agenda: Agenda
    checks: Annotated[tuple[Check, ...], UNRECORDED] = field(default=(), compare=False)
    """Cases with known answers on which the simulator was checked first."""
    scene: Annotated[HandScene | None, UNRECORDED] = field(default=None, compare=False)
    """The scene that was simulated; None if the verdict was read from a file."""

    def _check_together(self) -> None:
        if WEAKEST not in {trial.name for trial in self.wrenches}:
            raise InputError(f"wrenches must have one that is named {WEAKEST!r}, got none")

    @property
    def failures(self) -> tuple[WrenchVerdict, ...]:
        """The wrenches that were not held, in order."""
        return tuple(trial for trial in self.wrenches if trial.hold.outcome is not Outcome.HELD)

    @recorded
    def weakest_n(self) -> Annotated[float, Shown("weakest wrench N", ".3g")]:
        """Size of the weakest wrench that was found, at its predicted limit, torques over radius.

        It is what contacts and motors resist by the analysis.
        """
        trial = next(each for each in self.wrenches if each.name == WEAKEST)
        scale = np.array([1.0] * 3 + [self.radius_m] * 3)
        return trial.predicted_limit * float(np.linalg.norm(trial.wrench / scale))

    @recorded
    def held(self) -> Annotated[bool, Shown("held")]:
        """Whether every wrench held, at 80 % of what contacts and motors resist by the analysis."""
        return not self.failures

    @recorded
    def not_held(self) -> Annotated[tuple[str, ...], Shown("not held")]:
        """Names of the wrenches that were not held."""
        return tuple(trial.name for trial in self.failures)

    @recorded
    def controls_let_go(self) -> Annotated[bool, Shown("controls let go")]:
        """Whether every negative control let go of the object, as it must."""
        return all(control.let_go for control in self.controls)

    @recorded
    def mismatches(self) -> tuple[str, ...]:
        """Where simulation contradicts the analysis, one sentence each."""
        found = [trial.contradiction for trial in self.wrenches if trial.contradiction]
        if self.agenda.limits != "none":
            found += [f"{trial.name}: the limit was not found near the predicted one"
                      for trial in self.wrenches if trial.simulated_limit is None]  # fmt: skip
        return tuple(found)

    @recorded
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
    gate = require_faithful(setup, friction, body.radius)
    checks = (*gate.checks, *require_faithful_hands(setup, friction))
    layout, high = scene.layout, setup.hold.settling_friction * friction
    rig = closed_on(scene, setup, layout.friction, high)
    case = HandCase(body, contacts, layout.friction, setup, layout.motors)
    loads = case.planned(rig.idle, agenda)
    wrenches, tried = held_wrenches(rig, loads, agenda), tuple[HandControlVerdict, ...]()
    if agenda.controls:
        weakest = next(planned for planned in loads if planned.name == WEAKEST)
        names = tuple(joint.name for joint in layout.hand.joints)
        tried = tuple(
            HandControlVerdict(control, _held(scene, setup, high, control, weakest.limit))
            for control in hand_controls(case, weakest, names)
        )
    return HandVerdict(
        hand.name, reach.grasp, friction, layout.radius_m, wrenches, tried, setup, agenda, checks,
        scene,
    )  # fmt: skip


def _held(
    scene: HandScene, setup: Setup, high: float, control: HandControl, limit: Load
) -> HoldVerdict:
    """Hold what a control must let go of; high friction first is the grasp's, not the control's."""
    weak = limited(scene, control.limits, control.friction)
    rig = closed_on(weak, setup, weak.layout.friction, high)
    (trace,) = rig.hold([part(rig.idle, limit, control.share)], [high])
    return judge(trace, scene.layout, setup.hold)
