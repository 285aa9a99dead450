"""What published tests, our trials and the analysis say of grasps, as `judgements.json` has it."""

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Annotated, Self, TypeAlias

import numpy as np
from pydantic import Field, computed_field

from grasp_core.allowed_values import FLAT, Friction, Measured, Number, OrInfinity, Quantity
from grasp_core.arrays import Array, Point, Shape
from grasp_core.by_value import summary
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown, figure
from grasp_core.files.file_kinds import JUDGEMENTS
from grasp_core.messages import MILLI
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.files.result_files import AboutObject, ResultFile
from sim_validate.protocols.diversity import joint_entropies
from sim_validate.protocols.published import PublishedProtocol
from sim_validate.protocols.settings import JudgeSettings


@declared
class RunVerdict(Declared):
    """One run of a published test: whether the grasp passed, and what the test saw."""

    number: Number
    passed: bool
    reason: str
    displacement_m: Measured
    """Largest displacement at a look, up to the first that did not pass [m]."""
    turn_deg: Measured
    """Largest turn at a look, up to the first that did not pass [deg]."""
    fingers: Number
    """Least number of fingers on the object at a look, up to the first that did not pass."""


@declared
class OurVerdict(Declared):
    """Our verdict on the loads of a published test, with the prediction."""

    closed: bool
    """Whether the contacts are in force closure, which is proved either way."""
    held: Annotated[bool, Shown("holds ours")]
    """Whether the object stayed within our thresholds under every load; False without closure."""
    margin: Annotated[OrInfinity, Shown("margin", ".3g")]
    """Least multiple of the loads that is resisted according to the analysis; 0 without closure,
    and infinite (null in files) without a load."""
    reason: str


@declared
class Judgement(Declared):
    """A grasp judged by a published test, by our trials of the same loads, and by the analysis."""

    grasp: Annotated[str, Field(alias="id"), Shown("grasp")]
    """Id of the grasp; empty for contacts without one."""
    protocol: Annotated[str, Shown("test")]
    """Name of the test."""
    friction: Friction
    """Coulomb coefficient of our verdict and of the prediction; the test has its own."""
    mass_kg: Quantity
    """Mass of the object in the test [kg]."""
    push_n: float
    """Largest normal force with which a finger squeezes in the test [N]."""
    runs: tuple[RunVerdict, ...]
    ours: Annotated[OurVerdict, FLAT]
    """Our verdict on the loads of the test, with the predicted margin."""
    hand: str = ""
    """Name of the hand that held the object; empty for fingertips."""

    @computed_field
    @property
    def theirs(self) -> Annotated[bool, Shown("passes theirs")]:
        """Whether the grasp passes the published test: all of its runs."""
        return all(each.passed for each in self.runs)

    @computed_field
    @property
    def predicted(self) -> bool:
        """Whether the analysis says that the grasp resists all loads of the test."""
        return self.ours.closed and self.ours.margin >= 1.0

    @computed_field
    @property
    def displacement_m(self) -> Annotated[float | None, Shown("moved mm", ".2g", 1e3)]:
        """Largest displacement of the object in any run [m]."""
        return max((run.displacement_m for run in self.runs), default=None)

    @computed_field
    @property
    def turn_deg(self) -> Annotated[float | None, Shown("deg", ".2g")]:
        """Largest turn of the object in any run [deg]."""
        return max((run.turn_deg for run in self.runs), default=None)

    @property
    def good(self) -> bool:
        """Whether the test and our trials both accept the grasp."""
        return self.theirs and self.ours.held

    def __repr__(self) -> str:
        theirs = f"theirs {'passed' if self.theirs else 'failed'}"
        ours = f"ours {'held' if self.ours.held else 'not held'}"
        told = (self.grasp or "contacts", self.protocol, theirs, ours)
        return summary("Judgement", *told, margin=self.ours.margin)


@declared
class HeldLoad(Declared):
    """A wrench on an object in a hand, and how holding it ended."""

    name: str
    limit: OrInfinity
    """Multiple of the wrench that contacts and motors resist by the analysis; zero where it is
    proved that no forces resist it."""
    outcome: Outcome
    reason: str
    """What happened; empty if the object was held."""
    displacement_m: Measured
    """Largest displacement while the object had to be held [m]: motion of the point between the
    contacts plus grasp size times rotation."""


