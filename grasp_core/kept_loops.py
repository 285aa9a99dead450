"""Chooses where compiled inner loops are kept, so that the next environment finds them.

Numba by itself keeps compiled code beside the installed module. A new environment would compile
everything again, and a change of one kernel would not be seen by others that call it. Here the
folder's name holds a hash of the kernel's text, of the texts it takes functions and constants from,
and of numba's version: what is found there was compiled from these very texts, whatever environment
compiled it. Constants that a kernel takes from a module that is no kernel must be literals there,
as what that module itself imports is not looked at. Numba itself looks at the processor.
"""

import hashlib
import importlib
import importlib.util
import os
import re
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

NUMBA_FAILS = (ImportError, RuntimeError, OSError, ValueError)
"""What numba raises when it is imported with settings that it refuses, or cannot be."""
IMPORTED = re.compile(r"^from (grasp_core(?:\.\w+)+) import", re.MULTILINE)
"""Pattern of the imports in a kernel's text."""
KERNEL = "_kernel"
"""Ending of the names of kernels, whose own imports count too."""
DIGITS = 16
"""Number of digits of the hash in a folder's name."""
OWN = "graspproof"
"""Name of the folder in the user's cache folder."""


def keep(loop: Any, function: Callable[..., Any]) -> None:
    """Let numba keep a loop on disk, and look for it there; without a folder nothing is kept."""
    if not hasattr(loop, "enable_caching"):
        return
    folder = folder_for(function.__module__, function.__code__.co_filename)
    if folder is not None:
        # numba has no public way to give one function a folder of its own
        loop._cache = _kinds()(function, folder)


def is_kept(module: str) -> bool:
    """Return whether loops of a kernel are kept already, or cannot be kept or compiled at all."""
    found = importlib.util.find_spec(module)
    try:
        folder = None if found is None else folder_for(module, str(found.origin))
    except NUMBA_FAILS:  # whoever needs the kernel is told so
        return True
    return folder is None or any(folder.glob("*.nbi"))


@cache
def folder_for(module: str, path: str) -> Path | None:
    """Return the folder that keeps a module's loops; None if none can be written."""
    name = f"{module.rpartition('.')[2]}-{_stamp(module, Path(path))}"
    for folder in folders(Path(path)):
        try:
            (folder / name).mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder / name).close()
        except OSError:
            continue
        return folder / name
    return None


def folders(path: Path) -> Iterable[Path]:
    """Yield folders that may keep compiled loops, best first.

    They are the one that `NUMBA_CACHE_DIR` names, the user's cache folder, and `__pycache__` beside
    the module.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen).absolute()
    dirs: Any = importlib.import_module("numba.misc.appdirs").AppDirs(OWN, appauthor=False)
    users = Path(dirs.user_cache_dir)
    if users.is_absolute():  # without a home it is not
        yield users
    yield path.parent / "__pycache__"


def _stamp(module: str, path: Path) -> str:
    """Hash the text of a module, those of the modules it takes from, and numba's version."""
    digest = hashlib.sha256(importlib.import_module("numba").__version__.encode())
    for name, text in sorted(_texts(module, path).items()):
        digest.update(f"\0{name}\0{text}".encode())
    return digest.hexdigest()[:DIGITS]


def _texts(module: str, path: Path) -> dict[str, str]:
    """Read a module and those it takes from, kernels before others, by their names."""
    found = {module: path.read_text(encoding="utf-8")}
    ahead = [module]
    while ahead:
        for name in IMPORTED.findall(found[ahead.pop()]):
            if name not in found:
                found[name] = _text(name)
                if name.endswith(KERNEL):
                    ahead.append(name)
    return found


@cache
def _text(module: str) -> str:
    """Read a module's text; of the modules, only the folders above it are imported."""
    found = importlib.util.find_spec(module)
    return Path(str(found and found.origin)).read_text(encoding="utf-8")


@cache
def _kinds() -> Callable[[Callable[..., Any], Path], Any]:
    """Make numba's cache look into a given folder, where the folder's name says what is current."""
    caching: Any = importlib.import_module("numba.core.caching")

    def cache_in(function: Callable[..., Any], folder: Path) -> Any:
        class Here(caching._CacheLocator):
            def get_cache_path(self) -> str:
                return str(folder)

            def get_source_stamp(self) -> str:
                return folder.name

            def get_disambiguator(self) -> str:
                return str(function.__code__.co_firstlineno)

            @classmethod
            def from_function(cls, _function: Any, _file: str) -> Any:
                return cls()

        class Kept(caching.CompileResultCacheImpl):
            _locator_classes = (Here,)

            def check_cachable(self, cres: Any) -> bool:
                # as numba's own, which warns of every function: with NUMBA_OPT=0 none is kept
                return not (cres.lifted or cres.library.has_dynamic_globals)

        class KeptFunctions(caching.FunctionCache):
            _impl_class = Kept

        return KeptFunctions(function)

    return cache_in
