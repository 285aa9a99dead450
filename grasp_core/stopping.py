"""Tells long work when to end: after a time, after some steps, or when somebody asks.

The work looks between pieces that take some tenths of a second, and returns what it has found by
then, marked as cut short. Nothing else may depend on a clock.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Literal, TypeAlias, TypeVar

Item = TypeVar("Item")
Cut: TypeAlias = Literal["time", "interrupt"]
"""What ended work early: its time is up, or it was interrupted."""


class Stop:
    """The end of some work, which it and its parts share."""

    def __init__(
        self, nodes: float = math.inf, seconds: float | None = None, whole: "Stop | None" = None
    ) -> None:
        self.asked = False
        self._left, self._whole = nodes, whole
        self._end = math.inf if seconds is None else time.monotonic() + seconds

    def __call__(self) -> bool:
        """Return whether to stop."""
        return (
            self.asked
            or self._left <= 0
            or time.monotonic() >= self._end
            or (self._whole is not None and self._whole())
        )

    @property
    def why(self) -> Cut:
        """Return what ends the work, once something does."""
        whole = self._whole
        return "interrupt" if self.asked or (whole and whole.why == "interrupt") else "time"

    def now(self) -> None:
        """Stop, because somebody asks."""
        self.asked = True

    def spend(self, nodes: int) -> None:
        """Take note that a thread has visited so many nodes."""
        self._left -= nodes

    def reserve(self, seconds: float) -> None:
        """End earlier, so that there is time for what comes after [s]."""
        self._end -= seconds

    @property
    def left_s(self) -> float:
        """Return the time that is left, or infinity [s]."""
        own = self._end - time.monotonic()
        return max(0.0, own if self._whole is None else min(own, self._whole.left_s))

    def part(self, phases: int) -> "Stop":
        """Return the end of the next of some phases, which share equally what time is left."""
        return Stop(seconds=self.left_s / phases, whole=self)


def never() -> bool:
    """Return False: the stop of work that nothing ends early."""
    return False


def until(stop: Callable[[], bool], items: Iterable[Item]) -> Iterator[Item]:
    """Yield items until told to stop; none is made after that."""
    coming = iter(items)
    while not stop():
        try:
            item = next(coming)
        except StopIteration:
            return
        yield item
