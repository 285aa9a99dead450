"""Our own trial of a recorded grasp: the hand closes, squeezes, and holds what it should resist.

The hand closes and squeezes as the record says, on an object that is free to move, with the servos
of its file or with stated ones. When all has come to rest the contacts are found anew, and force
closure is proved or refuted. For each load the analysis says the largest multiple that contacts and
motors resist, and with which forces f on the object.

Then the hand holds a share of each load. Joints now start at the angles q at which they came to
rest, and have servos of one stiffness k, no stops, and an inertia that suits k. They are told

    q + L f / k,                                                                         (1)

with the levers L, so that a motor has the torque that f needs as long as its joint stands still.
What can be balanced stays at rest: MuJoCo's contact forces are the answer of a convex program, of
which forces that balance are an answer. As in other trials of closure (`sim_validate.engine.rig`),
friction is raised while a load comes, and lowered to the value under test before the object has to
stay where it is. Links pass through each other then: the analysis knows of no forces between them.

Two negative controls change one thing each: friction falls below what the contacts need for force
closure, or one finger opens. A proof names a wrench that is not resisted then. Contacts that are
not in force closure from the start are such a control, too. All must let go; a verdict whose
controls hold is not trusted.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array, rounded
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError, SolverError, UndecidedError
from grasp_core.messages import MILLI
from grasp_core.quality.wrench_limits import WrenchLimit, axis_wrenches, wrench_limits
from grasp_core.values import Contact
from scenes.hand_files.model import HandModel
from scenes.mujoco.closure_scene import RESPONSE_TIME_S, grasp_size
from scenes.mujoco.filed_hand import FiledHand
from scenes.mujoco.hand_contacts import ContactFinder
from scenes.mujoco.mjcf_text import IDENTITY_POSE, rotations
from scenes.mujoco.published_tests import POSE_NUMBERS, TestedObject
from sim_validate.engine.held_or_let_go import Outcome, displacements
from sim_validate.engine.schedules import samples, smooth
from sim_validate.engine.setup import AXIS_NAMES, Setup
from sim_validate.engine.stepping import Bench, Motion, Told
from sim_validate.judge.postures import Placed, opened, pushes
from sim_validate.protocols.verdict import HandTrial, HeldLoad

CLOSE_S, REST_S = 0.4, 0.8
"""Time in which a hand closes and in which it squeezes, and time in which it comes to rest [s]."""
DRIFT_S, MOST_DRIFT = 0.1, 2e-3
"""How long before the end an object must be at rest [s], and the motion in that time that counts as
rest, in object radii."""
SERVO_PUSHES = 10.0
"""Stiffness of servos that hold, in largest pushes times the hand's lever, per radian."""
STRONG_N_M = 1e3
"""Torque limit of a motor where none is known [N m]: no limit matters."""
GENTLE = 0.6
"""Largest normal force without a load, over the largest there is."""
LEAST_SQUEEZE = 1e-3
"""Largest force without a load, over the largest there is, with which a hand does not squeeze."""
LESS_FRICTION, LEAST_FRICTION = 0.8, 1e-3
"""Friction of the control with less friction, over what its contacts need, and its least value."""
FEWEST_CONTACTS = 2
"""Fewest contacts of which force closure can be asked."""
UNDECIDED = (InputError, SolverError, UndecidedError)


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """A wrench about the centre of mass, (6,), what servos are told, (u,) [rad], and friction."""

    wrench: Array
    told: Array
    friction: float


class HandTrials:
    """A hand with an object, in which records of both are tried one by one."""

    def __init__(
        self, model: HandModel, tested: TestedObject, setup: Setup, servo_n_m_per_rad: float,
        weight_n: float,
    ) -> None:  # fmt: skip
        self.setup, self.friction, self.weight_n = setup, tested.friction, weight_n
        self.body, self.push_n = tested.body, setup.fingers.max_normal_force_n
        scaled = replace(
            tested, mass_kg=self.push_n * RESPONSE_TIME_S**2 / self.body.radius,
            physics=replace(setup.physics, multiccd=False),  # which turns normals up to 20 degrees
        )  # fmt: skip
        rubbing = setup.physics.rubbing(self.friction)
        soft = FiledHand.of(model, rubbing, servo_n_m_per_rad)
        stiffness = rounded(SERVO_PUSHES * self.push_n * soft.lever_m)
        inertia = scaled.mass_kg * soft.lever_m**2
        servos = soft.servos.alike(stiffness, 2.0 * math.sqrt(stiffness * inertia))
        soft = replace(soft, servos=soft.servos.damped(inertia), armature_kg_m2=inertia)
        self.hand = replace(soft, servos=servos, stops=False, meets_itself=False)
        scene = scaled.by_filed_hand(self.hand)
        self.finder = ContactFinder(scene, self.hand, self.body, 0.0)
        threads, timeout_s = setup.threads, setup.timeout_s
        closing = scaled.by_filed_hand(soft)
        self.closing = Bench(closing, threads=threads, timeout_s=timeout_s)
        self.holding = Bench(scene, threads=threads, timeout_s=timeout_s)

    def tried(self, at: Placed) -> HandTrial:
        """Let the hand close in the postures of a record, and hold what it should."""
        motion = self.closed(at)
        far = float(np.linalg.norm(motion.joints[-1, :3])) if len(motion.joints) else math.nan
        lost = _Lost(far)
        if motion.health.fault:
            return lost.because(f"while the hand closed, {motion.health.fault}")
        late = motion.joints[-samples(DRIFT_S, self.closing.sample_s) :, :3]
        drift = float(np.linalg.norm(late - late[-1], axis=1).max())
        if drift > MOST_DRIFT * self.body.radius:
            return lost.because("the object does not come to rest while the hand squeezes it")
        held = ClosedHand(self, at, motion)
        if len(held.contacts) < FEWEST_CONTACTS:
            return lost.because(f"{len(held.contacts)} contacts are left when the hand has closed")
        try:
            proof = force_closure(held.contacts, friction=self.friction)
            if proof.closed and held.is_balanced and held.is_limp:
                return lost.because(
                    "no forces of the closed hand balance each other: some of its joints are "
                    "pulled by one motor together"
                )
            return held.open_trial(proof, far) if not proof.closed else held.trial(proof, far)
        except UNDECIDED as error:
            return lost.because(f"when the hand has closed, {error}")

    def closed(self, at: Placed) -> Motion:
        """Let the hand close and squeeze, and come to rest."""
        every = self.closing.sample_s
        close, rest = samples(CLOSE_S, every), samples(REST_S, every)
        begun, shut, squeezing = at.commands(self.body.center_of_mass)
        way = np.concatenate([
            _way(begun, shut, close), _way(shut, squeezing, close), np.tile(squeezing, (rest, 1)),
        ])  # fmt: skip
        angles, _ = self.hand.following(begun[POSE_NUMBERS:])
        told = Told(
            np.zeros((len(way), 6)), way[:, POSE_NUMBERS:] @ self.hand.servos.pulls.T,
            mocap=way[:, :POSE_NUMBERS], joints=np.concatenate([IDENTITY_POSE, angles]),
        )  # fmt: skip
        (motion,) = self.closing.simulated([told])
        return motion


def _way(begin: Array, end: Array, count: int) -> Array:
    """Return equal steps to an end, (count, n)."""
    return begin + np.arange(1, count + 1)[:, None] / count * (end - begin)


@dataclass(frozen=True, slots=True)
class _Lost:
    moved_m: float

    def because(self, reason: str) -> HandTrial:
        return HandTrial(0, self.moved_m, None, (), (), reason)


