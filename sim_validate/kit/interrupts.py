"""Keeps keyboard interrupts that a library swallows, and raises them again at the next step.

Python raises `KeyboardInterrupt` wherever the program is. Some compiled libraries clear errors that
are not their own, and the program would run on. A request to end (SIGTERM) counts as an interrupt.
"""

import signal
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_noted = threading.Event()


@contextmanager
def noted() -> Generator[None, None, None]:
    """Record interrupts, besides raising them, while the context is open."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python handles signals in its main thread only
        return
    _noted.clear()
    before = {number: signal.signal(number, _note) for number in SIGNALS}
    told = sys.unraisablehook
    # reports errors that cannot be raised where they occur, but interrupts, which are recorded
    sys.unraisablehook = lambda e: None if e.exc_type is KeyboardInterrupt else told(e)
    try:
        yield
    except Exception as error:
        if _noted.is_set():
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, handler)


def _note(_: int, __: FrameType | None) -> None:
    _noted.set()
    raise KeyboardInterrupt


def check() -> None:
    """Raise an interrupt that was recorded, where a library may have swallowed it."""
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt
