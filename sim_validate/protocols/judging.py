"""Judges grasps and hands in grasps by published tests: their verdict, ours, and the prediction.

Their verdict is that of the test as it is published, with its own friction, mass and contacts. The
prediction and our verdict are about the grasp at its own friction: the loads of the test are
applied in our closure trials, where forces are planned, contacts obey Coulomb's law to a per mille,
and thresholds are micrometres.
"""

from collections.abc import Iterable
from functools import partial

from grasp_core.arrays import Array
from grasp_core.checked import coefficient, instance, one_of, seed_of, several
from grasp_core.closure.contact_arrays import FEWEST
from grasp_core.errors import InputError
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.objects.on_faces import check_body, check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.hands.hand_scene import build_hand_scene
from scenes.tested.fingertip_scene import fingertip_scene
from scenes.tested.hand_scene import HandServos, hand_scene, planned_postures
from sim_validate.hands.hand_gate import require_faithful_hands
from sim_validate.hands.validate_hand import hand_setup
from sim_validate.peer_files.hand_files import hand_file
from sim_validate.peer_files.hand_records import RecordedReach, recorded_postures
from sim_validate.protocols.judgement import Judgement
from sim_validate.protocols.named_protocols import PROTOCOLS
from sim_validate.protocols.our_verdict import OurVerdict, our_verdict
from sim_validate.protocols.published import PublishedProtocol
from sim_validate.protocols.their_verdict import their_verdict
from sim_validate.simulation.gate.gate import require_faithful
from sim_validate.simulation.setup import Setup


def judge_by(
    protocol: str | PublishedProtocol,
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: float = 0.5,
    *,
    setup: Setup | None = None,
    seed: int = 0,
) -> Judgement:
    """Judge a grasp by four fingertips, or contacts of any origin, by a published test.

    Args:
        protocol: The test, or its name (see `protocol_names`).
        body: The object.
        grasp: A grasp, or contacts, at least two.
        friction: Coulomb coefficient of our verdict and of the prediction.
        setup: How our trials are simulated, and the largest normal force of fingertips, which the
            test squeezes with too; None for the usual ones.
        seed: Seed of the noise of tests that have some.

    Returns:
        Their verdict, ours, and the predicted margin.

    Raises:
        InputError: A number is out of range, contacts are not on the object, or no test has the
            name.
    """
    found = _protocol(protocol)
    check_body(body)
    coefficient(friction)
    setup = Setup() if setup is None else instance(setup, Setup, "setup")
    seed_of(seed)
    given = _given(body, grasp)
    contacts = given.contacts if isinstance(given, Grasp) else given
    require_faithful(setup, friction, body.radius)
    scene = fingertip_scene(
        body, given, found.friction, found.mass_of(body), found.physics, setup.fingers
    )
    return Judgement(
        grasp=given.id if isinstance(given, Grasp) else "",
        hand="",
        protocol=found,
        friction=friction,
        mass_kg=scene.mass_kg,
        push_n=float(scene.pushes_n.max()),
        runs=their_verdict(found, scene, seed, setup.threads),
        ours=our_verdict(
            body, contacts, friction, found.forces(scene.mass_kg), setup,
            partial(setup.scene, body, given, friction),
        ),
    )  # fmt: skip


def judge_hand_by(
    protocol: str | PublishedProtocol,
    hand: Hand,
    body: Polyhedron,
    reach: HandReach,
    friction: float = 0.5,
    *,
    setup: Setup | None = None,
    seed: int = 0,
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
        seed: Seed of the noise of tests that have some.

    Returns:
        Their verdict, ours, and the predicted margin.

    Raises:
        InputError: Hand, object and pose do not belong together, a number is out of range, or no
            test has the name.
    """
    found = _protocol(protocol)
    instance(hand, Hand, "hand", "load_hand makes one")
    check_body(body)
    coefficient(friction)
    seed_of(seed)
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
    return Judgement(
        grasp=reach.grasp,
        hand=hand.name,
        protocol=found,
        friction=friction,
        mass_kg=scene.mass_kg,
        push_n=float(scene.pushes_n.max(initial=0.0)),
        runs=their_verdict(found, scene, seed, setup.threads),
        ours=_ours(hand, body, reach, friction, found.forces(scene.mass_kg), setup),
    )


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
    return our_verdict(
        body, stance_of(hand, reach).contacts, friction, forces, setup, lambda: held,
        held.layout.motors,
    )  # fmt: skip


def _protocol(given: str | PublishedProtocol) -> PublishedProtocol:
    if isinstance(given, PublishedProtocol):
        return given
    one_of(given, PROTOCOLS, "protocol")
    return PROTOCOLS[given]


def _given(body: Polyhedron, grasp: Grasp | Iterable[Contact]) -> Grasp | tuple[Contact, ...]:
    if isinstance(grasp, Grasp):
        check_on_faces(body, grasp)
        return grasp
    each = partial(instance, kind=Contact, name="grasp", remedy="or give a Grasp")
    contacts = several(grasp, each, "grasp", "Contact values")
    if len(contacts) < FEWEST:
        raise InputError(f"grasp: at least two contacts are needed, got {len(contacts)}")
    return contacts
