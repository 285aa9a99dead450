"""Imports the names of a package on their first use, so that unused ones cost no time.

The stub beside a package's `__init__.py` lists the names, for type checkers and for this module.
"""

import ast
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

PublicNames = tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]
"""The functions `__getattr__` and `__dir__` and the list `__all__` of a package."""


def names_in_stub(package: str, file: str) -> PublicNames:
    """Return what a package needs in order to offer the names that its stub imports."""
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [part for part in stub.body if isinstance(part, ast.ImportFrom)]
    homes = {alias.name: str(part.module) for part in imports for alias in part.names}

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(homes[name]), name)

    return find, lambda: sorted(homes), sorted(homes)