@declared
class HandTrial(Declared):
    """What a hand held after it had closed on an object and squeezed it."""

    contacts: Annotated[Number, Shown("contacts")]
    """Contacts of links with the object, once the hand had squeezed it."""
    moved_m: Annotated[Measured, Shown("moved mm", ".2g", 1e3)]
    """How far the object moved while the hand closed [m]."""
    closed: Annotated[bool | None, Shown("closed")]
    """Whether these contacts are in force closure, proved either way; None where the object was
    lost first, or nothing could be proved."""
    loads: tuple[HeldLoad, ...]
    """Loads along the axes, at a share of what is resisted, and the weight."""
    controls: tuple[HeldLoad, ...]
    """Negative controls: wrenches that are provably not resisted, mostly after one change."""
    reason: Annotated[str, Shown("reason")]
    """Why the object was not held; empty where it was."""

    @computed_field
    @property
    def held(self) -> Annotated[bool, Shown("held")]:
        """Whether the contacts are in force closure, and every load was held."""
        return bool(self.closed) and all(each.outcome is Outcome.HELD for each in self.loads)

    @computed_field
    @property
    def trusted(self) -> Annotated[bool, Shown("trusted")]:
        """Whether every negative control let go."""
        return all(each.outcome is not Outcome.HELD for each in self.controls)


@declared
class TestOfRecord(Declared):
    """A recorded grasp judged by a published test."""

    __test__ = False  # no class of tests, whatever its name begins with

    protocol: str
    """Name of the test."""
    mass_kg: Quantity
    """Mass of the object in the test [kg]."""
    closed: Annotated[bool | None, Shown("closed")]
    """Whether the contacts are in force closure at the friction of the test; None where that could
    not be decided."""
    runs: tuple[RunVerdict, ...]

    @computed_field
    @property
    def passed(self) -> Annotated[bool, Shown("passes")]:
        """Whether the grasp passes all runs of the test."""
        return bool(self.runs) and all(each.passed for each in self.runs)


@declared
class RecordJudgement(Declared):
    """A recorded grasp: its contacts and depths, what is proved of it, and what it held."""

    id: Annotated[str, Shown("record")]
    """Id of the record: its file and place."""
    object: Annotated[str, Shown("object")]
    """Object, as the record names it."""
    scale: Annotated[float, Shown("scale")]
    """Factor on the lengths of the object's mesh."""
    hand: str
    """Name of the hand; empty for contacts without one."""
    proof: ClosureCertificate | None
    """Proof of force closure at the friction of the file, or of its opposite, with the contacts;
    None where there are too few, or it could not be decided."""
    undecided: str
    """Why there is no proof; empty where there is one."""
    links: tuple[str, ...]
    """Link of each contact; empty texts where no hand is known."""
    depth_m: Annotated[float | None, Shown("depth mm", ".2f", MILLI)]
    """How deep hand and object stand in each other [m]."""
    own_depth_m: Annotated[float | None, Shown("own depth mm", ".2f", MILLI)]
    """How deep links of the hand stand in each other [m]."""
    critical_friction: Annotated[OrInfinity | None, Shown("mu*", ".3f")]
    """Common coefficient from which on the contacts are in force closure; infinite if there is
    none."""
    ferrari_canny: Annotated[float | None, Shown("Q", ".3f")]
    """Proved lower bound of the Ferrari-Canny quality for normal forces of sum one newton [N],
    torques over the object's radius; zero without closure."""
    payload: Annotated[float | None, Shown("payload", ".3f")]
    """Proved lower bound of the weight that the contacts hold in every orientation, over the sum of
    their normal forces; zero without closure."""
    least_push_n: Annotated[OrInfinity | None, Shown("least push N", ".3g")]
    """Least sum of normal forces that holds the weight of the settings in every orientation, by
    that bound [N]; infinite without closure."""
    weakest_n: Annotated[float | None, Shown("weakest N", ".3g")]
    """Least force or torque over the radius along an axis that contacts resist with the largest
    normal force, and with the motors' limits where they are known [N]."""
    tests: tuple[TestOfRecord, ...]
    trial: HandTrial | None
    """Our own trial of the hand; None where it was not asked for, or there is no hand."""
    joints: Annotated[Annotated[Array, Shape("j")] | None, Field(alias="joints_rad")] = None
    """Joint angles of the recorded grasp in the order of the hand's file, (j,) [rad]; None where no
    hand is known."""

    @computed_field
    @property
    def closed(self) -> Annotated[bool | None, Shown("closed")]:
        """Whether the contacts are in force closure, by the proof."""
        return None if self.proof is None else self.proof.closed

    @computed_field
    @property
    def contacts(self) -> Annotated[int, Shown("contacts")]:
        """Number of contacts."""
        return len(self.links)

    @figure
    def touching_links(self) -> Annotated[int, Shown("links")]:
        """Number of links that touch the object."""
        return len({*self.links} - {""})

    @figure
    def closure_margin(self) -> Annotated[float | None, Shown("margin", ".3g")]:
        """Proved bound of the margin of force closure, negative without closure."""
        return None if self.proof is None else self.proof.margin

    @computed_field
    @property
    def passed(self) -> Annotated[bool | None, Shown("passes theirs")]:
        """Whether the grasp passes every published test; None without one."""
        return all(each.passed for each in self.tests) if self.tests else None

    @computed_field
    @property
    def held(self) -> Annotated[bool | None, Shown("holds ours")]:
        """Whether our trial held the object and can be trusted; None without a trial."""
        return None if self.trial is None else self.trial.held and self.trial.trusted

    @property
    def good(self) -> bool:
        """Whether it is proved to be in force closure, and nothing that was asked is against it."""
        closed = [self.closed, *(each.closed for each in self.tests)]
        return all(closed) and self.passed is not False and self.held is not False

    def __repr__(self) -> str:
        told = {True: "closed", False: "open", None: "undecided"}[self.closed]
        return summary("RecordJudgement", self.id, told, contacts=self.contacts)


