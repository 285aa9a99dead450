"""Starts the `graspproof` command, and sees to it that bytecode is kept.

Python keeps the bytecode of a module beside it. Where it must not (PYTHONDONTWRITEBYTECODE is set
in many containers) or cannot, and whoever installed the packages has not compiled them either,
every start would compile some 700 modules, for half of the time of a plan. Then bytecode is kept
where compiled loops are, for this process and those that it starts.

What is imported here has no bytecode in this case, so it is as little as possible.
"""

import os
import sys
from contextlib import suppress
from importlib.util import cache_from_source, find_spec

from grasp_core.cache_folders import BYTECODE, cache_folders

PROBES = ("sim_validate.run", "tyro", "numpy", "scipy", "numba", "mujoco")
"""Modules whose bytecode is looked for, to tell whether that of all others is kept."""
NEVER, INSTEAD = "PYTHONDONTWRITEBYTECODE", "PYTHONPYCACHEPREFIX"


def run_and_exit() -> None:
    """Run the command with the arguments of the command line, and end with its exit code."""
    keep_bytecode()
    from sim_validate.main import run_and_exit as run

    run()


def keep_bytecode() -> None:
    """Have bytecode written to a folder of ours, if it is not kept where it belongs."""
    if sys.pycache_prefix is not None or all(map(_is_kept, PROBES)):
        return
    with suppress(OSError):  # the working folder may be gone, by which a folder is named
        for place in (folder / BYTECODE for folder in cache_folders()):
            with suppress(OSError):
                place.mkdir(parents=True, exist_ok=True)
            if os.access(place, os.W_OK):
                os.environ.pop(NEVER, None)
                sys.dont_write_bytecode = False
                sys.pycache_prefix = os.environ[INSTEAD] = str(place)
                return


def _is_kept(module: str) -> bool:
    """Return whether a module has bytecode beside it, or Python will write it there."""
    found = find_spec(module)
    if found is None or not found.origin or not found.has_location:
        return True
    kept = cache_from_source(found.origin)
    folders = (os.path.dirname(kept), os.path.dirname(found.origin))  # noqa: PTH120 - see above
    folder = next(filter(os.path.isdir, folders))
    return os.path.isfile(kept) or not (  # noqa: PTH113
        sys.dont_write_bytecode or not os.access(folder, os.W_OK)
    )
