"""Two baselines -> what became of each grasp: the same, better, worse, or not to be compared.

With the same versions, on processors that round alike, results are the same, and every difference
counts. With the same versions they differ by rounding, which the searches of the simulation turn
into steps of theirs. Otherwise verdicts must be the same, but for grasps close to their critical
friction, which a trifle may decide, and numbers may differ within wider bands.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from math import radians
from typing import Any, cast

from sim_validate.baselines.values import Baseline, Entry
from sim_validate.proportions import differ

DECISIVE = ("graspproof", "mujoco", "machine")
"""Versions that must be the same for results to be the same."""


class Status(StrEnum):
    """What became of a grasp."""

    SAME = "same"
    WITHIN = "within bands"
    """Numbers differ as other versions or processors make them differ."""
    GREY = "grey zone"
    """Another verdict, on a grasp that is too close to its critical friction to tell."""
    IMPROVED = "improved"
    REGRESSED = "regressed"
    NOT_COMPARABLE = "not comparable"
    """Another object, other contacts or settings: there is nothing to compare."""
    MISSING = "missing"
    """In the baseline, but not among the grasps."""
    NEW = "new"
    """Among the grasps, but not in the baseline."""


FAILED = (Status.REGRESSED, Status.MISSING, Status.NEW)


def failing(*, strict: bool) -> tuple[Status, ...]:
    """What fails a check, beside what cannot be compared; if strict, what is better, too."""
    return (*FAILED, Status.IMPROVED) if strict else FAILED


@dataclass(frozen=True, slots=True)
class Bands:
    """How far results of other versions or processors may differ."""

    predicted: float = 0.05
    """Of critical frictions and limits by analysis, relative to the baseline's."""
    simulated: float = 0.05
    """Of those in simulation."""
    least: float = 1e-7
    """Differences of any of these that never count: critical frictions are proved to that."""
    displacement_m: float = 2e-4
    rotation_rad: float = radians(0.2)
    grey: float = 0.02
    """Grasps whose critical friction is closer to the friction than this, relative to it, may
    change their verdict."""
    exact: bool = False
    """Whether as many repeats with noise must hold; else the counts may differ by chance."""


EXACT = Bands(
    predicted=1e-9,
    simulated=1e-9,
    least=0.0,
    displacement_m=1e-12,
    rotation_rad=1e-12,
    grey=0.0,
    exact=True,
)
"""With the same versions and rounding: what is lost in writing numbers down."""
ROUNDING = Bands(
    predicted=1e-6, simulated=5e-3, displacement_m=1e-6, rotation_rad=1e-5, grey=1e-4, exact=True
)
"""With the same versions: with linear algebra for another processor, or without compiled loops, no
verdict of sixty grasps changed, predicted limits were the same to nine digits, critical frictions
to 5e-9, motions of some 1e-8 m to .6 %, and what is sought by halving to two steps of .13 %."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What became of one grasp."""

    id: str
    status: Status
    reasons: tuple[str, ...] = ()
    before: Entry | None = None
    after: Entry | None = None


@dataclass(slots=True)
class _Differences:
    """What is worse and what is better, in words."""

    worse: list[str] = field(default_factory=list[str])
    better: list[str] = field(default_factory=list[str])

    def add(self, text: str, *, worse: bool) -> None:
        (self.worse if worse else self.better).append(text)


def compare(before: Baseline, after: Baseline, bands: Bands = Bands()) -> tuple[Finding, ...]:
    """What became of each grasp, sorted by id.

    Args:
        before: The baseline.
        after: What was measured now.
        bands: For other versions or processors.
    """
    if any(before.versions.get(name) != after.versions.get(name) for name in DECISIVE):
        allowed = bands
    else:
        allowed = EXACT if before.arithmetic == after.arithmetic else ROUNDING
    changed = tuple(_changed(before, after))
    old = {entry.id: entry for entry in before.entries}
    new = {entry.id: entry for entry in after.entries}
    found = list[Finding]()
    for name in sorted(old.keys() | new.keys()):
        one, other = old.get(name), new.get(name)
        if one is None:
            found.append(Finding(name, Status.NEW, ("not in the baseline",), None, other))
        elif other is None:
            reasons = ("in the baseline, but not among the grasps",)
            found.append(Finding(name, Status.MISSING, reasons, one, None))
        else:
            found.append(_compared(one, other, before.friction, changed, allowed))
    return tuple(found)


