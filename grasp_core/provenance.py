"""Which versions of what produced a result."""

import platform
from importlib.metadata import PackageNotFoundError, version

PACKAGES = (
    "graspproof", "mujoco", "numpy", "scipy", "trimesh", "manifold3d", "highspy", "numba",
    "clarabel", "qpsolvers", "proxsuite",
)  # fmt: skip


def versions() -> dict[str, str]:
    """Versions of everything that can change a number, without importing any of it."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
