"""Two results are compared: value by value, or with what is kept of an earlier one.

What is kept is small, and forgives the last digits of numbers. Of each file: how many texts, whole
numbers, settings and blanks it has, and one hash of them all. Of each field with other numbers x:
how many there are, the largest |x|, and two sums w.x with fixed weights. If every number agrees to
TOLERANCE of the largest, so do the sums, to about sqrt(n) times as much.
"""

import hashlib
import math
import re

import numpy as np

from tests.golden.fields import NUMBER

TOLERANCE = 1e-6
LEAST_SCALE = 1e-6
"""Numbers below it (in metres, newtons, or without a unit) count as noise of this size."""
LOOSER = {
    # processors differ in the last digits, which grow while a control slides and past a slip, and
    # in which of two bounds within the gap a search ends
    re.compile(r"controls\..*(_m|_rad|slip_m.*)$|predicted_loss$"): (5e-2, 1e-5),
    re.compile(r"(displacement_m|rotation_rad|slip_m.*)$"): (1e-4, 1e-5),
    re.compile(r"ferrari_canny"): (1e-4, LEAST_SCALE),
}
"""Tolerances of fields that kept results hold less exactly, and what counts as noise there."""

SETTINGS = re.compile(
    r"settings\.(physics|hold|limit|friction|fingers|flags)|\.physics\.| option\."
)
"""Fields of numbers that are given, not computed: these are exact."""


def kept_of(fields):
    """Return what is kept of the fields of a case: numbers by field, the rest by file."""
    kept, texts = {}, {}
    for name in sorted(fields):
        values = fields[name]
        rough = [value for value in values if _is_rough(value)]
        if SETTINGS.search(name):
            rough = []
        if rough:
            kept[name] = [len(rough), *_sums(np.array(rough))]
        exact = [None if rough and _is_rough(value) else _exact(value) for value in values]
        texts.setdefault(name.partition(" ")[0], []).append((name, exact))
    for file, told in texts.items():
        digest = hashlib.sha256(repr(told).encode()).hexdigest()[:16]
        kept[f"{file}: all texts, whole numbers and settings"] = [
            sum(len(exact) for _, exact in told), digest,
        ]  # fmt: skip
    return kept


def unlike_kept(name, before, now):
    """Say how what is kept of a field differs from what is found; nothing if it does not."""
    if before[0] != now[0]:
        return f"{before[0]} values before, {now[0]} now"
    if len(before) == 2:
        return None if before == now else "something differs; --against a commit says what"
    looser = (value for field, value in LOOSER.items() if field.search(name))
    tolerance, least = next(looser, (TOLERANCE, LEAST_SCALE))
    scale = max(before[1], now[1], least)
    off = max(abs(one - other) for one, other in zip(before[2:], now[2:], strict=True)) / scale
    if off <= tolerance * math.sqrt(before[0]):
        return None
    return f"{before[0]} numbers differ by about {off:.1e} of the largest, {now[1]:.3g}"


def unlike(_, before, now):
    """Say how two lists of values of a field differ; nothing if not a bit does."""
    if len(before) != len(now):
        return f"{len(before)} values before, {len(now)} now"
    pairs = [(one, other) for one, other in zip(before, now, strict=True) if one != other]
    if not pairs:
        return None
    texts = [pair for pair in pairs if not all(map(_is_number, pair))]
    if texts:
        one, other = (str(value)[:60] for value in texts[0])
        return f"{len(pairs)} of {len(now)} differ: {one} before, {other} now"
    scale = max(abs(value) for value in now if _is_number(value)) or 1.0
    off = max(abs(one - other) for one, other in pairs) / scale
    return f"{len(pairs)} of {len(now)} differ, by at most {off:.1e} of the largest, {scale:.3g}"


def differences(before, now, say):
    """Yield how fields differ, with their names, where `say` compares two that both have."""
    for field in sorted(before.keys() | now.keys()):
        if field not in now:
            yield field, "is gone"
        elif field not in before:
            yield field, "is new"
        elif said := say(field, before[field], now[field]):
            yield field, said


def _sums(numbers):
    """Return the largest size of some numbers, and two sums of them with fixed weights."""
    turns = np.arange(1, len(numbers) + 1)[:, None] * [math.sqrt(2), math.sqrt(3)]
    sums = np.cos(turns).T @ numbers
    return [float(f"{each:.8g}") for each in (abs(numbers).max(), *sums)]


def _is_number(value):
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_rough(value):
    """Whether a value is a number that is compared within a tolerance."""
    return isinstance(value, float) and math.isfinite(value)


def _exact(value):
    """Return what must be the same everywhere: messages show rounded numbers, which are not."""
    return NUMBER.sub("#", value) if isinstance(value, str) else str(value)