def _changed(before: Baseline, after: Baseline) -> Iterator[str]:
    """Why two baselines cannot be compared."""
    if before.content_sha256 != after.content_sha256:
        yield f"the object is another one: {before.object} has changed"
    if before.friction != after.friction:
        yield f"friction: {before.friction} -> {after.friction}"
    yield from _settings_changed("", dict(before.settings), dict(after.settings))


def _settings_changed(where: str, before: Any, after: Any) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(after, dict):
        one, other = cast("dict[str, Any]", before), cast("dict[str, Any]", after)
        for name in sorted({*one, *other}):
            inside = f"{where}.{name}" if where else name
            yield from _settings_changed(inside, one.get(name), other.get(name))
    elif before != after:
        yield f"{where}: {before} -> {after}"


def _compared(
    one: Entry, other: Entry, friction: float, changed: tuple[str, ...], bands: Bands
) -> Finding:
    if one.contacts_sha256 != other.contacts_sha256:
        changed = (*changed, "the contacts are others")
    if changed:
        return Finding(one.id, Status.NOT_COMPARABLE, changed, one, other)
    if one.held != other.held and _is_grey(one, friction, bands):
        reason = f"{one.outcome} -> {other.outcome}, at its critical friction"
        return Finding(one.id, Status.GREY, (reason,), one, other)
    found = _Differences()
    _compare_verdicts(one, other, found)
    _compare_numbers(one, other, bands, found)
    _compare_repeats(one, other, bands, found)
    if found.worse:
        return Finding(one.id, Status.REGRESSED, tuple(found.worse), one, other)
    if found.better:
        return Finding(one.id, Status.IMPROVED, tuple(found.better), one, other)
    return Finding(one.id, Status.SAME if one == other else Status.WITHIN, (), one, other)


def _is_grey(entry: Entry, friction: float, bands: Bands) -> bool:
    return abs(friction - entry.critical_friction) <= bands.grey * friction


def _compare_verdicts(one: Entry, other: Entry, found: _Differences) -> None:
    if one.outcome != other.outcome:
        at = f" at {other.first_failure}" if other.first_failure else ""
        found.add(f"{one.outcome} -> {other.outcome}{at}", worse=not other.held)
    for name, text in (("controls_held", "negative controls that held"),
                       ("mismatches", "contradictions of the analysis")):  # fmt: skip
        before, after = getattr(one, name), getattr(other, name)
        if before != after:
            found.add(f"{text}: {before} -> {after}", worse=after > before)


def _compare_repeats(one: Entry, other: Entry, bands: Bands, found: _Differences) -> None:
    """How many repeats with noise held: a count where the draws are the same, else a sample."""
    before, after = one.noisy_held, other.noisy_held
    counts = (before, one.noisy_trials), (after, other.noisy_trials)
    if before != after and (bands.exact or differ(*counts)):
        text = f"held with noise: {before} of {one.noisy_trials} -> {after}"
        found.add(text, worse=after < before)


def _compare_numbers(one: Entry, other: Entry, bands: Bands, found: _Differences) -> None:
    """Numbers that differ by more than they may; a larger one is worse but for limits."""
    rows = (
        ("critical_friction", "predicted", 1.0), ("simulated_critical_friction", "simulated", 1.0),
        ("limit_n", "predicted", -1.0), ("simulated_limit_n", "simulated", -1.0),
        ("displacement_m", "displacement_m", 1.0), ("rotation_rad", "rotation_rad", 1.0),
    )  # fmt: skip
    for name, band, sign in rows:
        before, after = getattr(one, name), getattr(other, name)
        if before is None or after is None:
            if before != after:
                found.add(f"{name}: {before} -> {after}", worse=after is None)
            continue
        relative = band in ("predicted", "simulated")
        allowed = getattr(bands, band) * (abs(before) if relative else 1.0)
        allowed += bands.least if relative else 0.0
        if abs(after - before) > allowed:
            found.add(f"{name}: {before:.12g} -> {after:.12g}", worse=sign * (after - before) > 0.0)
