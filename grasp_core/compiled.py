"""Declares, compiles, keeps and loads inner loops; only this module compiles with numba.

A kernel, `NAME_kernel.py` beside the module `NAME.py`, is plain arithmetic on arrays of programs,
directions or contacts. Kernels are loaded on first use, since numba takes half a second to import.
A result that makes a claim, such as a placement, a closure or a quality, is checked by the module
that asks for it; what fails the check is decided by Clarabel or by nobody. Results that only
say where to search are not checked: spanning quadruples, tilted cones, and bounds on discs, whose
multipliers are checked in compiled code. Tests compare these with reference implementations.

Numba keeps compiled code beside the file that a function says it comes from, and looks only at that
file. A new environment would compile everything again, and a change of one kernel would not be seen
by others that call it. So each kernel's text is copied into a folder of the user, under a name with
a hash of that text, of the texts it takes functions and constants from, and of the versions of what
compiles them, and its functions say that they come from the copy. Constants that a kernel takes
from a module that is no kernel must be literals there, as what that module itself imports is not
looked at. Numba itself looks at the processor.
"""

import hashlib
import importlib
import importlib.util
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, TypeVar

from grasp_core.cache_folders import BYTECODE, cache_folders
from grasp_core.errors import InputError

Loop = TypeVar("Loop", bound=Callable[..., Any])

NUMBA_FAILS = (ImportError, RuntimeError, OSError, ValueError)
"""What numba raises when it is imported with settings that it refuses, or cannot be."""
COPY_HASH_DIGITS = 16
IMPORTED = re.compile(r"^from ((?:grasp_core|scenes)(?:\.\w+)+) import", re.MULTILINE)
"""Pattern of the imports in a kernel's text."""
COMPILERS = ("numba", "llvmlite")
KERNEL_ENDING = "_kernel"
"""Ending of the names of kernels, whose own imports count too."""


def loop(
    division: Literal["python", "numpy"] = "python", *, beside: bool = False, once: bool = False
) -> Callable[[Loop], Loop]:
    """Declare a function that numba compiles on first use and keeps for later processes.

    What other loops call in one place only, `once`, is compiled there, and divides as they do.
    """
    numba: Any = importlib.import_module("numba")
    # what Python runs stays where debuggers look for it, and numba keeps no unoptimized code
    keeps = not numba.config.DISABLE_JIT and int(numba.config.OPT) > 0

    def declared(function: Loop) -> Loop:
        code = function.__code__
        copy = copy_of(function.__module__, code.co_filename) if keeps else None
        if copy is not None:
            function.__code__ = code.replace(co_filename=str(copy))
        return numba.njit(
            function,
            error_model=division,
            nogil=beside,
            cache=copy is not None,
            inline="always" if once else "never",
            no_cfunc_wrapper=True,  # nobody calls a loop from C
        )

    return declared


@cache
def compiled(name: str) -> Any:
    """Load a kernel module."""
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
    """Return whether later processes find a function compiled, too, or Python runs it as it is."""
    if not hasattr(function, "stats"):
        return "interpreted"
    return "kept" if function.stats.cache_path else "not kept"


def is_kept(module: str) -> bool:
    """Return whether loops of a kernel are kept already, or cannot be kept or compiled at all."""
    found = importlib.util.find_spec(module)
    try:
        copy = None if found is None else copy_of(module, str(found.origin))
    except NUMBA_FAILS:  # whoever needs the kernel is told so
        return True
    if copy is None:
        return True
    # below the copy's folder, or beside it where NUMBA_CACHE_DIR is set
    folder = copy.parent
    for top in folder.parent.glob(f"{folder.name}*"):
        # a walk passes over folders that other processes remove meanwhile, and a glob does not
        for _, below, names in os.walk(top):
            if any(name.startswith(f"{copy.stem}.") and name.endswith(".nbi") for name in names):
                return True
            below[:] = [name for name in below if name != BYTECODE]
    return False


@cache
def copy_of(module: str, path: str) -> Path | None:
    """Copy a module's text to where its compiled code is kept; None if nothing can be written."""
    name = f"{module}-{_stamp(module, Path(path))}.py"
    for folder in folders(Path(path)):
        try:
            # made even where a copy is there, to see that numba can write
            with _written_to(folder) as own:
                if not (folder / name).exists():
                    written = shutil.copyfile(path, own / name)
                    written.replace(folder / name)
        except OSError:
            continue
        return folder / name
    return None


@contextmanager
def _written_to(folder: Path) -> Generator[Path]:
    """Yield a folder of its own for the block in a folder, which is made if needed."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as own:
        yield Path(own)


def why_not_kept() -> str:
    """Say why no folder keeps compiled loops, with the faults of all; empty if one does.

    It is also empty where numba is told to compile nothing.
    """
    faults = list[str]()
    for folder in folders(Path(__file__)):
        try:
            with _written_to(folder):
                return ""
        except OSError as error:
            faults.append(f"{folder}: {error.strerror}")
    compiles = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")
    return "; ".join(faults) if compiles else ""


def folders(path: Path) -> Iterator[Path]:
    """Yield folders that may keep compiled loops: a chosen one, the user's, or the module's."""
    yield from cache_folders()
    yield path.parent / "__pycache__"


def _stamp(module: str, path: Path) -> str:
    """Hash the texts of a module and of those it takes from, and the versions that matter."""
    texts, ahead = {module: path.read_text(encoding="utf-8")}, [module]
    while ahead:
        for name in IMPORTED.findall(texts[ahead.pop()]):
            if name not in texts:
                texts[name] = _text(name)
                if name.endswith(KERNEL_ENDING):
                    ahead.append(name)
    parts = (*sorted(texts.items()), sys.implementation.cache_tag, *map(version, COMPILERS))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:COPY_HASH_DIGITS]


@cache
def _text(module: str) -> str:
    """Read a module's text; of the modules, only the folders above it are imported."""
    found = importlib.util.find_spec(module)
    return Path(str(found and found.origin)).read_text(encoding="utf-8")
