"""Compares two baselines: each grasp is the same, better, worse, or not comparable.

With the same versions, on processors that round alike, results are the same, and every difference
counts. With the same versions and other rounding, results differ by rounding, which the searches of
the simulation enlarge to their step size. With other versions verdicts must be the same, except for
grasps so close to their critical friction that tiny changes decide, and numbers may differ within
wider tolerances, called bands. Where the part has changed and grasps were carried over to it, the
bands are wide enough for what no user would call better or worse.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from math import radians
from typing import Any, cast

from grasp_core.transferring.transfer import FRICTION_BAND
from sim_validate.baselines.baseline import DIGITS, Baseline, Entry, ExecutionEntry
from sim_validate.engine.traces import LET_GO, Outcome
from sim_validate.execution.verdict import may_slip

DIGITS_OF_CHANGE = 2
LEAST_DIGITS = 4
DECISIVE = ("graspproof", "mujoco", "machine")
ASIDE = "python"
Rows = tuple[tuple[str, float, float, float], ...]
"""Name, relative and absolute band, and sign of each number: of 1 a larger number is worse."""
PREDICTED = ("load_multiple", "predicted_first_slip")
"""Numbers of an execution that the analysis gives."""


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
    displacement_m: float
    rotation_rad: float
    grey: float
    """Relative distance between friction and critical friction within which a grasp may change its
    verdict."""
    exact: bool
    """Whether exactly the same repeats with noise must hold; otherwise repeats with a load close to
    the limit may change."""
    friction: float = 0.0
    same_part: bool = True
    """Whether the part is the same; on another one, other negative controls may exist."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between two verdicts on a grasp."""

    text: str
    worse: bool
    counts: bool = True
    of_holding: bool = False
    """Whether the difference follows from wrenches that are now held or no longer held."""


def differences(one: Entry, other: Entry, bands: Bands) -> tuple[Difference, ...]:
    """List every difference between two verdicts on a grasp."""
    critical = bands.least + bands.friction
    rows = (
        ("critical_friction", bands.predicted, critical, 1.0),
        ("simulated_critical_friction", bands.simulated, critical, 1.0),
        ("limit_n", bands.predicted, bands.least, -1.0),
        ("simulated_limit_n", bands.simulated, bands.least, -1.0),
        ("displacement_m", 0.0, bands.displacement_m, 1.0),
        ("rotation_rad", 0.0, bands.rotation_rad, 1.0),
    )
    return (
        *_of_wrenches(one, other),
        *_of_controls(one, other, bands),
        *_of_numbers(one, other, rows),
        *_of_repeats(one, other, bands),
        *_of_executions(one.execution, other.execution, bands),
    )


def _of_wrenches(one: Entry, other: Entry) -> Iterator[Difference]:
    lost = [name for name in other.not_held if name not in one.not_held]
    won = [name for name in one.not_held if name not in other.not_held]
    if one.outcome is not other.outcome:
        at = f" at {other.not_held[0]}" if other.not_held else ""
        text = f"{one.outcome} -> {other.outcome}{at}"
        yield Difference(text, worse=not other.held, of_holding=True)
    if lost:
        yield Difference(f"no longer held: {', '.join(lost)}", worse=True, of_holding=True)
    if won:
        yield Difference(f"held now: {', '.join(won)}", worse=False, of_holding=True)
    if one.wrenches != other.wrenches:
        text = f"wrenches: {one.wrenches} -> {other.wrenches}"
        yield Difference(text, worse=other.wrenches < one.wrenches)
    if one.mismatches != other.mismatches:
        more = other.mismatches - one.mismatches
        text = f"contradictions of the analysis: {one.mismatches} -> {other.mismatches}"
        yield Difference(text, more > 0, of_holding=abs(more) <= len(lost) + len(won))


def _of_controls(one: Entry, other: Entry, bands: Bands) -> Iterator[Difference]:
    before, after = (entry.controls - entry.controls_let_go for entry in (one, other))
    if before != after:
        text = f"negative controls that were not let go: {before} -> {after}"
        yield Difference(text, worse=after > before)
    if one.controls != other.controls:
        text = f"negative controls: {one.controls} -> {other.controls}"
        yield Difference(text, worse=other.controls < one.controls, counts=bands.same_part)


def _of_numbers(
    one: Entry | ExecutionEntry, other: Entry | ExecutionEntry, rows: Rows, aside: bool = False
) -> Iterator[Difference]:
    """Compare measured numbers; in executions None is infinite, so more than any number.

    What an execution measures does not count where it is put aside.
    """
    execution = isinstance(one, ExecutionEntry)
    for name, relative, absolute, sign in rows:
        before, after = getattr(one, name), getattr(other, name)
        if before == after:
            continue
        text, counts = f"{before} -> {after}", True
        if before is None or after is None:
            worse = (before if execution else after) is None
        else:
            band = relative * before + absolute
            text, worse = _figures(before, after, band), sign * (after - before) > 0.0
            counts = abs(after - before) > band and not (aside and name not in PREDICTED)
        said = f"execution: {name}: {text}" if execution else f"{name}: {text}"
        holding = not execution and name in ("displacement_m", "rotation_rad")
        yield Difference(said, worse, counts, holding)


def _figures(before: float, after: float, band: float) -> str:
    """Write a number before and after, to two digits of what changed, and its band."""
    change, largest = after - before, max(abs(before), abs(after))
    digits = math.ceil(math.log10(largest / abs(change))) + DIGITS_OF_CHANGE
    digits = min(max(digits, LEAST_DIGITS), DIGITS)
    share = f"{100.0 * change / before:+.2g} %, " if before > 0.0 else ""
    return f"{before:.{digits}g} -> {after:.{digits}g} ({share}band {band:.2g})"


def _of_repeats(one: Entry, other: Entry, bands: Bands) -> Iterator[Difference]:
    """Compare each repeat with the same repeat of the baseline, as both draw the same noise."""
    if one.noisy_trials != other.noisy_trials:
        text = f"repeats with noise: {one.noisy_trials} -> {other.noisy_trials}"
        yield Difference(text, worse=other.noisy_trials < one.noisy_trials)
        return
    close = {*one.noisy_close, *other.noisy_close} if not bands.exact else set[int]()
    before, after = {*one.noisy_not_held}, {*other.noisy_not_held}
    for text, flipped, worse in (("no longer held", after - before, True),
                                 ("held now", before - after, False)):  # fmt: skip
        if flipped:
            numbers = ", ".join(map(str, sorted(flipped)))
            counts = bool(flipped - close)
            yield Difference(f"repeats with noise {text}: {numbers}", worse, counts=counts)


def _of_executions(
    one: ExecutionEntry | None, other: ExecutionEntry | None, bands: Bands
) -> Iterator[Difference]:
    if one is None or other is None:  # then the settings differ, and nothing is comparable
        return
    if one.survived != other.survived:
        said = ["survived" if each.survived else "did not survive" for each in (one, other)]
        yield Difference(f"execution: {said[0]} -> {said[1]}", worse=not other.survived)
    if one.reason != other.reason:
        text = f"execution: {one.reason or 'executed'} -> {other.reason or 'executed'}"
        yield Difference(text, worse=other.reason is not None)
    if lost := [name for name in other.lost if name not in one.lost]:
        yield Difference(f"execution: no longer survived: {', '.join(lost)}", worse=True)
    if won := [name for name in one.lost if name not in other.lost]:
        yield Difference(f"execution: survived now: {', '.join(won)}", worse=False)
    if one.trials != other.trials:
        text = f"execution: trials: {one.trials} -> {other.trials}"
        yield Difference(text, worse=other.trials < one.trials)
    before, after = (entry.controls - entry.controls_let_go for entry in (one, other))
    if before != after:
        text = f"execution: controls that did not slip: {before} -> {after}"
        yield Difference(text, worse=after > before)
    if one.trials and other.trials:
        # how far a contact slides, once it slips, depends on rounding too much to count by itself
        slides = any(may_slip(entry.predicted_first_slip) for entry in (one, other))
        rows = (
            ("load_multiple", bands.predicted, bands.least, -1.0),
            ("predicted_first_slip", bands.predicted, bands.least, -1.0),
            ("simulated_first_slip", bands.simulated, bands.least, -1.0),
            ("slip_m", 0.0, bands.displacement_m, 1.0),
            ("displacement_m", 0.0, bands.displacement_m, 1.0),
            ("turn_rad", 0.0, bands.rotation_rad, 1.0),
        )
        yield from _of_numbers(one, other, rows, aside=slides and bands.grey > 0.0)


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


FAILED = (Status.REGRESSED, Status.MISSING, Status.NEW, Status.GONE)


def failing(*, strict: bool) -> tuple[Status, ...]:
    """List the statuses that fail a check besides "not comparable"; strict adds "improved"."""
    return (*FAILED, Status.IMPROVED) if strict else FAILED


WORDS = {
    Status.SAME: "same", Status.WITHIN: "same", Status.GREY: "same", Status.IMPROVED: "better",
    Status.REGRESSED: "worse",
}  # fmt: skip
EXACT = Bands(
    predicted=1e-9, simulated=1e-9, least=0.0, displacement_m=1e-7, rotation_rad=1e-6,
    grey=0.0, exact=True,
)  # fmt: skip
"""Bands for the same versions and rounding: the rounding of written numbers, and motions that are
only the settling of contacts, of some 1e-8 m and 1e-6 rad, which say nothing about a grasp."""
OTHER_PROCESSOR = Bands(
    predicted=1e-6, simulated=5e-3, least=1e-7, displacement_m=1e-6, rotation_rad=1e-5,
    grey=1e-4, exact=True,
)  # fmt: skip
"""Tolerances for the same versions with other rounding. With linear algebra for another processor,
or without compiled loops, no verdict of sixty grasps changed. Predicted limits agreed to nine
digits, critical frictions to 5e-9, motions of some 1e-8 m to .6 %, and results of bisection to two
steps of .13 %."""
OTHER_VERSIONS = Bands(
    predicted=0.05, simulated=0.05, least=1e-7, displacement_m=2e-4, rotation_rad=radians(0.2),
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


@dataclass(frozen=True, slots=True)
class Finding:
    """How one grasp has changed since the baseline."""

    id: str
    status: Status
    reasons: tuple[str, ...] = ()
    differences: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ()
    """Those of the differences that are beyond their bands."""
    before: Entry | None = None
    after: Entry | None = None


def bands_between(
    before: Baseline, after: Baseline, carried: Carried | None = None
) -> tuple[Bands, str]:
    """Choose the tolerances within which results may differ, and say in words why."""
    if carried is not None and _is_other_part(before, after):
        bands = replace(OTHER_PART, friction=FRICTION_BAND * before.friction)
        return bands, "with the bands of a changed part"
    names = sorted({*before.versions, *after.versions} - {ASIDE})
    changed = [name for name in names if before.versions.get(name) != after.versions.get(name)]
    others = [
        f"{name} {before.versions.get(name)} -> {after.versions.get(name)}" for name in changed
    ]
    if any(name in DECISIVE for name in changed):
        return OTHER_VERSIONS, f"with the bands of other versions: {', '.join(others)}"
    if others or before.arithmetic != after.arithmetic:
        why = ", ".join(others) or "another processor"
        return OTHER_PROCESSOR, f"with the bands of rounding: {why}"
    return EXACT, "exactly"


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
    return before.content_sha256 != after.content_sha256


def _changed(before: Baseline, after: Baseline, carried: Carried | None) -> Iterator[str]:
    if carried is None and _is_other_part(before, after):
        named = f"{before.object} -> {after.object}"
        again = (
            f"{before.object} has another shape than in the baseline; write the baseline again "
            "with --grasp-bless if that is meant"
        )
        yield f"the object is another one: {again if before.object == after.object else named}"
    if before.friction != after.friction:
        yield f"friction: {before.friction} -> {after.friction}"
    if before.planned_radius_m != after.planned_radius_m:
        radii = f"{before.planned_radius_m} -> {after.planned_radius_m}"
        yield f"fingertips that were planned for: radius_m {radii}"
    yield from _settings_changed("", dict(before.settings), dict(after.settings))


def _settings_changed(where: str, before: Any, after: Any) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(after, dict):
        one, other = cast("dict[str, Any]", before), cast("dict[str, Any]", after)
        for name in sorted({*one, *other}):
            inside = f"{where}.{name}" if where else name
            yield from _settings_changed(inside, one.get(name), other.get(name))
    elif before != after:
        yield f"{where}: {before} -> {after}"


def _gone(
    name: str, one: Entry | None, why: str, changed: tuple[str, ...], moved: str | None
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
    one: Entry, other: Entry, friction: float, bands: Bands, changed: tuple[str, ...],
    moved: str | None,
) -> Finding:  # fmt: skip
    every = differences(one, other, bands)
    texts = tuple(each.text for each in every)
    beyond = tuple(each.text for each in every if each.counts)
    if moved is None and one.contacts_sha256 != other.contacts_sha256:
        changed = (*changed, "the contacts are others")
    if changed:
        return Finding(one.id, Status.NOT_COMPARABLE, changed, texts, beyond, one, other)
    brink = abs(friction - one.critical_friction) <= bands.grey * friction
    decided = all(entry.outcome in (Outcome.HELD, *LET_GO) for entry in (one, other))
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
        reasons = (f"{one.outcome} -> {other.outcome}, at its critical friction",)
    if moved is not None:
        reasons = (f"{WORDS[status]} on the changed part: {moved}", *reasons)
    return Finding(one.id, status, reasons, texts, beyond, one, other)
