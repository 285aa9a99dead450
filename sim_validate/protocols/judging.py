"""Judges grasps and hands in grasps by published tests: their verdict, ours, and the prediction.

Their verdict is that of the test as it is published, with its own friction, mass and contacts. The
prediction and our verdict are about the grasp at its own friction: the loads of the test are
applied in our closure trials, where forces are planned, contacts obey Coulomb's law to a per mille,
and thresholds are micrometres. Contacts that are not in force closure need no trial: it is proved
that they let go of some load.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np

from grasp_core.arrays import Array
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.kinds import Friction, instance, one_of, value_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.hand_scene import build_hand_scene
from scenes.mujoco.tested import (
    HandServos,
    TestedScene,
    fingertip_scene,
    hand_scene,
    planned_postures,
)
from sim_validate.engine.gate import require_faithful
from sim_validate.engine.rig import Analysis, closed_on
from sim_validate.engine.setup import Setup
from sim_validate.engine.traces import Outcome, judge
from sim_validate.execution.execute import given_contacts
from sim_validate.hands.dexgraspbench import RecordedReach, hand_file, recorded_postures
from sim_validate.hands.trials import hand_setup, require_faithful_hands
from sim_validate.protocols.published import PROTOCOLS, PublishedProtocol
from sim_validate.protocols.runs import their_verdict
from sim_validate.protocols.verdict import Judgement, OurVerdict


def judge_by(
    protocol: str | PublishedProtocol,
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: float = 0.5,
    *,
    setup: Setup | None = None,
) -> Judgement:
    """Judge a grasp by four fingertips, or contacts of any origin, by a published test.

    Args:
        protocol: The test, or its name (see `protocol_names`).
        body: The object.
        grasp: A grasp, or contacts, at least two.
        friction: Coulomb coefficient of our verdict and of the prediction.
        setup: How our trials are simulated, and the largest normal force of fingertips, which the
            test squeezes with too; None for the usual ones.

    Returns:
        Their verdict, ours, and the predicted margin.

    Raises:
        InputError: A number is out of range, contacts are not on the object, or no test has the
            name.
    """
    found = _protocol(protocol)
    check_body(body)
    value_of(Friction, friction, "friction")
    setup = Setup() if setup is None else instance(setup, Setup, "setup")
    contacts = given_contacts(body, grasp)
    given = grasp if isinstance(grasp, Grasp) else contacts
    require_faithful(setup, friction, body.radius)
    scene = fingertip_scene(
        body, given, found.friction, found.mass_of(body), found.physics, setup.fingers
    )
    ours = our_verdict(
        Analysis(body, contacts, friction, setup, None), found.forces(scene.mass_kg),
        partial(setup.scene, body, given, friction),
    )  # fmt: skip
    return _judged(
        found, scene, friction, setup, ours, given.id if isinstance(given, Grasp) else ""
    )


def judge_hand_by(
    protocol: str | PublishedProtocol,
    hand: Hand,
    body: Polyhedron,
    reach: HandReach,
    friction: float = 0.5,
    *,
    setup: Setup | None = None,
) -> Judgement:
    """Judge a hand that stands in a grasp by a published test.

    A pose of `reach_of_record` is judged as its record says, with its own way in and its own
    squeeze, whether or not its contacts are in force closure; motors have no limits in their test,
    as there. Any other pose squeezes with 0.6 of what its motors can.

    Args:
        protocol: The test, or its name (see `protocol_names`).
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`).
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with` and `reach_of_record`).
        friction: Coulomb coefficient of our verdict and of the prediction.
        setup: How our trials are simulated; None for that of `hand_setup`.

    Returns:
        Their verdict, ours, and the predicted margin.

    Raises:
        InputError: Hand, object and pose do not belong together, a number is out of range, or no
            test has the name.
    """
    found = _protocol(protocol)
    instance(hand, Hand, "hand", "load_hand makes one")
    check_body(body)
    value_of(Friction, friction, "friction")
    setup = hand_setup() if setup is None else instance(setup, Setup, "setup")
    file = hand_file(hand)
    stiffness = file.servo_n_m_per_rad if found.own_servos else None
    servos = HandServos(
        found.servo_n_m_per_rad if stiffness is None else stiffness,
        file.damping_n_m_s_per_rad, found.weld, file.root, file.inertials,
    )  # fmt: skip
    if isinstance(reach, RecordedReach):
        postures = recorded_postures(reach, hand, servos.stiffness_n_m_per_rad)
    else:
        postures = planned_postures(hand, body, reach, found.friction, servos.stiffness_n_m_per_rad)
    scene = hand_scene(
        hand, body, postures, found.friction, found.mass_of(body), found.physics, servos
    )
    ours = _ours(hand, body, reach, friction, found.forces(scene.mass_kg), setup)
    return _judged(found, scene, friction, setup, ours, reach.grasp, hand.name)


def _judged(
    protocol: PublishedProtocol, scene: TestedScene, friction: float, setup: Setup,
    ours: OurVerdict, grasp: str, hand: str = "",
) -> Judgement:  # fmt: skip
    """Run the test, and put its verdict beside ours."""
    runs = their_verdict(protocol, scene, setup.threads)
    push_n = float(scene.pushes_n.max(initial=0.0))
    return Judgement(grasp, protocol.name, friction, scene.mass_kg, push_n, runs, ours, hand)


def _ours(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, forces: tuple[Array, ...],
    setup: Setup,
) -> OurVerdict:  # fmt: skip
    """Judge a hand by our trials; contacts that were proved open need none."""
    if isinstance(reach, RecordedReach) and not reach.reached:
        return OurVerdict(False, False, 0.0, reach.explanation)
    require_faithful(setup, friction, body.radius)
    require_faithful_hands(setup, friction)
    held = build_hand_scene(hand, body, reach, friction, physics=setup.physics)
    contacts = stance_of(hand, reach).contacts
    analysis = Analysis(body, contacts, friction, setup, held.layout.motors)
    return our_verdict(analysis, forces, lambda: held)


def _protocol(given: str | PublishedProtocol) -> PublishedProtocol:
    if isinstance(given, PublishedProtocol):
        return given
    one_of(given, PROTOCOLS, "protocol")
    return PROTOCOLS[given]


def our_verdict(
    analysis: Analysis, forces: Sequence[Array], scene: Callable[[], Scene]
) -> OurVerdict:
    """Predict the least multiple of forces [N] that contacts resist, and hold the forces."""
    setup, friction = analysis.setup, analysis.friction
    if not setup.closure(analysis.contacts, friction).closed:
        told = f"the contacts are proved not to be in force closure at friction {friction:g}"
        return OurVerdict(False, False, 0.0, told)
    rig = closed_on(scene(), setup, friction)
    named = [
        (" ".join(f"{part:.3g}" for part in force.tolist()) + " N",
         np.concatenate([force, np.zeros(3)]))
        for force in forces
    ]  # fmt: skip
    loads = analysis.as_they_are(rig.idle, named)
    margin = min((load.predicted_limit for load in loads), default=math.inf)
    held = [load.load for load in loads] or [rig.idle]
    names = [load.name for load in loads] or ["no load"]
    for name, trace in zip(names, rig.hold(held), strict=True):
        found = judge(trace, rig.bench.scene.layout, setup.hold)
        if found.outcome is not Outcome.HELD:
            return OurVerdict(True, False, margin, f"{name}: {found.outcome.value}: {found.reason}")
    return OurVerdict(True, True, margin, "")
