"""Folders that may keep what is compiled once for many processes: inner loops, and bytecode."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

OWN_FOLDER = "graspproof"
BYTECODE = "bytecode"
"""Name of the folder in it for bytecode."""


def cache_folders() -> Iterator[Path]:
    """Yield the folders that the user has chosen, and has: the first that can be written counts."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen).absolute() / OWN_FOLDER
    users = Path(os.environ.get("XDG_CACHE_HOME", ""))
    with suppress(RuntimeError):  # there may be no home
        users = users if users.is_absolute() else Path.home() / ".cache"
    if users.is_absolute():
        yield users / OWN_FOLDER
