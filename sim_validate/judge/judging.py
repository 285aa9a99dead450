"""Judges recorded grasps: finds contacts, proves what they resist, and simulates what they hold.

Records of one hand with one object at one scale share a stage: what is compiled for them once.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.errors import InputError
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.messages import MILLI
from grasp_core.objects.convex_pieces import PiecedObject
from grasp_core.objects.on_faces import SolidSurface
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.quality.measures import Measure, resisted_loads
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limits import axis_wrenches, wrench_limits
from grasp_core.values import Contact
from scenes.mujoco.filed_hand import OWN, FiledHand
from scenes.mujoco.hand_contacts import ContactFinder, LinkContact, Stood
from scenes.mujoco.published_tests import TestedObject, TestedScene
from sim_validate.engine.kept_gates import checked
from sim_validate.judge.hands import JudgedHand
from sim_validate.judge.known_grasp import KnownGrasp
from sim_validate.judge.own_trial import FEWEST_CONTACTS, STRONG_N_M, UNDECIDED, HandTrials
from sim_validate.judge.postures import Placed, completed, placed
from sim_validate.judge.records import ContactRecord, HandRecord
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.protocols.judging import their_verdicts
from sim_validate.protocols.published import PROTOCOLS, PublishedProtocol
from sim_validate.protocols.settings import JudgeSettings
from sim_validate.protocols.verdict import (
    HandTrial,
    RecordJudgement,
    RunVerdict,
    TestOfRecord,
)

NEAR_M = 0.01
"""Distance up to which contacts are looked for [m], so that all that may touch are seen."""
RUN_TOGETHER = 8
"""Largest number of records that are tested in one go."""


class Stage:
    """A hand with an object, compiled for all that is asked about records of both."""

    def __init__(self, hand: JudgedHand, thing: PiecedObject, settings: JudgeSettings) -> None:
        self.hand, self.thing, self.settings = hand, thing, settings
        self.body = thing.body
        self.filed = FiledHand.of(hand.model, (settings.friction, 0.0, 0.0), hand.servo_n_m_per_rad)

    @cached_property
    def finder(self) -> ContactFinder:
        """Finds contacts of the hand as it stands in records."""
        scene = self._tested(self.settings.friction, self.settings.mass_kg).by_filed_hand(
            self.filed
        )
        return ContactFinder(scene, self.filed, self.body, NEAR_M)

    @cached_property
    def trials(self) -> HandTrials:
        """Runs our own trials, with a simulator that is right about a known grasp."""
        settings = self.settings
        coupled = bool(self.filed.rules)
        checked(KnownGrasp.of(settings.setup, settings.friction, coupled=coupled))
        weight_n = settings.mass_kg * GRAVITY_M_PER_S2
        tested = self._tested(settings.friction, settings.mass_kg)
        return HandTrials(
            self.hand.model, tested, settings.setup, self.hand.servo_n_m_per_rad, weight_n
        )

    def _tested(self, friction: float, mass_kg: float) -> TestedObject:
        physics = self.settings.setup.physics
        return TestedObject(self.body, friction, mass_kg, physics, self.thing.pieces)

    def judged(self, records: Sequence[HandRecord]) -> list[RecordJudgement | str]:
        """Judge records of the hand with the object; a text says why one cannot be judged."""
        found = list[RecordJudgement | str]()
        for first in range(0, len(records), RUN_TOGETHER):
            found += self._judged_together(records[first : first + RUN_TOGETHER])
        return found

    def _judged_together(self, records: Sequence[HandRecord]) -> list[RecordJudgement | str]:
        looked = [self.looked(record) for record in records]
        known = [each for each in looked if not isinstance(each, str)]
        tests = {name: self._tests(PROTOCOLS[name], known) for name in self.settings.tests}
        found = list[RecordJudgement | str]()
        for record, each in zip(records, looked, strict=True):
            if isinstance(each, str):
                found.append(each)
                continue
            own = tuple(of_test.pop(0) for of_test in tests.values())
            trial = self.trials.tried(each.at) if self.settings.trial else None
            found.append(_judgement(record, self.hand.name, each, own, trial, self))
        return found

    def looked(self, record: HandRecord) -> "Looked | str":
        """Find the contacts of a record, and what is proved of them, and complete its postures."""
        try:
            at = placed(record, self.filed)
        except InputError as error:
            return str(error)
        stood = self.finder.stood(*at.grasp)
        touching = tuple(
            each for each in stood.contacts if each.distance_m <= self.settings.touch_m
        )
        levers = self.finder.levers(touching)
        contacts = [each.contact for each in touching]
        proof = proved(contacts, self.settings.friction)
        certificate = None if isinstance(proof, str) else proof
        whole = completed(at, self.filed, touching, levers, certificate, self.settings.push_n)
        return Looked(whole, stood, touching, levers, proof)

    def told(self, protocol: PublishedProtocol, looked: Sequence["Looked"]) -> list[TestedScene]:
        """Return the scene of a published test, told the postures of each record."""
        rubbing, own = protocol.physics.rubbing(protocol.friction), protocol.own_servos
        servo = self.hand.servo_n_m_per_rad if own else protocol.servo_n_m_per_rad
        hand = FiledHand.of(self.hand.model, rubbing, servo, own_servos=own, weld=protocol.weld)
        scene = TestedObject(
            self.body, protocol.friction, protocol.mass_of(self.body), protocol.physics,
            self.thing.pieces,
        ).by_filed_hand(hand)  # fmt: skip
        found = list[TestedScene]()
        for each in looked:
            opened, shut, squeezing = each.at.commands(self.body.center_of_mass)
            postures = {"opened": opened, "shut": shut, "squeezing": squeezing}
            found.append(replace(scene, **postures, axes=each.at.axes))
        return found

    def _tests(self, protocol: PublishedProtocol, looked: Sequence["Looked"]) -> list[TestOfRecord]:
        """Run a published test on records."""
        if not looked:
            return []
        scenes, found = self.told(protocol, looked), list[TestOfRecord]()
        verdicts = their_verdicts(protocol, scenes, self.settings.setup.threads)
        for each, runs in zip(looked, verdicts, strict=True):
            amiss = self._too_deep(each.at, protocol)
            proof = proved([one.contact for one in each.touching], protocol.friction)
            closed = None if isinstance(proof, str) else proof.closed
            refused = (RunVerdict(0, False, amiss, 0.0, 0.0, 0),) if amiss else runs
            found.append(TestOfRecord(protocol.name, scenes[0].mass_kg, closed, refused))
        return found

    def _too_deep(self, at: Placed, protocol: PublishedProtocol) -> str:
        """Say so if the open hand stands too deep in the object or itself to be tested at all."""
        most = protocol.passing.most_overlap_m
        if most is None:
            return ""
        stood = self.finder.stood(at.roots[0], at.joints[0])
        deepest = max(stood.depth_m, stood.own_depth_m)
        if deepest <= most:
            return ""
        return (
            f"before it closes the hand stands {MILLI * deepest:.3g} mm deep in the object or in "
            f"itself, and {MILLI * most:g} is the most that is tested"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """A record with its contacts, and what is proved of them."""

    at: Placed
    stood: Stood
    touching: tuple[LinkContact, ...]
    levers: Array
    proof: ClosureCertificate | str
    """A certificate, or why there is none."""


def proved(contacts: Sequence[Contact], friction: float) -> ClosureCertificate | str:
    """Prove that contacts are in force closure, or that they are not, or say why neither is."""
    if len(contacts) < FEWEST_CONTACTS:
        return f"{len(contacts)} contacts cannot be in force closure"
    try:
        return force_closure(contacts, friction=friction)
    except UNDECIDED as error:
        return str(error)


def _judgement(
    record: HandRecord, hand: str, looked: Looked, tests: tuple[TestOfRecord, ...],
    trial: HandTrial | None, stage: Stage,
) -> RecordJudgement:  # fmt: skip
    proof, stood = looked.proof, looked.stood
    motors = stage.filed.motors(looked.levers, looked.at.grasp[1], STRONG_N_M)
    return RecordJudgement(
        id=record.id, object=record.object, scale=record.scale, hand=hand,
        proof=None if isinstance(proof, str) else proof,
        undecided=proof if isinstance(proof, str) else "",
        links=tuple(each.link.removeprefix(OWN.format("")) for each in looked.touching),
        depth_m=stood.depth_m, own_depth_m=stood.own_depth_m, tests=tests, trial=trial,
        joints=looked.at.joints[1], **_figures(proof, stage.body, stage.settings, motors),
    )  # fmt: skip


def judged_contacts(
    record: ContactRecord, thing: PiecedObject, settings: JudgeSettings
) -> RecordJudgement:
    """Judge contacts of which no hand is known: there is nothing to simulate.

    Raises:
        InputError: A contact is not on the object.
    """
    surface = SolidSurface(thing.body.vertices, thing.body.triangles)
    for each in record.contacts:
        if not surface.holds(each.position, None, settings.touch_m):
            raise InputError(
                f"contacts must be within {MILLI * settings.touch_m:g} mm of the object, got one "
                f"at {each.position.tolist()} m; give the object, and the scale, of the record"
            )
    proof = proved(record.contacts, settings.friction)
    return RecordJudgement(
        id=record.id, object=record.object, scale=record.scale, hand="",
        proof=None if isinstance(proof, str) else proof,
        undecided=proof if isinstance(proof, str) else "",
        links=("",) * len(record.contacts), depth_m=None, own_depth_m=None, tests=(), trial=None,
        **_figures(proof, thing.body, settings, None),
    )  # fmt: skip


def _figures(
    proof: ClosureCertificate | str, body: Polyhedron, settings: JudgeSettings,
    motors: Motors | None,
) -> dict[str, Any]:  # fmt: skip
    """Return figures of contacts by name, each None where it could not be found."""
    if isinstance(proof, str):
        return dict.fromkeys((*FIGURES, "least_push_n", "weakest_n"))
    found: dict[str, Any] = dict(contact_figures(proof, body.center_of_mass, body.radius))
    weight_n, payload = settings.mass_kg * GRAVITY_M_PER_S2, found["payload"]
    found |= {"least_push_n": math.inf, "weakest_n": 0.0}
    if proof.closed:
        found["least_push_n"] = weight_n / payload if payload else None
        found["weakest_n"] = _or_none(lambda: min(each.limit for each in wrench_limits(
            proof.positions, proof.normals, settings.friction, axis_wrenches(body.radius),
            max_normal_force=settings.push_n, center=body.center_of_mass, motors=motors,
        )))  # fmt: skip
    return found


FIGURES = "critical_friction", "ferrari_canny", "payload"


def contact_figures(
    proof: ClosureCertificate, center: Array, radius_m: float
) -> dict[str, float | None]:
    """Return what `FIGURES` name of the contacts of a proof, each None where it is not found.

    Args:
        proof: Proof of force closure, or of its opposite.
        center: Centre of mass of the object, (3,) [m], about which torques are taken.
        radius_m: Radius of the object, by which torques are divided [m].
    """
    at = proof.positions, proof.normals
    critical = _or_none(lambda: critical_friction(*at))
    if not proof.closed:
        return dict(zip(FIGURES, (critical, 0.0, 0.0), strict=True))
    wrenches = WrenchSet.of(*at, proof.friction, center=center, torque_scale=radius_m, norm="l1")
    quality = _or_none(lambda: wrench_set_quality(wrenches).lower)
    payload = _or_none(lambda: resisted_loads(wrenches, Measure("weight")).lower)
    return dict(zip(FIGURES, (critical, quality, payload), strict=True))


def _or_none(find: Callable[[], float]) -> float | None:
    try:
        return find()
    except OWN_FAULTS:
        return None
