"""Tells what produced a result: versions of every package, and how this processor rounds.

Results of different processors, or of compiled and interpreted loops, differ in the last digits.
"""

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from grasp_core.compiled import compiled, state_of

RECORDED_PACKAGES = (
    "graspproof", "mujoco", "numpy", "scipy", "manifold3d", "numba",
    "clarabel", "qpsolvers", "proxsuite",
)  # fmt: skip

MATRIX_SIZES = (3, 6, 12, 24, 64)


def versions() -> dict[str, str]:
    """Look up the version of everything that can change a number, without importing any of it."""
    return dict(_installed())


@cache  # reading them takes as long as a tenth of a validation
def _installed() -> Mapping[str, str]:
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in RECORDED_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


@cache
def arithmetic() -> str:
    """Return a hash of what linear algebra gives here and of whether inner loops are compiled.

    With equal versions, two machines with different hashes give results that differ in their last
    digits. Equal hashes say that products, solutions and inverses of matrices of five sizes agree
    bit for bit, so that nothing is known to make results differ; other sizes are not tried.
    """
    rng = np.random.default_rng(0)
    kernel = compiled("grasp_core.closure.margin_kernel")
    digest = hashlib.sha256(b"" if state_of(kernel.search) == "interpreted" else b"compiled")
    for size in MATRIX_SIZES:
        A: Any = rng.normal(size=(size, size))
        answers: Any = (A @ A.T, np.linalg.solve(A, A[0]), np.linalg.inv(A))
        for answer in answers:
            digest.update(answer.tobytes())
    return digest.hexdigest()
