"""Stops a search after a time, after so many nodes, or when asked, on all of its threads."""

import threading
from collections.abc import Generator
from contextlib import contextmanager


class Stop:
    """Tells threads to stop, after a time or when asked."""

    def __init__(self) -> None:
        self._event = threading.Event()

    def __call__(self) -> bool:
        """Return whether to stop."""
        return self._event.is_set()

    def now(self) -> None:
        """Stop."""
        self._event.set()

    def spend(self, nodes: int) -> None:
        """Take note that a thread has visited so many nodes."""


class StopAfter(Stop):
    """Stops one thread after a number of nodes, which does not depend on the clock."""

    def __init__(self, nodes: int) -> None:
        super().__init__()
        self._left = nodes

    def spend(self, nodes: int) -> None:
        """Count nodes, and stop when there were enough."""
        self._left -= nodes
        if self._left <= 0:
            self.now()


@contextmanager
def stopping(seconds: float | None) -> Generator[Stop]:
    """Yield what stops a search after a time."""
    stop = Stop()
    timer = None if seconds is None else threading.Timer(seconds, stop.now)
    if timer is not None:
        timer.daemon = True
        timer.start()
    try:
        yield stop
    finally:
        if timer is not None:
            timer.cancel()
