"""Records interrupts, so that none is lost.

Some compiled libraries clear errors that are not their own, keyboard interrupts too, and the
program would run on: interrupts are noted, and raised again at the next step. A request to end
(SIGTERM) counts as one.
"""

import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

from grasp_core.stopping import Stop

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_noted = threading.Event()


@contextmanager
def interrupts_noted() -> Generator[None]:
    """Record interrupts, besides raising them, while the context is open."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python handles signals in its main thread only
        return
    _noted.clear()
    told = sys.unraisablehook
    # reports errors that cannot be raised where they occur, but interrupts, which are recorded
    sys.unraisablehook = lambda e: None if e.exc_type is KeyboardInterrupt else told(e)
    try:
        with _handled_by(_note):
            yield
    except Exception as error:
        if _noted.is_set():
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = told


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], None]) -> Generator[Callable[[], None]]:
    """Have interrupts handled until the end of the block, or until what is yielded is called."""
    before = {number: signal.signal(number, handler) for number in SIGNALS}

    def restore() -> None:
        for number, earlier in before.items():
            signal.signal(number, earlier)

    try:
        yield restore
    finally:
        restore()


def _note(_: int, __: FrameType | None) -> None:
    _noted.set()
    raise KeyboardInterrupt


@contextmanager
def interrupts_end(stop: Stop) -> Generator[None]:
    """Have the first interrupt end work in order, with what is done; the next one is raised."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(_: int, __: FrameType | None) -> None:
        stop.now()
        restore()

    with _handled_by(end) as restore:
        yield


def check_interrupted() -> None:
    """Raise an interrupt that was recorded, where a library may have swallowed it."""
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt
