"""How this process rounds: kinds of processors and kinds of code differ in the last digits."""

import hashlib
from functools import cache
from typing import Any

import numpy as np

from grasp_core.compiled import compiled

SIZES = (3, 6, 12, 24, 64)
"""Of the matrices that are tried."""


@cache
def arithmetic() -> str:
    """A hash of what linear algebra gives here, and of whether inner loops are compiled.

    The same where results are the same bit for bit, with the same versions of everything.
    """
    rng = np.random.default_rng(0)
    digest = hashlib.sha256(
        b"" if compiled("grasp_core.closure.critical_friction_kernel") is None else b"compiled"
    )
    for size in SIZES:
        A: Any = rng.normal(size=(size, size))
        answers: Any = (A @ A.T, np.linalg.solve(A, A[0]), np.linalg.inv(A))
        for answer in answers:
            digest.update(answer.tobytes())
    return digest.hexdigest()
