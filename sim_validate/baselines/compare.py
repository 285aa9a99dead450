"""Compares two baselines: each grasp is the same, better, worse, or not comparable.

With the same versions, on processors that round alike, results are the same, and every difference
counts. With the same versions and other rounding, results differ by rounding, which the searches of
the simulation enlarge to their step size. With other versions verdicts must be the same, except for
grasps so close to their critical friction that tiny changes decide, and numbers may differ within
wider tolerances, called bands. Where the part has changed and grasps were carried over to it, the
bands are wide enough for what no user would call better or worse.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import radians
from typing import Annotated, Any, cast

from grasp_core.declared import Declared, declared
from grasp_core.figures import Compared, Shown, Worse, compared, figure, unit_of
from grasp_core.files.records import UNRECORDED, record_of
from grasp_core.transferring.transfer import FRICTION_BAND
from sim_validate.baselines.baseline import BASELINE_DIGITS, Baseline, KeptGrasp
from sim_validate.engine.held_or_let_go import LET_GO, Outcome

DIGITS_OF_CHANGE = 2
LEAST_DIGITS = 4
DECISIVE = ("graspproof", "mujoco", "machine")
UNCOMPARED_VERSION = "python"


@dataclass(frozen=True, slots=True)
class Bands:
    """Tolerances: how far results may differ from a baseline without counting as changed."""

    predicted: float
    """Tolerance of predicted critical frictions, wrench limits and first slips, relative to the
    baseline's."""
    simulated: float
    """Tolerance of simulated critical frictions, wrench limits and first slips, relative to the
    baseline's."""
    least: float
    """Differences of critical frictions and wrench limits that never count; critical frictions are
    proved to 1e-7."""
    length_m: float
    angle_rad: float
    grey: float
    """Relative distance between friction and critical friction within which a grasp may change its
    verdict."""
    exact: bool
    """Whether exactly the same repeats with noise must hold; otherwise repeats with a load close to
    the limit may change."""
    friction: float = 0.0
    same_part: bool = True
    """Whether the part is the same; on another one, other negative controls may exist."""

    def of(self, name: str, how: Compared, before: float) -> float:
        """Return how far a number may be from what it was; motions by the units of their names."""
        unit = unit_of(name)
        if unit in ("m", "rad"):
            return self.length_m if unit == "m" else self.angle_rad
        share = self.predicted if how.analysed else self.simulated
        return share * abs(before) + (self.least + self.friction * how.friction)


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between two verdicts on a grasp."""

    text: str
    worse: bool
    counts: bool = True
    of_holding: bool = False
    """Whether the difference follows from wrenches that are now held or no longer held."""


def differences(one: KeptGrasp, other: KeptGrasp, bands: Bands) -> tuple[Difference, ...]:
    """List every difference between two verdicts on a grasp, and between its executions."""
    found = [*differing_figures(one.verdict, other.verdict, bands)]
    if one.execution is not None and other.execution is not None:  # else the settings differ
        ran = one.execution.ran and other.execution.ran
        executed = differing_figures(one.execution, other.execution, bands, numbers=ran)
        found += [replace(each, text=f"execution: {each.text}") for each in executed]
    return tuple(found)


def differing_figures(
    one: Declared, other: Declared, bands: Bands, *, numbers: bool = True
) -> Iterator[Difference]:
    """Compare two records of a class as their class declares it.

    A part that one of them lacks has no items. Measured `numbers` are left out where only one of
    them has any, which other figures say.
    """
    listed = compared(type(one))
    flips = sum(
        len({*(each.of(one) or ())} ^ {*(each.of(other) or ())})
        for each in listed
        if each.compared and each.compared.items and each.compared.follows
    )
    for each in listed:
        how, before, after = each.compared, each.of(one), each.of(other)
        if each.lacking(one):
            before = type(after)()
        if each.lacking(other):
            after = type(before)()
        if how is None or how.worse is None or _same(before, after):
            continue
        near = [close.of(record) for close in listed if close.name == how.close
                for record in (one, other)]  # fmt: skip
        if how.items is not None:
            close = set[Any]() if bands.exact else {item for items in near for item in items}
            yield from _of_items(how, before, after, close)
        elif isinstance(before, float) or isinstance(after, float):
            aside = bands.grey > 0.0 and any(near)
            band = math.inf if aside else bands.of(each.name, how, before or 0.0)
            if numbers:
                text, worse, counts = _of_number(before, after, band, how.worse)
                yield Difference(f"{each.called}: {text}", worse, counts, how.follows)
        else:
            count = isinstance(before, int) and not isinstance(before, bool)
            yield Difference(
                f"{each.called}: {_said(before)} -> {_said(after)}",
                worse=how.worse(before, after),
                counts=bands.same_part or not how.of_part,
                of_holding=how.follows and not (count and abs(after - before) > flips),
            )


def _same(before: Any, after: Any) -> bool:
    return before == after or (_is_nan(before) and _is_nan(after))


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else f"{value}"


def _of_items(
    how: Compared, before: Sequence[Any], after: Sequence[Any], close: set[Any]
) -> Iterator[Difference]:
    """Compare two lists of what went wrong; changes of `close` items alone do not count."""
    came = [item for item in after if item not in before]
    went = [item for item in before if item not in after]
    for words, items, worse in zip(how.items or (), (came, went), (True, False), strict=True):
        if items:
            text = f"{words}: {', '.join(map(str, items))}"
            yield Difference(text, worse, bool({*items} - close), how.follows)


def _of_number(
    before: float | None, after: float | None, band: float, worse: Worse
) -> tuple[str, bool, bool]:
    """Say how a number differs, whether that is worse, and whether it counts.

    A number that is no longer measured is worse, and each change from or to infinity counts.
    """
    if before is None or after is None or _is_nan(before) or _is_nan(after):
        return f"{before} -> {after}", after is None or _is_nan(after), True
    if math.isinf(before) or math.isinf(after):
        return f"{before} -> {after}", worse(before, after), True
    change = _change(before, after, band)
    return change, worse(before, after), abs(after - before) > band


def _change(before: float, after: float, band: float) -> str:
    """Write a number before and after, to two digits of what changed, and its band."""
    change, largest = after - before, max(abs(before), abs(after))
    digits = math.ceil(math.log10(largest / abs(change))) + DIGITS_OF_CHANGE
    digits = min(max(digits, LEAST_DIGITS), BASELINE_DIGITS)
    share = f"{100.0 * change / before:+.2g} %, " if before > 0.0 else ""
    return f"{before:.{digits}g} -> {after:.{digits}g} ({share}band {band:.2g})"


class Status(StrEnum):
    """How a grasp has changed since the baseline."""

    SAME = "same"
    WITHIN = "within bands"
    GREY = "grey zone"
    """The verdict differs, on a grasp too close to its critical friction for a sure result."""
    IMPROVED = "improved"
    REGRESSED = "regressed"
    NOT_COMPARABLE = "not comparable"
    MISSING = "missing"
    NEW = "new"
    GONE = "gone"
    """The part has changed, and the grasp does not exist on it: a contact has no place, or the
    contacts are no longer in force closure."""


FAILING = (Status.REGRESSED, Status.MISSING, Status.NEW, Status.GONE)


def failing(*, strict: bool) -> tuple[Status, ...]:
    """List the statuses that fail a check besides "not comparable"; strict adds "improved"."""
    return (*FAILING, Status.IMPROVED) if strict else FAILING


WORDS = {
    Status.SAME: "same", Status.WITHIN: "same", Status.GREY: "same", Status.IMPROVED: "better",
    Status.REGRESSED: "worse",
}  # fmt: skip
EXACT_BANDS = Bands(
    predicted=1e-9, simulated=1e-9, least=0.0, length_m=1e-7, angle_rad=1e-6,
    grey=0.0, exact=True,
)  # fmt: skip
"""Bands for the same versions and rounding: the rounding of written numbers, and motions that are
only the settling of contacts, of some 1e-8 m and 1e-6 rad, which say nothing about a grasp."""
OTHER_PROCESSOR = Bands(
    predicted=1e-6, simulated=5e-3, least=1e-7, length_m=1e-6, angle_rad=1e-5,
    grey=1e-4, exact=True,
)  # fmt: skip
"""Tolerances for the same versions with other rounding. With linear algebra for another processor,
or without compiled loops, no verdict of sixty grasps changed. Predicted limits agreed to nine
digits, critical frictions to 5e-9, motions of some 1e-8 m to .6 %, and results of bisection to two
steps of .13 %."""
OTHER_VERSIONS = Bands(
    predicted=0.05, simulated=0.05, least=1e-7, length_m=2e-4, angle_rad=radians(0.2),
    grey=0.02, exact=False,
)  # fmt: skip
OTHER_PART = replace(OTHER_VERSIONS, same_part=False)
"""Bands for a changed part: to these, `FRICTION_BAND` of the friction is added for critical
frictions, as in `grasp_core.transferring.transfer`."""


@dataclass(frozen=True, slots=True)
class Carried:
    """What a comparison must know of a part that has changed since its grasps were planned."""

    change: str
    gone: Mapping[str, str]


@declared
class Finding(Declared):
    """How one grasp has changed since the baseline."""

    id: Annotated[str, Shown("grasp")]
    status: Annotated[Status, Shown("status")]
    reasons: tuple[str, ...] = ()
    differences: tuple[str, ...] = ()
    beyond: Annotated[tuple[str, ...], UNRECORDED] = ()
    """Those of the differences that are beyond their bands."""
    before: KeptGrasp | None = None
    after: KeptGrasp | None = None

    @property
    def further(self) -> tuple[str, ...]:
        """The differences beyond their bands that are no reason for the status."""
        return tuple(text for text in self.beyond if text not in self.reasons)

    @figure
    def why(self) -> Annotated[str, Shown("why")]:
        """The reasons, and further differences beyond their bands."""
        return "; ".join([*self.reasons, *self.further])


def bands_between(
    before: Baseline, after: Baseline, carried: Carried | None = None
) -> tuple[Bands, str]:
    """Choose the tolerances within which results may differ, and say in words why."""
    if carried is not None and _is_other_part(before, after):
        bands = replace(OTHER_PART, friction=FRICTION_BAND * before.friction)
        return bands, "with the bands of a changed part"
    names = sorted({*before.versions, *after.versions} - {UNCOMPARED_VERSION})
    changed = [name for name in names if before.versions.get(name) != after.versions.get(name)]
    others = [
        f"{name} {before.versions.get(name)} -> {after.versions.get(name)}" for name in changed
    ]
    if any(name in DECISIVE for name in changed):
        return OTHER_VERSIONS, f"with the bands of other versions: {', '.join(others)}"
    if others or before.arithmetic != after.arithmetic:
        why = ", ".join(others) or "another processor"
        return OTHER_PROCESSOR, f"with the bands of rounding: {why}"
    return EXACT_BANDS, "exactly"


def compare(
    before: Baseline, after: Baseline, refused: Mapping[str, str] | None = None,
    carried: Carried | None = None,
) -> tuple[Finding, ...]:  # fmt: skip
    """Compare each grasp of two baselines, sorted by id."""
    bands, _ = bands_between(before, after, carried)
    other_part = _is_other_part(before, after)
    changed = tuple(_changed(before, after, carried))
    moved = carried.change if carried is not None and other_part else None
    old = {entry.id: entry for entry in before.entries}
    new = {entry.id: entry for entry in after.entries}
    refused = refused or {}
    gone: Mapping[str, str] = {} if carried is None else carried.gone
    found = list[Finding]()
    for name in sorted({*old, *new, *refused, *gone}):
        one, other = old.get(name), new.get(name)
        if name in gone:
            found.append(_gone(name, one, gone[name], changed, moved))
        elif one is not None and other is not None:
            found.append(_compared(one, other, before.friction, bands, changed, moved))
        else:
            status, why = Status.MISSING, ("in the baseline, but not among the grasps",)
            if name in refused:
                status = Status.NOT_COMPARABLE if changed else Status.REGRESSED
                why = (*changed, f"refused: {refused[name]}")
            elif other_part and carried is None:
                status, why = Status.NOT_COMPARABLE, changed
            elif one is None:
                status, why = Status.NEW, ("not in the baseline",)
            found.append(Finding(name, status, why, before=one, after=other))
    return tuple(found)


def _is_other_part(before: Baseline, after: Baseline) -> bool:
    return before.object.content_sha256 != after.object.content_sha256


def _changed(before: Baseline, after: Baseline, carried: Carried | None) -> Iterator[str]:
    if carried is None and _is_other_part(before, after):
        one, other = before.object.name, after.object.name
        again = (
            f"{one} has another shape than in the baseline; write the baseline again "
            "with --grasp-bless if that is meant"
        )
        yield f"the object is another one: {again if one == other else f'{one} -> {other}'}"
    if before.friction != after.friction:
        yield f"friction: {before.friction} -> {after.friction}"
    if before.planned_radius_m != after.planned_radius_m:
        radii = f"{before.planned_radius_m} -> {after.planned_radius_m}"
        yield f"fingertips that were planned for: radius_m {radii}"
    yield from _settings_changed("", record_of(before.settings), record_of(after.settings))


def _settings_changed(where: str, before: Any, after: Any) -> Iterator[str]:
    before, after = _by_name(before), _by_name(after)
    if isinstance(before, dict) and isinstance(after, dict):
        one, other = cast("dict[str, Any]", before), cast("dict[str, Any]", after)
        for name in sorted({*one, *other}):
            inside = f"{where}.{name}" if where else name
            yield from _settings_changed(inside, one.get(name), other.get(name))
    elif before != after:
        yield f"{where}: {before} -> {after}"


def _by_name(value: Any) -> Any:
    items = cast("list[Any]", value if isinstance(value, list) else [None])
    if not all(isinstance(item, dict) for item in items):
        return cast("Any", value)
    return {item["name"]: item["wrench"] for item in items}


def _gone(
    name: str, one: KeptGrasp | None, why: str, changed: tuple[str, ...], moved: str | None
) -> Finding:
    """Judge a grasp that does not exist on the part, which has moved since the baseline or not.

    That is no change if it did not exist either when the baseline was recorded.
    """
    if moved is None and one is None:
        return Finding(name, Status.SAME, (f"gone, as it was: {why}",))
    if changed:
        return Finding(name, Status.NOT_COMPARABLE, (*changed, why), before=one)
    return Finding(name, Status.GONE, (why,) if moved is None else (why, moved), before=one)


def _compared(
    one: KeptGrasp, other: KeptGrasp, friction: float, bands: Bands, changed: tuple[str, ...],
    moved: str | None,
) -> Finding:  # fmt: skip
    every = differences(one, other, bands)
    texts = tuple(each.text for each in every)
    beyond = tuple(each.text for each in every if each.counts)
    if moved is None and one.contacts_sha256 != other.contacts_sha256:
        changed = (*changed, "the contacts are others")
    if changed:
        return Finding(one.id, Status.NOT_COMPARABLE, changed, texts, beyond, one, other)
    brink = abs(friction - one.verdict.predicted_critical_friction) <= bands.grey * friction
    outcomes = [entry.verdict.outcome for entry in (one, other)]
    decided = all(outcome in (Outcome.HELD, *LET_GO) for outcome in outcomes)
    grey = brink and decided and one.held != other.held
    counting = [each for each in every if each.counts and not (grey and each.of_holding)]
    if any(each.worse for each in counting):
        status = Status.REGRESSED
    elif grey:
        status = Status.GREY
    elif counting:
        status = Status.IMPROVED
    else:
        status = Status.SAME if one == other else Status.WITHIN
    reasons = tuple(each.text for each in counting if each.worse is (status is Status.REGRESSED))
    if status is Status.GREY:
        reasons = (f"{' -> '.join(outcomes)}, at its critical friction",)
    if moved is not None:
        reasons = (f"{WORDS[status]} on the changed part: {moved}", *reasons)
    return Finding(one.id, status, reasons, texts, beyond, one, other)
