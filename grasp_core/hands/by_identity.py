"""Keeps what a function found for its last arguments, which are told apart by identity.

A cache that compares large values entry by entry takes longer than the function it saves, where an
equal copy is asked for again and again. Here one look at the argument's address is enough.
"""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

Value = TypeVar("Value")
Result = TypeVar("Result")


def kept_by_identity(
    most: int,
) -> Callable[[Callable[[Value], Result]], Callable[[Value], Result]]:
    """Return a decorator that keeps results for at most so many arguments, and these alive."""

    def decorated(function: Callable[[Value], Result]) -> Callable[[Value], Result]:
        kept: dict[int, tuple[Value, Result]] = {}

        @wraps(function)
        def looked_up(value: Value) -> Result:
            known = kept.get(id(value))
            if known is None:  # a kept argument is alive, so that no other has its address
                known = value, function(value)
                if len(kept) >= most:
                    kept.clear()
                kept[id(value)] = known
            return known[1]

        return looked_up

    return decorated
