"""Single values checked on the way in: numbers, counts, words, switches, paths and our own values.

Arrays have `arrays`. Nothing heavy is imported here, so that flags can have the same bounds.
"""

import math
from collections.abc import Callable, Iterable
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar, cast

from grasp_core.errors import InputError

Value = TypeVar("Value")

SMALLEST, LARGEST = 1e-9, 1e9
"""Lengths, forces and the like outside are mistakes, in SI units."""
LARGEST_FRICTION = 1e3
"""Coefficients above this are reported as infinite, and refused; no material comes near it."""
MOST_COUNT = 10**9
"""What is to be counted takes longer than anybody waits."""
MOST_SEED = 2**64 - 1
MOST_EDGES = 10_000
"""Of a pyramid in place of a friction cone: it is a circle to seven digits."""
MOST_RANDOM_WRENCHES, MOST_TRIALS = 10_000, 100_000
HUGE = 10**100
"""Whole numbers above are told by their size: Python does not write the largest."""
SHOWN = 60
"""Letters of a refused value in a message."""


def number(  # noqa: PLR0913 - the ways in which a range can end
    value: Any,
    name: str,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    where: str = "",
) -> float:
    """A number in a range; it is finite unless `most` is infinite.

    Args:
        value: Anything.
        name: What to call it in a message.
        above: Largest number that is too small.
        least: Smallest number that is taken.
        below: Smallest number that is too large.
        most: Largest number that is taken.
        where: What the range comes from, for the message.

    Raises:
        InputError: It is no real number, or outside.
    """
    real = not isinstance(value, bool) and isinstance(value, Real)
    size = _as_float(value) if real else math.nan
    inside = math.isfinite(size) if most is None else size <= most
    inside &= (above is None or size > above) and (least is None or size >= least)
    if not (inside and (below is None or size < below)):
        ends = _ends(above=above, least=least, below=below, most=most)
        raise InputError(f"{name} must be a number{ends}{where}, got {shown(value)}")
    return size


def positive(value: Any, name: str) -> float:
    """A length, force or the like of a size that occurs.

    Raises:
        InputError: It is not.
    """
    return number(value, name, least=SMALLEST, most=LARGEST)


def coefficient(value: Any, name: str = "friction") -> float:
    """A Coulomb coefficient above zero.

    Raises:
        InputError: It is not.
    """
    return number(value, name, least=SMALLEST, most=LARGEST_FRICTION)


def whole(value: Any, name: str, *, least: int = 0, most: int = MOST_COUNT) -> int:
    """A whole number from `least` to `most`.

    Raises:
        InputError: It is none.
    """
    integral = not isinstance(value, bool) and isinstance(value, Integral)
    count = int(value) if integral else None
    if count is None or not least <= count <= most:
        raise InputError(
            f"{name} must be a whole number from {least} to {most}, got {shown(value)}"
        )
    return count


def seed_of(value: Any, name: str = "seed") -> int:
    """A seed of random numbers.

    Raises:
        InputError: It is none.
    """
    return whole(value, name, most=MOST_SEED)


def one_of(value: Any, choices: Iterable[str], name: str) -> None:
    """Refuse what is not among some words.

    Raises:
        InputError: It is not.
    """
    known = tuple(choices)
    if not isinstance(value, str) or value not in known:
        raise InputError(f"{name} must be one of {', '.join(known)}, got {shown(value)}")


def switch(value: Any, name: str) -> None:
    """Refuse what is neither true nor false.

    Raises:
        InputError: It is neither.
    """
    if not isinstance(value, bool):
        raise InputError(f"{name} must be True or False, got {shown(value)}")


def text(value: Any, name: str) -> str:
    """Text.

    Raises:
        InputError: It is not.
    """
    if not isinstance(value, str):
        raise InputError(f"{name} must be text, got {shown(value)}")
    return value


def instance(value: Any, kind: type[Value], name: str, remedy: str = "") -> Value:
    """A value of a class.

    Args:
        value: Anything.
        kind: The class.
        name: What to call the value in a message.
        remedy: Where such values come from.

    Raises:
        InputError: It is of another class.
    """
    if not isinstance(value, kind):
        hint = f"; {remedy}" if remedy else ""
        raise InputError(f"{name} must be a {kind.__name__}, got {shown(value)}{hint}")
    return value


def function(value: Any, name: str) -> None:
    """Refuse what cannot be called.

    Raises:
        InputError: It cannot.
    """
    if not callable(value):
        raise InputError(f"{name} must be a function, got {shown(value)}")


def path_of(value: Any, name: str) -> Path:
    """The name of a file or folder.

    Raises:
        InputError: It is no text or path, is empty, or holds a zero byte.
    """
    if not isinstance(value, str | Path):
        raise InputError(f"{name} must be a path, as text or pathlib.Path, got {shown(value)}")
    if not str(value) or "\0" in str(value):
        raise InputError(f"{name} must name a file or folder, got {shown(value)}")
    return Path(value)


def several(value: Any, each: Callable[[Any], Value], name: str, kind: str) -> tuple[Value, ...]:
    """Things in order, each of them checked; text is not taken for its letters.

    Args:
        value: Anything.
        each: Makes such a thing of a value, or refuses it.
        name: What to call the value in a message.
        kind: What the things are.

    Raises:
        InputError: It is no sequence, or `each` refuses one of them.
    """
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InputError(f"{name} must be several {kind}, as a tuple, got {shown(value)}")
    return tuple(each(thing) for thing in cast("Iterable[Any]", value))


def shown(value: Any) -> str:
    """A value in a message: short, on one line, and for what is long its kind."""
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


def _ends(**ends: float | None) -> str:
    words = {"above": "above", "least": "from", "below": "below", "most": "up to"}
    said = [f"{words[name]} {end:g}" for name, end in ends.items()
            if end is not None and not math.isinf(end)]  # fmt: skip
    return "".join(f" {part}" for part in said)
