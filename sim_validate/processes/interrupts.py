"""Records interrupts, so that none is lost.

Some compiled libraries clear errors that are not their own, keyboard interrupts too, and the
program would run on: interrupts are noted, and raised again at the next step. A request to end
(SIGTERM) counts as one.
"""

import signal
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

from grasp_core.stopping import Stop

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_noted = threading.Event()


@contextmanager
def interrupts_noted() -> Generator[None, None, None]:
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


@contextmanager
def interrupts_end(stop: Stop) -> Generator[None, None, None]:
    """Have the first interrupt end work in order, with what is done; the next one is raised."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}

    def note(_: int, __: FrameType | None) -> None:
        stop.now()
        for number, handler in before.items():
            signal.signal(number, handler)

    for number in before:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def check_interrupted() -> None:
    """Raise an interrupt that was recorded, where a library may have swallowed it."""
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt
