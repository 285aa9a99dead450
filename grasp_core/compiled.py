"""Declares, compiles, keeps and loads inner loops; only this module compiles with numba.

A kernel, `NAME_kernel.py` beside the module `NAME.py`, is plain arithmetic on arrays of programs,
directions or contacts. Kernels are loaded on first use, since numba takes half a second to import.
A result that makes a claim, such as a placement, a closure or a quality, is checked by the module
that asks for it; what fails the check goes to a solver such as HiGHS or Clarabel. Results that only
say where to search are not checked: spanning quadruples, tilted cones, and bounds on discs, whose
multipliers are checked in compiled code. Tests compare these with reference implementations.

Compiled code is kept on disk by `kept_loops`, in a folder of the user that other environments with
the same texts find again.
"""

import importlib
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Literal, TypeVar, cast

from grasp_core.errors import InputError
from grasp_core.kept_loops import NUMBA_FAILS, keep

_AWAITED: dict[str, Callable[[], object]] = {}
"""Functions that return when a kernel is compiled elsewhere, by the kernel's name."""
Loop = TypeVar("Loop", bound=Callable[..., Any])


def loop(
    division: Literal["python", "numpy"] = "python", *, beside: bool = False
) -> Callable[[Loop], Loop]:
    """Declare a function that numba compiles on first use and keeps for later processes.

    Where no folder can be written, neither a cache folder of the user nor `__pycache__` beside the
    module, every process compiles the function again.
    """
    numba: Any = importlib.import_module("numba")

    def declared(function: Loop) -> Loop:
        made = numba.njit(function, error_model=division, nogil=beside)
        keep(made, function)
        return cast("Loop", made)

    return declared


def wait_for(kernels: Mapping[str, Callable[[], object]]) -> None:
    """Make the first use of kernels wait, as for another process that compiles them."""
    _AWAITED.clear()
    _AWAITED.update(kernels)


@cache
def compiled(name: str) -> Any:
    """Load a kernel module."""
    if wait := _AWAITED.pop(name, None):
        wait()
    try:
        return importlib.import_module(name)
    except NUMBA_FAILS as error:
        if str(getattr(error, "name", "")).startswith("grasp_core"):
            raise
        raise InputError(
            f"inner loops: expected that numba can be loaded, got: {error}; unset the environment "
            f"variables that begin with NUMBA_, or install numba again"
        ) from error


def state_of(function: Any) -> Literal["kept", "not kept", "interpreted"]:
    """Return whether a function runs compiled by numba, kept on disk or not, or interpreted.

    Gives whether later processes find it compiled, or no folder keeps it, or Python runs it because
    the environment variable NUMBA_DISABLE_JIT says so.
    """
    if not hasattr(function, "stats"):
        return "interpreted"
    return "kept" if function.stats.cache_path else "not kept"
