"""Compiled inner loops, and the only place that knows numba.

A kernel is plain arithmetic on arrays of programs, directions or contacts. It decides nothing
alone: the module that asks for it checks what comes back, and has a slower way of its own, the
reference, for what fails the check. The reference does everything where numba cannot compile or
keep kernels, or the environment says `GRASPPROOF_KERNELS=off`.
"""

import importlib
import os
from functools import cache
from typing import Any

SWITCH = "GRASPPROOF_KERNELS"
"""Environment variable; `off` leaves everything to the reference."""


@cache
def compiled(name: str) -> Any:
    """A module of kernels after its `try_out`; None where kernels are not wanted or do not work."""
    if os.environ.get(SWITCH) == "off":
        return None
    try:
        failures: Any = importlib.import_module("numba.core.errors")
        kernel: Any = importlib.import_module(f"grasp_core.kernels.{name}")
    except (ImportError, RuntimeError, OSError):
        return None
    try:
        kernel.try_out()
    except (failures.NumbaError, RuntimeError, OSError):
        return None
    return kernel
