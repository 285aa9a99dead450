"""Sends a value that many units of work have in common so that a process rebuilds it only once.

Otherwise each unit would bring its own copy of, say, an object, and what is kept for that object
from one unit to the next would be computed again for each copy.
"""

import pickle
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")
KEPT = 4
"""Number of values that a process keeps."""


class Shared(Generic[Value]):
    """A hashable value that arrives in another process as the one that arrived there before."""

    def __init__(self, value: Value) -> None:
        self.value = value

    def __reduce__(self) -> tuple[Callable[[bytes], "Shared[Any]"], tuple[bytes]]:
        """Pickle the value by itself, so that equal bytes tell that it is the same."""
        return _arrived, (_packed(self.value),)


@lru_cache(maxsize=KEPT)
def _packed(value: object) -> bytes:
    return pickle.dumps(value)


@lru_cache(maxsize=KEPT)
def _arrived(data: bytes) -> Shared[Any]:
    return Shared(pickle.loads(data))  # noqa: S301 - the process that started this one packed it