@declared
class Totals(Declared):
    """Numbers of grasps that were judged by one test."""

    protocol: Annotated[str, Shown("test")]
    grasps: Annotated[Number, Shown("grasps")]
    theirs_passed: Annotated[Number, Shown("passed theirs")]
    """Grasps that passed the published test."""
    ours_held: Annotated[Number, Shown("held ours")]
    """Grasps that held in our trials of the same loads."""
    predicted: Annotated[Number, Shown("predicted to resist")]
    """Grasps that resist the loads according to the analysis."""
    agree: Annotated[Number, Shown("theirs as ours")]
    """Grasps for which the published test and our trials say the same."""


Quartiles: TypeAlias = tuple[float, float, float]


@declared
class TestTotals(Declared):
    """Numbers of records that were judged by one published test."""

    __test__ = False

    protocol: Annotated[str, Shown("test")]
    passed: Annotated[Number, Shown("pass theirs")]
    """Records that pass the test."""
    passed_but_open: Annotated[Number, Shown("of them proved open")]
    """Records that pass, although their contacts are proved not to be in force closure at the
    friction of the test."""
    held_but_failed: Annotated[Number, Shown("fail theirs, hold ours")]
    """Records that our trial held, and that fail the test."""
    passed_but_lost: Annotated[Number, Shown("pass theirs, fail ours")]
    """Records that pass the test, and that our trial did not hold."""


@declared
class RecordTotals(Declared):
    """Numbers of recorded grasps by their verdicts, how deep they stand, and how diverse they are.

    The entropy of joint angles is that of DexGraspNet (see `sim_validate.protocols.diversity`).
    """

    records: Annotated[Number, Shown("records")]
    judged: Annotated[Number, Shown("judged")]
    unjudged: Annotated[Number, Shown("not judged")]
    good: Annotated[Number, Shown("nothing against them")]
    """Records that are not proved open, and pass and hold all that was asked for."""
    closed: Annotated[Number, Shown("in force closure")]
    open: Annotated[Number, Shown("proved open")]
    held: Annotated[Number, Shown("hold ours")]
    """Records that our trial held, and whose negative controls let go."""
    untrusted: Annotated[Number, Shown("trials not trusted")]
    """Records of which a negative control held, although it must let go."""
    tests: Mapping[str, TestTotals]
    """Numbers of each published test, by its name."""
    depth_m: Annotated[Quartiles | None, Shown("depth mm, quartiles", ".2f", MILLI)]
    """Quartiles of how deep hand and object stand in each other [m]."""
    own_depth_m: Annotated[Quartiles | None, Shown("own depth mm, quartiles", ".2f", MILLI)]
    """Quartiles of how deep links of the hand stand in each other [m]."""
    links: Annotated[float | None, Shown("links that touch, median", "g")]
    joint_entropy: Annotated[float | None, Shown("entropy of joints, mean", ".3f")]
    """Mean entropy of the joints' angles; None without a hand."""
    joint_entropy_deviation: Annotated[float | None, Shown("entropy of joints, deviation", ".3f")]
    """Standard deviation of the entropy over joints."""

    @classmethod
    def of(
        cls, records: Sequence[RecordJudgement], unjudged: int, tests: Sequence[str],
        hand: "AboutHand | None",
    ) -> Self:  # fmt: skip
        """Count records by their verdicts."""
        by_hand = [each for each in records if each.joints is not None]
        entropies = None
        if by_hand and hand is not None:
            angles = np.array([each.joints for each in by_hand])
            entropies = joint_entropies(angles, hand.joint_ranges)
        trials = [each.trial for each in records if each.trial is not None]
        return cls(
            records=len(records) + unjudged, judged=len(records), unjudged=unjudged,
            good=sum(each.good for each in records),
            closed=sum(each.closed is True for each in records),
            open=sum(each.closed is False for each in records),
            held=sum(each.held is True for each in records),
            untrusted=sum(not each.trusted for each in trials),
            tests={name: _test_totals(name, records) for name in tests},
            depth_m=_quartiles([each.depth_m for each in records]),
            own_depth_m=_quartiles([each.own_depth_m for each in records]),
            links=float(np.median([each.touching_links for each in by_hand])) if by_hand else None,
            joint_entropy=None if entropies is None else float(entropies.mean()),
            joint_entropy_deviation=None if entropies is None else float(entropies.std()),
        )  # fmt: skip


@declared
class AboutHand(Declared):
    """The hand of recorded grasps."""

    name: str
    sha256: str
    """Hash of the text of its file as it was read, and of the files that this names."""
    joint_names: tuple[str, ...]
    """Names of the j joints, in the order of the file."""
    joint_ranges: Annotated[Array, Shape("j", 2, nan=True), Field(alias="joint_ranges_rad")]
    """Least and largest angle of each joint, (j, 2) [rad]; NaN where it has none."""
    notes: tuple[str, ...]
    """How the hand differs from its file, a sentence each."""


@declared
class RecordedObject(Declared):
    """The object of recorded grasps, at one scale."""

    object: str
    """Object, as records name it."""
    scale: float
    """Factor on the lengths of its mesh."""
    source_sha256: str
    """Hash of its files, or of the built-in mesh."""
    content_sha256: str
    """Hash of its mesh at this scale, as in `Polyhedron.content_sha256`."""
    center_of_mass: Annotated[Point, Field(alias="center_of_mass_m")]
    """Centre of mass in the object's frame, about which torques are taken, (3,) [m]."""
    radius_m: Quantity
    """Largest distance of a vertex from there, by which torques are divided [m]."""
    notes: tuple[str, ...]
    """How it differs from its file, a sentence each."""


@declared
class Judgements(ResultFile):
    """The judgements of an object's grasps by published tests, or of recorded grasps."""

    FILE = JUDGEMENTS
    SCHEMA = 3

    object: AboutObject | None
    """The object of `judgements`; None where there are records, which name their objects."""
    friction: Friction
    protocols: Mapping[str, PublishedProtocol]
    """The tests, by name."""
    judgements: tuple[Judgement, ...]
    complete: bool
    """Whether every grasp that was asked for was judged."""
    records: tuple[RecordJudgement, ...] = ()
    """Recorded grasps, by object and scale."""
    unjudged: Mapping[str, str] = field(default_factory=dict[str, str])
    """Why other recorded grasps could not be judged, by their ids."""
    asked: JudgeSettings | None = None
    """How recorded grasps were judged; None where there are none."""
    hand: AboutHand | None = None
    """The hand of recorded grasps; None where there are only contacts."""
    objects: tuple[RecordedObject, ...] = ()
    """The objects of recorded grasps."""

    def _check_together(self) -> None:
        for each in self.judgements:
            if each.protocol not in self.protocols:
                raise InputError(
                    f"{each.grasp}: expected a test among protocols, got {each.protocol}"
                )

    @computed_field
    @property
    def summary(self) -> Mapping[str, Totals]:
        """For each test the numbers of grasps, by its verdict, ours, and what was predicted."""
        found: dict[str, Totals] = {}
        for name in dict.fromkeys(each.protocol for each in self.judgements):
            own = [each for each in self.judgements if each.protocol == name]
            found[name] = Totals(
                name,
                len(own),
                sum(each.theirs for each in own),
                sum(each.ours.held for each in own),
                sum(each.predicted for each in own),
                sum(each.theirs == each.ours.held for each in own),
            )
        return found

    @computed_field
    @property
    def record_summary(self) -> RecordTotals | None:
        """Numbers of recorded grasps by their verdicts; None where none were asked for."""
        if self.asked is None:
            return None
        return RecordTotals.of(self.records, len(self.unjudged), self.asked.tests, self.hand)


def _test_totals(name: str, records: Sequence[RecordJudgement]) -> TestTotals:
    by_test = [(each, own) for each in records for own in each.tests if own.protocol == name]
    return TestTotals(
        name,
        sum(own.passed for _, own in by_test),
        sum(own.passed and own.closed is False for _, own in by_test),
        sum(each.held is True and not own.passed for each, own in by_test),
        sum(each.held is False and own.passed for each, own in by_test),
    )


def _quartiles(values: Sequence[float | None]) -> Quartiles | None:
    known = [value for value in values if value is not None]
    if not known:
        return None
    low, middle, high = np.quantile(known, (0.25, 0.5, 0.75)).tolist()
    return low, middle, high
