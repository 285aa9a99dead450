"""Errors about single values, and how messages show values and places.

Nothing that is slow to import is imported here, since command-line help waits for it.
"""

from collections.abc import Iterable
from numbers import Real
from typing import Any, cast

from grasp_core.errors import InputError

HUGE = 10**100
"""Whole numbers above this are shown by their size: Python does not write the largest ones."""
SHOWN_VALUE = 60
"""Largest number of characters of a refused value that a message shows."""
MILLI, MICRO = 1e3, 1e6
"""Factors of figures that are shown in thousandths and millionths of their units."""


class UnfitError(ValueError):
    """Error of a rule for a value; its text says what the value must be."""


class FieldError(InputError):
    """Error for an argument or a field of the wrong type or size; `name` is its name."""

    owner: type | None = None
    """Class of the field."""

    def __init__(self, name: str, fault: str) -> None:
        super().__init__(name, fault)
        self.name, self.fault = name, fault

    def __str__(self) -> str:
        return f"{self.name} {self.fault}"


def at(where: str, name: str) -> str:
    """Return where a field is that stands in a table or record."""
    return f"{where}.{name}" if where and name else where or name


def near(word: str, known: Iterable[str]) -> str:
    """Ask whether known words are meant that are near a mistyped one; empty if none is near."""
    import difflib  # only mistakes need it

    found = [] if len(word) > SHOWN_VALUE else difflib.get_close_matches(word, list(known))
    return f"did you mean {' or '.join(found)}?" if found else ""


def shown(value: Any) -> str:
    """Write a value for a message: short and on one line; a long value is shown by its kind."""
    if isinstance(value, int) and abs(value) > HUGE:
        return f"a whole number of {value.bit_length()} bits"
    listed = cast("list[Any]", value) if type(value) in {tuple, list} else None
    plain = listed is not None and len(listed) <= SHOWN_VALUE and all(
        isinstance(each, float | None) or (isinstance(each, int) and abs(each) <= HUGE)
        or (isinstance(each, str) and len(each) <= SHOWN_VALUE)
        for each in listed
    )  # fmt: skip
    if plain or isinstance(value, Real | str | type(None)):
        said = repr(value[: SHOWN_VALUE + 1] if isinstance(value, str) else value)
        if len(said) <= SHOWN_VALUE:
            return said
        if isinstance(value, str | Real):
            return f"{said[:SHOWN_VALUE]}..."
    size = getattr(value, "shape", None)
    kind = type(value).__name__
    return f"an array of shape {size}" if isinstance(size, tuple) else f"a value of type {kind}"
