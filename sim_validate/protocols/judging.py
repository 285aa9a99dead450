"""Judges grasps and hands in grasps by published tests: their verdict, ours, and the prediction.

Their verdict is that of the test as it is published, with its own friction, mass and contacts. The
prediction and our verdict are about the grasp at its own friction: the loads of the test are
applied in our closure trials, where forces are planned, contacts obey Coulomb's law to a per mille,
and thresholds are micrometres. Contacts that are not in force closure need no trial: it is proved
that they let go of some load.

In their runs a palm that moves is a palm at rest with an object that is pulled back: at the mass m
and the inertia J, the palm's acceleration a and its angular acceleration b act as

    force = -m a,   torque = -J b                                                        (1)

in the frame of the palm. Accelerations are second differences of the path over one sample, so a
start at full speed takes one sample. Light fingertips are left out, and so is what a turn at
constant speed does to an object whose centre is not on its axis.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from grasp_core.allowed_values import Friction, instance, one_of, value_of
from grasp_core.arrays import Array
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.messages import MILLI
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.fingertips import Slides
from scenes.mujoco.hand_scenes import build_hand_scene
from scenes.mujoco.mjcf_text import IDENTITY_POSE
from scenes.mujoco.published_tests import TestedObject, TestedScene
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.held_or_let_go import Outcome, judge, rotation_angles
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.known_cases import untouching
from sim_validate.engine.planned_loads import LoadPlanner
from sim_validate.engine.rig import closed_on
from sim_validate.engine.schedules import samples
from sim_validate.engine.setup import Setup
from sim_validate.engine.stepping import Bench, Motion, Told
from sim_validate.execution.execute import given_contacts
from sim_validate.hands.dexgraspbench import hand_file
from sim_validate.hands.known_hand import KnownHand
from sim_validate.hands.validate import hand_setup
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.protocols.published import PROTOCOLS, Passing, ProtocolRun, PublishedProtocol
from sim_validate.protocols.verdict import Judgement, OurVerdict, RunVerdict


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
    checked(ClosureCase.of(setup, friction, body.radius))
    scene = _tested(found, body).by_fingertips(given, setup.fingers)
    ours = our_verdict(
        LoadPlanner(body, contacts, friction, setup, None), found.forces(scene.mass_kg),
        partial(setup.scene, body, given, friction),
    )  # fmt: skip
    return _judged(
        found, scene, friction, setup, ours, given.id if isinstance(given, Grasp) else ""
    )


def attempted(
    name: str, body: Polyhedron, grasp: Grasp, friction: float, setup: Setup
) -> Judgement:
    """Judge one of several grasps; whatever is wrong with it alone is a run that is not passed."""
    try:
        return judge_by(name, body, grasp, friction, setup=setup)
    except OWN_FAULTS as error:
        run = RunVerdict(0, False, str(error), math.nan, math.nan, 0)
        ours = OurVerdict(False, False, 0.0, str(error))
        mass_kg = _protocol(name).mass_of(body)
        return Judgement(grasp.id, name, friction, mass_kg, 0.0, (run,), ours)


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

    It squeezes with 0.6 of what its motors can. Records of other tools, with a squeeze of their
    own, are judged by `judge_records`.

    Args:
        protocol: The test, or its name (see `protocol_names`).
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`).
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
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
    servos = replace(hand_file(hand), weld=found.weld)
    if not found.own_servos:
        servos = replace(servos, stiffness_n_m_per_rad=found.servo_n_m_per_rad)
    tested = _tested(found, body)
    postures = tested.postures(hand, reach, servos.stiffness_n_m_per_rad)
    scene = tested.by_hand(hand, postures, servos)
    ours = _ours(hand, body, reach, friction, found.forces(scene.mass_kg), setup)
    return _judged(found, scene, friction, setup, ours, reach.grasp, hand.name)


def _tested(protocol: PublishedProtocol, body: Polyhedron) -> TestedObject:
    return TestedObject(body, protocol.friction, protocol.mass_of(body), protocol.physics)


def _judged(
    protocol: PublishedProtocol, scene: TestedScene, friction: float, setup: Setup,
    ours: OurVerdict, grasp: str, hand: str = "",
) -> Judgement:  # fmt: skip
    runs = their_verdict(protocol, scene, setup.threads)
    push_n = float(scene.pushes_n.max(initial=0.0))
    return Judgement(grasp, protocol.name, friction, scene.mass_kg, push_n, runs, ours, hand)


def _ours(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, forces: tuple[Array, ...],
    setup: Setup,
) -> OurVerdict:  # fmt: skip
    """Judge a hand by our trials."""
    checked(ClosureCase.of(setup, friction, body.radius))
    checked(KnownHand.of(setup, friction, coupled=bool(hand.couplings)))
    held = build_hand_scene(hand, body, reach, friction, physics=setup.physics)
    contacts = stance_of(hand, reach).contacts
    analysis = LoadPlanner(body, contacts, friction, setup, held.hand.motors)
    return our_verdict(analysis, forces, lambda: held)


def _protocol(given: str | PublishedProtocol) -> PublishedProtocol:
    if isinstance(given, PublishedProtocol):
        return given
    one_of(given, PROTOCOLS, "protocol")
    return PROTOCOLS[given]


def our_verdict(
    analysis: LoadPlanner, forces: Sequence[Array], scene: Callable[[], Scene]
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
    amiss = untouching(rig.bench) if isinstance(rig.bench.scene.layout.holder, Slides) else ()
    names = [load.name for load in loads] or ["no load"]
    for name, trace in zip(names, rig.traced(rig.holds(held)), strict=True):
        found = judge(trace, rig.bench.scene.layout, setup.hold, amiss)
        if found.outcome is not Outcome.HELD:
            return OurVerdict(True, False, margin, f"{name}: {found.outcome.value}: {found.reason}")
    return OurVerdict(True, True, margin, "")


PUBLISHED_STEPS = 10
"""Simulation steps per sample: DexGraspBench moves its commands every ten steps."""
POSE_END = 7
"""Coordinates of the object's free joint, which come first."""


@dataclass(frozen=True, slots=True, eq=False)
class Timeline(Told):
    """What is told to the servos and acts on the object in each of the n samples of a run."""

    looks: tuple[int, ...] = ()
    """Samples after which the object is looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Glance:
    """The object at a look, and how many fingers touch it."""

    pose: Array
    """Position of the object's centre of mass and its orientation (w, x, y, z), (7,)."""
    fingers: int


def their_verdict(
    protocol: PublishedProtocol, scene: TestedScene, threads: int = 1
) -> tuple[RunVerdict, ...]:
    """Simulate all runs of a test and judge each."""
    return their_verdicts(protocol, [scene], threads)[0]


def their_verdicts(
    protocol: PublishedProtocol, scenes: Sequence[TestedScene], threads: int = 1
) -> list[tuple[RunVerdict, ...]]:
    """Simulate all runs of a test with scenes of one text, which are told different things."""
    bench = Bench(scenes[0], threads=threads, chunk=PUBLISHED_STEPS, kept=("state",))
    root = POSE_END * bench.moves_as_told  # where one moves as told, its pose comes first
    moving = len(bench.home) - POSE_END
    runs = list[Timeline]()
    for scene in scenes:
        begun = scene.opened if protocol.close_s else scene.shut
        joints = np.concatenate([IDENTITY_POSE, begun[len(begun) - moving :]])
        runs += [
            replace(run, mocap=run.commands[:, :root] if root else None,
                    commands=scene.told(run.commands[:, root:]), joints=joints)
            for run in (timeline(protocol, scene, steps) for steps in protocol.runs)
        ]  # fmt: skip
    motions = bench.simulated(runs)
    judged = [
        judged_run(place % len(protocol.runs),
                   [] if motion.health.fault else looked(bench, motion, run.looks),
                   motion.health.fault, protocol.passing)
        for place, (motion, run) in enumerate(zip(motions, runs, strict=True))
    ]  # fmt: skip
    return [
        tuple(judged[first : first + len(protocol.runs)])
        for first in range(0, len(judged), len(protocol.runs))
    ]


def looked(bench: Bench[TestedScene], motion: Motion, looks: Sequence[int]) -> list[Glance]:
    """Look at the object after some samples of a motion."""
    (states,), fingers = motion.kept, bench.scene.fingers
    met = bench.touching([states[sample] for sample in looks])
    return [
        Glance(motion.joints[sample, :POSE_END], sum(not names.isdisjoint(own) for own in fingers))
        for sample, names in zip(looks, met, strict=True)
    ]


