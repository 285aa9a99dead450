"""An input that does harm -> a smaller one that does the same."""

import time
from collections.abc import Callable

SECONDS = 20.0
"""For one input: it need not be the smallest."""


def minimised(data: bytes, harmful: Callable[[bytes], bool], seconds: float = SECONDS) -> bytes:
    """Leave out ever shorter pieces while what is left does harm.

    Args:
        data: The input.
        harmful: Whether one does the same harm.
        seconds: To stop after.
    """
    until, size = time.monotonic() + seconds, len(data) // 2
    while size:
        at = 0
        while at < len(data):
            less = data[:at] + data[at + size :]
            if time.monotonic() > until:
                return data
            if harmful(less):
                data = less
            else:
                at += size
        size //= 2
    return data
