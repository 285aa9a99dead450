"""Compiled inner loops are loaded here; each stands beside its module as `NAME_kernel.py`.

A kernel is plain arithmetic on arrays of programs, directions or contacts. A result that makes a
claim, such as a placement, a closure or a quality, is checked by the module that asks for it; that
module has a slower way of its own, the reference, for results that fail the check. Results that
only say where to search are not checked: spanning quadruples, tilted cones, and bounds on discs,
whose multipliers are checked in compiled code. Tests compare these with the reference. The
reference does everything where numba cannot compile or keep kernels, or the environment says
`GRASPPROOF_KERNELS=off`.

Numba keeps a compiled module together with what it calls from others, and looks only at the file
of that module to see whether it changed: after a change of one kernel, remove the files kept for
the others (`*.nbi` and `*.nbc` in `__pycache__`).
"""

import importlib
import os
from functools import cache
from typing import Any

from grasp_core.errors import InputError

SWITCH = "GRASPPROOF_KERNELS"
"""Name of the environment variable; its value `off` leaves everything to the reference."""
SETTINGS = ("on", "off")


@cache
def compiled(name: str) -> Any:
    """Load a kernel module and run its `try_out`; None where kernels are off or do not work.

    Args:
        name: The module's full name, `grasp_core.ROOM.NAME_kernel`.

    Raises:
        InputError: The environment variable is neither `on` nor `off`.
    """
    asked = os.environ.get(SWITCH) or "on"
    if asked not in SETTINGS:
        raise InputError(
            f"environment variable {SWITCH}: expected {' or '.join(SETTINGS)}, or none, got "
            f"{asked!r}; unset it"
        )
    if asked == "off":
        return None
    try:
        failures: Any = importlib.import_module("numba.core.errors")
        kernel: Any = importlib.import_module(name)
    except (ImportError, RuntimeError, OSError, ValueError) as error:  # the last: numba's settings
        if str(getattr(error, "name", "")).startswith("grasp_core"):
            raise
        return None
    try:
        kernel.try_out()
    except (failures.NumbaError, RuntimeError, OSError):
        return None
    return kernel
