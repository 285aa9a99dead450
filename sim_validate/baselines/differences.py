"""Lists the differences between two verdicts on a grasp: which ones count, and which are worse."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from sim_validate.baselines.entries import Entry
from sim_validate.baselines.executions import DIGITS, ExecutionEntry
from sim_validate.execution.verdict import may_slip

DIGITS_OF_CHANGE = 2
"""Number of digits of a difference that the numbers before and after show."""
LEAST_DIGITS = 4
"""Least number of digits of a number that changed."""


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
    """Differences of critical frictions that never count, beside `least`."""
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
    return (
        *_of_wrenches(one, other),
        *_of_controls(one, other, bands),
        *_of_numbers(one, other, bands),
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


def _of_numbers(one: Entry, other: Entry, bands: Bands) -> Iterator[Difference]:
    """Compare the measured numbers; a larger number is worse, except for wrench limits."""
    rows = (
        ("critical_friction", bands.predicted, bands.least + bands.friction, 1.0),
        ("simulated_critical_friction", bands.simulated, bands.least + bands.friction, 1.0),
        ("limit_n", bands.predicted, bands.least, -1.0),
        ("simulated_limit_n", bands.simulated, bands.least, -1.0),
        ("displacement_m", 0.0, bands.displacement_m, 1.0),
        ("rotation_rad", 0.0, bands.rotation_rad, 1.0),
    )
    for name, relative, absolute, sign in rows:
        before, after = getattr(one, name), getattr(other, name)
        if before == after:
            continue
        moved = name in ("displacement_m", "rotation_rad")
        if before is None or after is None:
            yield Difference(f"{name}: {before} -> {after}", after is None, of_holding=moved)
            continue
        change = after - before
        counts = not abs(change) <= relative * before + absolute
        text = f"{name}: {_figures(before, after, relative * before + absolute)}"
        yield Difference(text, sign * change > 0.0, counts=counts, of_holding=moved)


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
    yield from _of_execution_numbers(one, other, bands)


def _of_execution_numbers(
    one: ExecutionEntry, other: ExecutionEntry, bands: Bands
) -> Iterator[Difference]:
    """Compare measured numbers; a first slip of None is infinite, so more than any number.

    How far a contact slides, once it slips, depends on rounding too much to count by itself.
    """
    if not (one.trials and other.trials):
        return
    slides = any(may_slip(entry.predicted_first_slip) for entry in (one, other))
    rows = (
        ("load_multiple", bands.predicted, bands.least, -1.0),
        ("predicted_first_slip", bands.predicted, bands.least, -1.0),
        ("simulated_first_slip", bands.simulated, bands.least, -1.0),
        ("slip_m", 0.0, bands.displacement_m, 1.0),
        ("displacement_m", 0.0, bands.displacement_m, 1.0),
        ("turn_rad", 0.0, bands.rotation_rad, 1.0),
    )
    for name, relative, absolute, sign in rows:
        before, after = getattr(one, name), getattr(other, name)
        if before == after:
            continue
        if before is None or after is None:
            yield Difference(f"execution: {name}: {before} -> {after}", worse=before is None)
            continue
        change = after - before
        moved = name not in ("load_multiple", "predicted_first_slip")
        counts = abs(change) > relative * before + absolute and not (
            slides and moved and bands.grey > 0.0
        )
        figures = _figures(before, after, relative * before + absolute)
        text = f"execution: {name}: {figures}"
        yield Difference(text, sign * change > 0.0, counts=counts)
