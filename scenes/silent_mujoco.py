"""Imports MuJoCo for all who use it, and keeps it from writing and printing.

Its default is to write warnings to MUJOCO_LOG.TXT in the working folder.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

from collections.abc import Iterator
from contextlib import contextmanager

from grasp_core.errors import InputError

try:
    import mujoco  # noqa: TID251 - this is the door
    from mujoco import batch  # noqa: F401, TID251
except (ImportError, RuntimeError, AttributeError, OSError) as error:
    raise InputError(  # importing mujoco looks for graphics, which nothing here needs
        f"MuJoCo cannot be imported ({error}). If MUJOCO_GL names graphics that are missing, "
        "unset it; otherwise install MuJoCo again, a version from 3.17 to 4.x"
    ) from error


@contextmanager
def unlogged() -> Iterator[None]:
    """Keep MuJoCo's warnings from MUJOCO_LOG.TXT and from the console."""
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_file = quiet.logto_console = False
    mujoco.MjLogConfig.set(quiet)
    try:
        yield
    finally:
        mujoco.MjLogConfig.set(before)
