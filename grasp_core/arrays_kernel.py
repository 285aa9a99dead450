"""Copies arrays, compiled for other kernels.

Numba compiles `target[:] = source` together with the text of the error that it raises where shapes
differ, which takes ten times as long as these loops do; shapes are not compared here.
"""

from typing import Any

import numpy as np

from grasp_core.compiled import loop


@loop()
def copy(source: Any, target: Any) -> None:
    """Fill in an array of the same shape."""
    for i in range(source.size):
        target.flat[i] = source.flat[i]


@loop()
def longer(old: Any, room: int) -> Any:
    """Copy an array into the first rows of one with more rows, all others zero."""
    new = np.zeros((room, *old.shape[1:]), old.dtype)
    for i in range(old.size):
        new.flat[i] = old.flat[i]
    return new
