"""What produced a result: versions of everything, and how this processor rounds.

Kinds of processors and kinds of code differ in the last digits.
"""

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from grasp_core.compiled import compiled

PACKAGES = (
    "graspproof", "mujoco", "numpy", "scipy", "manifold3d", "highspy", "numba",
    "clarabel", "qpsolvers", "proxsuite",
)  # fmt: skip

SIZES = (3, 6, 12, 24, 64)
"""Of the matrices that are tried."""


def versions() -> dict[str, str]:
    """Versions of everything that can change a number, without importing any of it."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


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
