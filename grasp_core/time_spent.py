"""Counts the processor time of each kind of work, also in processes that work for this one.

Functions and blocks are marked with their kind of work. Time in a mark within another counts there
alone, and time outside all marks is analysis. No result depends on it.
"""

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from threading import Lock
from typing import Literal, get_args

Work = Literal["planning", "analysis", "scenes", "stepping", "files"]
Seconds = Mapping[Work, float]


class TimeSpent:
    """Processor time by kind of work since it was last taken [s]; one thread uses the marks."""

    def __init__(self, clock: Callable[[], float] = time.process_time) -> None:
        self._clock, self._lock = clock, Lock()
        self._doing: Work = "analysis"
        self._counted = 0.0
        self._seconds: dict[Work, float] = dict.fromkeys(get_args(Work), 0.0)

    @contextmanager
    def on(self, work: Work) -> Generator[None]:
        """Count a block, or each call of a function that this decorates, as a kind of work."""
        before = self._turn_to(work)
        try:
            yield
        finally:
            self._turn_to(before)

    def add(self, spent: Seconds) -> None:
        """Add what another process has spent; any thread may do so."""
        with self._lock:
            for work, seconds in spent.items():
                self._seconds[work] += seconds

    def taken(self) -> Seconds:
        """Return the time spent on each kind of work, and begin anew."""
        self._turn_to(self._doing)
        with self._lock:
            taken, self._seconds = self._seconds, dict.fromkeys(self._seconds, 0.0)
        return taken

    def _turn_to(self, work: Work) -> Work:
        """Count the time until now, and begin a kind of work; return the one before."""
        now, before = self._clock(), self._doing
        self.add({before: now - self._counted})
        self._doing, self._counted = work, now
        return before


def in_words(spent: Seconds) -> str:
    """Write times as a line, with their sum."""
    parts = ", ".join(f"{work} {seconds:.2f}" for work, seconds in spent.items())
    return f"time: {sum(spent.values()):.2f} s of processor: {parts}"


TIME_SPENT = TimeSpent()