class ClosedHand:
    """A hand at rest at its contacts with an object, which is where it has moved to."""

    def __init__(self, trials: HandTrials, at: Placed, motion: Motion) -> None:
        self.trials, self.at, self.start = trials, at, motion.joints[-1]
        center = trials.body.center_of_mass
        self.told = at.commands(center)
        self.angles = self.start[POSE_NUMBERS:]
        moved = np.eye(4)  # the object's motion in its own frame
        moved[:3, :3] = self.turned = rotations(self.start[None, 3:POSE_NUMBERS])[0]
        moved[:3, 3] = self.start[:3] + center - self.turned @ center
        stood = trials.finder.stood(np.linalg.inv(moved) @ at.roots[2], self.angles)
        found = tuple(each for each in stood.contacts if each.distance_m <= 0.0)
        self.found = found
        self.links = tuple(each.link for each in found)
        self.contacts: tuple[Contact, ...] = tuple(each.contact for each in found)
        self.levers = trials.finder.levers(found)
        self.proof: ClosureCertificate | None = None
        self.motors = trials.hand.motors(self.levers, self.angles, STRONG_N_M)
        self.size = (
            grasp_size(np.array([each.position for each in self.contacts])) if found else 0.0
        )

    @cached_property
    def idle(self) -> Array:
        """Forces without a load, (k, 3) [N]: those of a proof, or even pushes, as motors can."""
        if self.is_balanced:
            return GENTLE * self._resting()
        whole = pushes(self.contacts, self.proof, self.trials.push_n)
        used = np.abs(self.motors.torques(whole)) / self.motors.limits
        return GENTLE / max(1.0, float(used.max(initial=0.0))) * whole

    @property
    def is_balanced(self) -> bool:
        """Whether contact forces must balance joints that one motor pulls."""
        return len(self.motors.limits) > len(self.trials.hand.servos.names)

    @property
    def is_limp(self) -> bool:
        """Whether motors that pull several joints can hardly squeeze the object at all."""
        largest = float(np.linalg.norm(self._resting(), axis=1).max(initial=0.0))
        return largest < LEAST_SQUEEZE * self.trials.push_n

    def _resting(self) -> Array:
        """Return forces without a load that motors can exert: means of those at limits, (k, 3) [N].

        Forces at the limits L and L' of a wrench and its opposite balance it and its opposite, and
        so nothing in the shares L' and L. What motors can exert is convex.
        """
        found = self.limits(axis_wrenches(self.trials.body.radius))
        half = len(found) // 2
        means = [
            (one.limit * other.forces + other.limit * one.forces) / (one.limit + other.limit)
            for one, other in zip(found[:half], found[half:], strict=True)
            if one.limit + other.limit > 0.0
        ]
        return np.mean(means or [np.zeros((len(self.contacts), 3))], axis=0)

    def limits(self, wrenches: Array) -> tuple[WrenchLimit, ...]:
        """Return what contacts and motors resist of wrenches about the centre of mass, (n, 6)."""
        trials = self.trials
        return wrench_limits(
            self.contacts, None, trials.friction, wrenches, max_normal_force=trials.push_n,
            center=trials.body.center_of_mass, motors=self.motors,
        )  # fmt: skip

    def trial(self, proof: ClosureCertificate, moved_m: float) -> HandTrial:
        """Hold loads at a share of what contacts in force closure resist, and let controls go."""
        self.proof = proof
        names, planned = zip(*self._loads(), strict=True)
        loads = self._held(names, [trial for trial, _ in planned], [limit for _, limit in planned])
        controls = list(self._controls())
        let_go = self._held([name for name, _ in controls], [trial for _, trial in controls])
        why = next((f"{each.name}: {each.reason}" for each in loads if each.reason), "")
        return HandTrial(len(self.contacts), moved_m, True, loads, let_go, why)

    def open_trial(self, proof: ClosureCertificate, moved_m: float) -> HandTrial:
        """Apply what contacts that are not in force closure provably do not resist."""
        trial = Trial(self._unresisted(proof), self._told(self.idle), self.trials.friction)
        let_go = self._held(["not resisted"], [trial])
        why = "the contacts of the closed hand are proved not to be in force closure"
        return HandTrial(len(self.contacts), moved_m, False, (), let_go, why)

    def _loads(self) -> Iterator[tuple[str, tuple[Trial, float]]]:
        trials, share = self.trials, self.trials.setup.hold.load_share
        axes, weight = axis_wrenches(trials.body.radius), np.zeros(6)
        weight[:3] = -trials.weight_n * self.at.axes[:, 2]
        limits = self.limits(np.vstack([axes, weight]))
        for name, found in zip((*AXIS_NAMES, "weight"), limits, strict=True):
            multiple = 1.0 if name == "weight" else share * found.limit
            limit = found.limit / multiple if multiple else 0.0
            told = self._told(self._planned(found, min(multiple, found.limit)))
            yield name, (Trial(multiple * found.wrench, told, trials.friction), limit)

    def _planned(self, found: WrenchLimit, multiple: float) -> Array:
        """Return forces between those at rest and those at the limit, (k, 3) [N]."""
        share = multiple / found.limit if found.limit > 0.0 else 0.0
        return (1.0 - share) * self.idle + share * found.forces

    def _controls(self) -> Iterator[tuple[str, Trial]]:
        trials = self.trials
        low = rounded(LESS_FRICTION * critical_friction(self.contacts))
        if LEAST_FRICTION < low < math.inf:
            proof = force_closure(self.contacts, friction=low)
            yield "less friction", Trial(self._unresisted(proof), self._told(self.idle), low)
        found = list[tuple[int, ClosureCertificate]]()
        for place, finger in enumerate(trials.hand.fingers):
            left = [each for each, link in zip(self.contacts, self.links, strict=True)
                    if link not in finger]  # fmt: skip
            if FEWEST_CONTACTS <= len(left) < len(self.contacts):
                try:
                    found.append((place, force_closure(left, friction=trials.friction)))
                except UNDECIDED:
                    continue
        refuted = [(place, proof) for place, proof in found if not proof.closed]
        if refuted:
            place, proof = min(refuted, key=lambda each: each[1].margin)
            told, pulls = self._told(self.idle), trials.hand.servos.pulls
            # joints have no stops here, and what a record calls open may be no more so
            anywhere = np.tile([-np.inf, np.inf], (len(self.angles), 1))
            open_angles = opened(self.found, self.levers, self.angles, anywhere)
            own = np.flatnonzero(pulls[:, trials.hand.joints_of(place)].any(axis=1))
            told[own] = (pulls @ open_angles)[own]
            yield "one finger open", Trial(self._unresisted(proof), told, trials.friction)

    def _unresisted(self, proof: ClosureCertificate) -> Array:
        """Return a wrench about the centre of mass that contacts do not resist, (6,) [N, N m].

        Contacts do no work on the motion y that separates them, against the wrench.
        """
        assert proof.separating_wrench is not None  # noqa: S101 - it proves that there is no closure
        radius, turn = self.trials.body.radius, proof.separating_wrench[3:]
        shift = proof.separating_wrench[:3] + np.cross(turn, self.trials.body.center_of_mass)
        wrench = -np.concatenate([shift, radius**2 * turn])
        size = float(np.linalg.norm(wrench / ([1.0] * 3 + [radius] * 3)))
        return self.trials.setup.hold.control_load * self.trials.push_n / size * wrench

    def _told(self, forces: Array) -> Array:
        """Return what servos are told so that motors make contact forces: (1), (u,) [rad]."""
        servos = self.trials.hand.servos
        torques = self.motors.torques(forces)[: len(servos.names)]
        return servos.pulls @ self.angles + torques / servos.stiffness

    def lets_go_at(self, found: WrenchLimit, span: float) -> float:
        """Find by a slow rise which share of a limit is resisted; NaN where none is found.

        The load rises from a share of 1 - span to 1 + span.
        """
        trials, (rise, rest, _) = self.trials, self._counts()
        ramp = samples(trials.setup.limit.ramp_s, trials.holding.sample_s)
        climb = 1.0 + span * np.linspace(-1.0, 1.0, ramp + 1)[1:]
        shares = np.concatenate([(1.0 - span) * smooth(rise), np.full(rest, 1.0 - span), climb])
        load = Trial(found.limit * found.wrench, self._told(found.forces), trials.friction)
        (motion,) = trials.holding.simulated([self._schedule(load, shares, rise + rest)])
        moved = self._moved(motion, rise + rest)
        passed = np.flatnonzero(moved >= trials.setup.hold.hold_threshold * self.size)
        if motion.health.fault or not passed.size or passed[0] == 0:
            return math.nan
        return float(climb[passed[0] - 1])

    def _held(
        self, names: Sequence[str], held: Sequence[Trial], limits: Sequence[float] | None = None
    ) -> tuple[HeldLoad, ...]:
        """Hold loads, all from the hand at rest."""
        if not held:
            return ()
        rise, rest, keep = self._counts()
        shares = np.concatenate([smooth(rise), np.ones(rest + keep)])
        schedules = [self._schedule(each, shares, rise + rest) for each in held]
        motions = self.trials.holding.simulated(schedules)
        return tuple(
            self._judged(name, motion, rise + rest, limit)
            for name, motion, limit in zip(names, motions, limits or [0.0] * len(held), strict=True)
        )

    def _counts(self) -> list[int]:
        """Return the samples in which a load rises, in which all settles, and of a hold."""
        hold, every = self.trials.setup.hold, self.trials.holding.sample_s
        return [samples(each, every) for each in (hold.load_s, hold.settle_s, hold.hold_s)]

    def _schedule(self, load: Trial, shares: Array, watched: int) -> Told:
        """Lay out a trial that applies shares (n,) of a load, and lowers friction at a sample."""
        count, begun, trials = len(shares), self._told(self.idle), self.trials
        high = trials.setup.hold.settling_friction * trials.friction
        return Told(
            shares[:, None] * (load.wrench.reshape(2, 3) @ self.turned.T).ravel(),
            begun + shares[:, None] * (load.told - begun),
            joints=self.start,
            mocap=np.tile(self.told[2][:POSE_NUMBERS], (count, 1)),
            friction=np.where(np.arange(count) < watched, high, load.friction)[:, None],
        )

    def _moved(self, motion: Motion, watched: int) -> Array:
        """Measure displacements from a sample on, (n,) [m]."""
        poses = motion.joints[watched - 1 :, :POSE_NUMBERS]
        middle = np.mean([each.position for each in self.contacts], axis=0)
        return displacements(poses, middle - self.trials.body.center_of_mass, self.size)

    def _judged(self, name: str, motion: Motion, watched: int, limit: float) -> HeldLoad:
        if motion.health.fault:
            return HeldLoad(name, limit, Outcome.DIVERGED, motion.health.fault, math.nan)
        far = float(self._moved(motion, watched).max())
        if far < self.trials.setup.hold.hold_threshold * self.size:
            return HeldLoad(name, limit, Outcome.HELD, "", far)
        reason = f"the object moved by {MILLI * far:.3g} mm"
        if limit > 0.0:
            reason += f"; by the analysis {limit:.3g} times the load is resisted"
        return HeldLoad(name, limit, Outcome.SLIPPED, reason, far)
