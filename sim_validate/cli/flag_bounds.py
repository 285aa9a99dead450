"""Bounds on the values of command-line flags, written into their types, and checks of them."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, is_dataclass
from itertools import repeat
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from grasp_core.checked import BOUNDS, number
from grasp_core.errors import InputError


class FlagsError(InputError):
    """Error for flags that contradict each other, or an unknown flag in a config file."""


@dataclass(frozen=True, slots=True)
class Bound:
    """A condition on a value, written into a type: `Annotated[int, at_least(1)]`."""

    says: str
    holds: Callable[[Any], bool]

    def __repr__(self) -> str:
        """Return the text by which error messages about types show the bound."""
        return self.says


FINITE = Bound("must be finite", math.isfinite)


def more_than(least: float, *, up_to: float = math.inf) -> Bound:
    """Make a bound for numbers above `least`, up to and including `up_to`."""
    return Bound(f"must be more than {least:g}{_end(up_to)}", lambda value: least < value <= up_to)


def at_least(least: float, *, up_to: float = math.inf) -> Bound:
    """Make a bound for numbers from `least` to `up_to`, both included."""
    return Bound(f"must be at least {least:g}{_end(up_to)}", lambda value: least <= value <= up_to)


def within(name: str) -> Bound:
    """Make the bound of a setting that Python takes as well, from `grasp_core.checked.BOUNDS`."""
    ends = BOUNDS[name]
    words = {"above": "more than", "least": "at least", "below": "less than", "most": "at most"}
    says = ", ".join(f"{words[end]} {value:g}" for end, value in ends.items())

    def holds(value: Any) -> bool:
        try:
            number(value, "", **ends)
        except InputError:
            return False
        return True

    return Bound(f"must be {says}", holds)


def ends_in(*endings: str) -> Bound:
    """Make a bound for paths that end in one of `endings`, in upper or lower case."""
    says = f"must end in {', '.join(endings[:-1])} or {endings[-1]}"
    return Bound(says, lambda path: path.suffix.lower() in endings)


def not_zero(least: float, most: float) -> Bound:
    """Make a bound for vectors: the largest component in size is from `least` to `most`."""
    says = f"must not be zero: the largest part is from {least:g} to {most:g}"
    return Bound(says, lambda vector: least <= max(abs(part) for part in vector) <= most)


def _end(up_to: float) -> str:
    return "" if math.isinf(up_to) else f", at most {up_to:g}"


def check(flags: object) -> None:
    """Check the flags of a command and of its groups against their bounds."""
    for name, kind in get_type_hints(type(flags), include_extras=True).items():
        value = getattr(flags, name)
        if is_dataclass(value):
            check(value)
        for bound, part in _bounded(kind, value):
            if not bound.holds(part):
                flag = "--" + name.replace("_", "-")
                raise InputError(f"{flag} {bound.says}, got {part}")


def _bounded(kind: Any, value: Any) -> Iterator[tuple[Bound, Any]]:
    """Yield each bound in the type of a flag, with the part of the value that it bounds."""
    inner = get_args(kind)
    if value is None:
        return
    if get_origin(kind) is Annotated:
        yield from _bounded(inner[0], value)
        yield from ((bound, value) for bound in inner[1:] if isinstance(bound, Bound))
    elif get_origin(kind) is tuple:
        kinds = repeat(inner[0]) if inner[-1] is Ellipsis else inner
        for part_kind, part in zip(kinds, value, strict=False):
            yield from _bounded(part_kind, part)
    else:
        for choice in inner:
            yield from _bounded(choice, value)
