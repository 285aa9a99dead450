"""Interrupts that are not lost: what a library swallows is raised again at the next step.

Python raises `KeyboardInterrupt` wherever the program is. Some compiled libraries clear errors that
are not theirs there, and the program would run on. A request to end (SIGTERM) is such an interrupt.
"""

import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_noted = threading.Event()


@contextmanager
def noted() -> Generator[None, None, None]:
    """Note interrupts beside raising them, as long as the context lasts."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python handles signals in its main thread only
        return
    _noted.clear()
    before = {number: signal.signal(number, _note) for number in SIGNALS}
    told, sys.unraisablehook = sys.unraisablehook, _but_interrupts(sys.unraisablehook)
    try:
        yield
    finally:
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, handler)


def _but_interrupts(tell: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Tell of errors that cannot be raised where they are, but of no interrupts: they are noted."""
    return lambda error: None if error.exc_type is KeyboardInterrupt else tell(error)


def _note(_: int, __: FrameType | None) -> None:
    _noted.set()
    raise KeyboardInterrupt


def check() -> None:
    """Raise an interrupt that was noted, for where it may have been swallowed.

    Raises:
        KeyboardInterrupt: There was one.
    """
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt
