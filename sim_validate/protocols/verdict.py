"""What published tests, our trials and the analysis say of grasps, as `judgements.json` has it."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field, computed_field

from grasp_core.allowed_values import FLAT, Friction, Measured, Number, OrInfinity, Quantity
from grasp_core.by_value import summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.files.file_kinds import JUDGEMENTS
from sim_validate.files.result_files import AboutObject, ResultFile
from sim_validate.protocols.published import PublishedProtocol


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


@declared
class Judgements(ResultFile):
    """The judgements of an object's grasps by published tests."""

    FILE = JUDGEMENTS
    SCHEMA = 2

    object: AboutObject
    friction: Friction
    protocols: Mapping[str, PublishedProtocol]
    """The tests, by name."""
    judgements: tuple[Judgement, ...]
    complete: bool
    """Whether every grasp that was asked for was judged."""

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
