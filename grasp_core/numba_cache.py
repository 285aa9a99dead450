"""Makes numba keep loops in a given folder, and load them without what only compiling needs.

A kept loop is machine code, and bitcode that the compiler puts into other loops that call it. Numba
parses the bitcode of each loop that it loads, declares all that it could compile before the first
of them, and imports its own modules whose functions a loop calls. All this takes ten times as long
as loading the machine code. Here bitcode is parsed when a loop that calls the kept one is compiled,
numba declares what it can compile when it compiles, and the modules are not kept with the loop.
Otherwise numba's own format and steps are used.
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
    kept: Any = type("Kept", (_kept(),), {"_locator_classes": (_locator(function, folder),)})
    functions: Any = type("KeptFunctions", (_functions(),), {"_impl_class": kept})
    return functions(function)


def _locator(function: Callable[..., Any], folder: Path) -> Any:
    """Make the class that tells numba where the code of a function is, and what it is made of."""
    caching: Any = importlib.import_module("numba.core.caching")

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

    return Here


@cache
def _kept() -> Any:
    """Make the class that turns a compiled loop into what is kept, and back."""
    whole: Any = importlib.import_module("numba.core.caching").CompileResultCacheImpl

    class Kept(whole):
        def reduce(self, cres: Any) -> Any:
            return _reduced(whole.reduce(self, cres))

        def rebuild(self, target_context: Any, payload: Any) -> Any:
            return _rebuilt(partial(whole.rebuild, self), target_context, payload)

    return Kept


@cache
def _functions() -> Any:
    """Make the class that loads loops without declaring all that numba can compile."""
    caching: Any = importlib.import_module("numba.core.caching")
    runtime: Any = importlib.import_module("numba.core.runtime").rtsys

    class KeptFunctions(caching.FunctionCache):
        def load_overload(self, sig: Any, target_context: Any) -> Any:
            runtime.initialize(target_context)  # which declaring would have done
            guard: Any = self._guard_against_spurious_io_errors
            with guard():
                return self._load_overload(sig, target_context)

    return KeptFunctions


def _reduced(payload: Any) -> Any:
    """Leave out what numba keeps for functions of its own that use no constants of Python.

    That would be their modules' globals, which machine code never looks into.
    """
    *code, environments = payload
    used = [each for each in environments if each.consts or not _of_numba(each)]
    return (*code, tuple(used))


def _of_numba(environment: Any) -> bool:
    return str(environment.globals.get("__name__")).startswith("numba.")


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
