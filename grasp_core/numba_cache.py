"""Makes numba keep loops in a given folder, and load them without what only compiling needs.

A kept loop is machine code, and bitcode that the compiler puts into other loops that call it. Numba
parses the bitcode of each loop that it loads, declares all that it could compile before the first
of them, and imports its own modules whose functions a loop calls. All this takes several times as
long as loading the machine code. Here bitcode is parsed when a loop that calls the kept one is
compiled, numba declares what it can compile when it compiles, and the modules are not kept with the
loop. Otherwise numba's own format and steps are used.
"""

import importlib
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

OBJECT = "object"
"""Numba's word for kept code that is machine code with bitcode beside it."""
STUB = 'define void @"{}"() {{ ret void }}\n'
"""Assembly of a function that only has a name."""


def cache_in(function: Callable[..., Any], folder: Path) -> Any:
    """Return a cache of numba for one function, in a folder whose name says what is current.

    Args:
        function: The function, as Python knows it.
        folder: A folder that holds nothing but what was compiled from the function's module.
    """
    return _functions(folder)(function)


def _locator(folder: Path) -> Any:
    """Make the class that tells numba where code is kept, and what it was made of."""
    caching: Any = importlib.import_module("numba.core.caching")

    class Here(caching._CacheLocator):
        def __init__(self, function: Any, _file: str) -> None:
            self._line = str(function.__code__.co_firstlineno)

        def get_cache_path(self) -> str:
            return str(folder)

        def get_source_stamp(self) -> str:
            return folder.name

        def get_disambiguator(self) -> str:
            return self._line

        @classmethod
        def from_function(cls, function: Any, file: str) -> Any:
            return cls(function, file)

    return Here


def _kept(folder: Path) -> Any:
    """Make the class that turns a compiled loop into what is kept, and back."""
    whole: Any = importlib.import_module("numba.core.caching").CompileResultCacheImpl

    class Kept(whole):
        _locator_classes = (_locator(folder),)

        def reduce(self, cres: Any) -> Any:
            return _reduced(whole.reduce(self, cres))

        def rebuild(self, target_context: Any, payload: Any) -> Any:
            return _rebuilt(partial(whole.rebuild, self), target_context, payload)

    return Kept


@cache
def _functions(folder: Path) -> Any:
    """Make the class that loads loops without declaring all that numba can compile."""
    caching: Any = importlib.import_module("numba.core.caching")
    runtime: Any = importlib.import_module("numba.core.runtime").rtsys

    class KeptFunctions(caching.FunctionCache):
        _impl_class = _kept(folder)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            runtime.initialize(target_context)  # which declaring would have done
            guard: Any = self._guard_against_spurious_io_errors
            with guard():
                return self._load_overload(sig, target_context)

    return KeptFunctions


def _reduced(payload: Any) -> Any:
    """Leave out functions' environments that hold no constants of Python.

    They would only hold the globals of the functions' modules, which machine code never looks into.
    """
    *code, environments = payload
    return (*code, tuple(each for each in environments if each.consts))


def _rebuilt(rebuild: Callable[[Any, Any], Any], target_context: Any, payload: Any) -> Any:
    """Load a kept loop with a stub in the place of its bitcode, which is parsed when it is needed.

    Numba asks the bitcode only for the names that the machine code defines, of which the stub has
    the one that it looks up.

    Args:
        rebuild: Numba's own way.
        target_context: What numba compiles for.
        payload: What was kept: the library's name, kind and code, the function's description, and
            what else numba needs.
    """
    (name, kind, code), described, *rest = payload
    if kind != OBJECT:
        return rebuild(target_context, payload)
    binding: Any = importlib.import_module("llvmlite.binding")
    machine_code, bitcode = code
    stub = binding.parse_assembly(STUB.format(described.llvm_cpython_wrapper_name)).as_bitcode()
    loaded = rebuild(target_context, ((name, kind, (machine_code, stub)), described, *rest))
    whole = cache(lambda: binding.parse_bitcode(bitcode))
    loaded.library._get_module_for_linking = whole
    return loaded