def timeline(protocol: PublishedProtocol, scene: TestedScene, run: ProtocolRun) -> Timeline:
    """Lay out one run: closing, squeezing, then its steps."""
    sample_s = PUBLISHED_STEPS * scene.physics.timestep
    closing = _closing(protocol, scene, sample_s)
    counts = [samples(step.seconds, sample_s) for step in run]
    begins = np.cumsum([len(closing), *counts]).tolist()
    looks = list[int]()
    for first, end, part in zip(begins, begins[1:], run, strict=False):
        every = end - first if part.look_s is None else samples(part.look_s, sample_s)
        looks += sorted({*range(first + every - 1, end, every), end - 1})
    n = begins[-1]
    wrenches = np.zeros((n, 6))
    wrenches[len(closing) :] = _wrenches(run, counts, scene, sample_s)
    wrenches = (wrenches.reshape(n, 2, 3) @ scene.axes.T).reshape(n, 6)
    held = np.broadcast_to(scene.squeezing, (sum(counts), len(scene.squeezing)))
    return Timeline(wrenches, np.vstack([closing, held]), looks=tuple(looks))


def _closing(protocol: PublishedProtocol, scene: TestedScene, sample_s: float) -> Array:
    parts = [np.zeros((0, len(scene.shut)))]
    for seconds, begin, end in (
        (protocol.close_s, scene.opened, scene.shut),
        (protocol.squeeze_s, scene.shut, scene.squeezing),
    ):
        if seconds:
            parts.append(np.linspace(begin, end, samples(seconds, sample_s) + 1)[1:])
    return np.vstack(parts)


def _wrenches(run: ProtocolRun, counts: list[int], scene: TestedScene, sample_s: float) -> Array:
    """Return forces of the steps with what the palm's motion adds: (1), (n, 6)."""
    forces, paths, angles = list[Array](), [np.zeros((1, 3))], [np.zeros(1)]
    for part, count in zip(run, counts, strict=True):
        time = np.arange(1, count + 1) / count
        forces.append(np.tile(part.force(scene.mass_kg), (count, 1)))
        wave = np.sin(2.0 * np.pi * time)
        path = time[:, None] * np.array(part.line_m) + wave[:, None] * np.array(part.wave_m)
        paths.append(paths[-1][-1] + path)
        angles.append(angles[-1][-1] + time * np.radians(part.turn_deg))
    found = np.zeros((sum(counts), 6))
    found[:, :3] = np.vstack(forces) - scene.mass_kg * _acceleration(np.vstack(paths), sample_s)
    turning = _acceleration(np.concatenate(angles)[:, None], sample_s)
    found[:, 3:] = -turning * (scene.axes.T @ scene.inertia_kg_m2 @ scene.axes)[:, 2]
    return found


def _acceleration(path: Array, sample_s: float) -> Array:
    """Return second differences of a path that begins at rest, (n, d), one per sample."""
    speeds = np.diff(path, axis=0) / sample_s
    before = np.vstack([np.zeros((1, path.shape[1])), speeds[:-1]])
    return (speeds - before) / sample_s


def judged_run(number: int, looks: Sequence[Glance], fault: str, passing: Passing) -> RunVerdict:
    """Judge one run at its looks, up to the first that does not pass."""
    moved, turned, seen, reason = 0.0, 0.0, list[int](), fault
    for look in looks:
        if reason:
            break
        shift = float(np.linalg.norm(look.pose[:3]))
        turn = float(np.degrees(rotation_angles(look.pose[None, 3:], IDENTITY_POSE[None, 3:])[0]))
        moved, turned = max(moved, shift), max(turned, turn)
        seen.append(look.fingers)
        if not shift < passing.most_m:
            reason = f"the object moved by {MILLI * shift:.3g} mm, and {MILLI * passing.most_m:g}"
            reason += " is enough"
        elif not turn < passing.most_deg:
            reason = f"the object turned by {turn:.3g} deg, and {passing.most_deg:g} is enough"
        elif look.fingers < passing.fingers:
            reason = f"{look.fingers} fingers touched the object, and {passing.fingers} must"
    return RunVerdict(number, not reason, reason, moved, turned, min(seen, default=0))
