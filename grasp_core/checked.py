"""Checks single values that users pass in: numbers, counts, words, switches, paths, objects.

Arrays are checked in `arrays`. Nothing that is slow to import is imported here, so that
command-line flags can use the same bounds.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar, cast

from grasp_core.errors import InputError

Value = TypeVar("Value")

SMALLEST, LARGEST = 1e-9, 1e9
"""Smallest and largest length, force or similar quantity in SI units: others are mistakes."""
LARGEST_FRICTION = 1e3
"""Largest Coulomb coefficient; no material comes near it. A larger critical friction is reported as
infinite, and a larger input is refused."""
MOST_COUNT = 10**9
"""Largest count accepted: anything larger would take longer than anybody waits."""
MOST_SEED = 2**64 - 1
MOST_EDGES = 10_000
"""Largest number of edges of a pyramid that replaces a friction cone: it equals the cone to seven
digits."""
HUGE = 10**100
"""Whole numbers above this are shown by their size: Python does not write the largest ones."""
SHOWN = 60
"""Largest number of characters of a refused value that a message shows."""


@dataclass(frozen=True, slots=True)
class Range:
    """Ends of a range of numbers; without an upper end numbers must be finite."""

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None

    def holds(self, value: float) -> bool:
        """Return whether a number is in the range."""
        inside = math.isfinite(value) if self.most is None else value <= self.most
        return (
            inside
            and (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.below is None or value < self.below)
        )

    def __str__(self) -> str:
        """Return the ends in words."""
        words = {"above": "above", "least": "from", "below": "below", "most": "up to"}
        ends = {word: getattr(self, name) for name, word in words.items()}
        return " ".join(f"{word} {end:g}" for word, end in ends.items()
                        if end is not None and not math.isinf(end))  # fmt: skip


def number(
    value: Any,
    name: str,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    where: str = "",
) -> float:
    """Check that a value is a number in a range; it is finite unless `most` is infinite."""
    real = not isinstance(value, bool) and isinstance(value, Real)
    size, ends = _as_float(value) if real else math.nan, Range(above, least, below, most)
    if not ends.holds(size):
        said = f"{name} must be a number {ends}".rstrip()
        raise InputError(f"{said}{where}, got {shown(value)}")
    return size


def positive(value: Any, name: str) -> float:
    """Check that a value is a length, force or similar quantity of a plausible size."""
    return number(value, name, least=SMALLEST, most=LARGEST)


def coefficient(value: Any, name: str = "friction") -> float:
    """Check that a value is a Coulomb coefficient above zero."""
    return number(value, name, least=SMALLEST, most=LARGEST_FRICTION)


def whole(value: Any, name: str, *, least: int = 0, most: int = MOST_COUNT) -> int:
    """Check that a value is a whole number from `least` to `most`."""
    integral = not isinstance(value, bool) and isinstance(value, Integral)
    count = int(value) if integral else None
    if count is None or not least <= count <= most:
        raise InputError(
            f"{name} must be a whole number from {least} to {most}, got {shown(value)}"
        )
    return count


def seed_of(value: Any, name: str = "seed") -> int:
    """Check that a value is a seed of random numbers."""
    return whole(value, name, most=MOST_SEED)


def one_of(value: Any, choices: Iterable[str], name: str) -> None:
    """Refuse a value that is not one of the given words."""
    known = tuple(choices)
    if not isinstance(value, str) or value not in known:
        raise InputError(f"{name} must be one of {', '.join(known)}, got {shown(value)}")


def switch(value: Any, name: str) -> None:
    """Refuse a value that is neither True nor False."""
    if not isinstance(value, bool):
        raise InputError(f"{name} must be True or False, got {shown(value)}")


def text(value: Any, name: str) -> str:
    """Check that a value is text."""
    if not isinstance(value, str):
        raise InputError(f"{name} must be text, got {shown(value)}")
    return value


def instance(value: Any, kind: type[Value], name: str, remedy: str = "") -> Value:
    """Check that a value is an instance of a class."""
    if not isinstance(value, kind):
        hint = f"; {remedy}" if remedy else ""
        raise InputError(f"{name} must be a {kind.__name__}, got {shown(value)}{hint}")
    return value


def function(value: Any, name: str) -> None:
    """Refuse a value that cannot be called."""
    if not callable(value):
        raise InputError(f"{name} must be a function, got {shown(value)}")


def path_of(value: Any, name: str) -> Path:
    """Check that a value names a file or folder."""
    if not isinstance(value, str | Path):
        raise InputError(f"{name} must be a path, as text or pathlib.Path, got {shown(value)}")
    if not str(value) or "\0" in str(value):
        raise InputError(f"{name} must be the path of a file or folder, got {shown(value)}")
    return Path(value)


def several(value: Any, each: Callable[[Any], Value], name: str, kind: str) -> tuple[Value, ...]:
    """Check every item of a sequence; a string is refused, not split into letters."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InputError(
            f"{name} must be a sequence of {kind}, such as a tuple, got {shown(value)}"
        )
    return tuple(each(thing) for thing in cast("Iterable[Any]", value))


def shown(value: Any) -> str:
    """Write a value for a message: short and on one line; a long value is shown by its kind."""
    if isinstance(value, int) and abs(value) > HUGE:
        return f"a whole number of {value.bit_length()} bits"
    listed = cast("Iterable[Any]", value) if type(value) in {tuple, list} else None
    plain = listed is not None and all(
        isinstance(each, float | str | None) or (isinstance(each, int) and abs(each) <= HUGE)
        for each in listed
    )
    if plain or isinstance(value, Real | str | type(None)):
        said = repr(value)
        if len(said) <= SHOWN:
            return said
        if isinstance(value, str | Real):
            return f"{said[:SHOWN]}..."
    size = getattr(value, "shape", None)
    kind = type(value).__name__
    return f"an array of shape {size}" if isinstance(size, tuple) else f"a value of type {kind}"


def _as_float(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
