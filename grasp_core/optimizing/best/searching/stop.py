"""Stops a search after a time, or when asked, on all of its threads."""

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
