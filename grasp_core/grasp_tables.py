"""Finds grasps, or results about them, by their ids, and makes tables of them."""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar, cast, overload

from grasp_core.errors import InputError
from grasp_core.messages import shown

SHOWN_IDS = 5


class Named(Protocol):
    """A grasp, or a result about one."""

    @property
    def id(self) -> str:
        """Return the grasp's id."""
        ...


NamedItem = TypeVar("NamedItem", bound=Named)


class ById(Generic[NamedItem]):
    """Base of frozen dataclasses that are sequences of grasps or of results; true even if empty."""

    __slots__ = ()
    ITEMS: ClassVar[str] = "grasps"
    """Name of the field with the items."""

    @property
    def _items(self) -> tuple[NamedItem, ...]:
        return getattr(self, self.ITEMS)

    def __len__(self) -> int:
        return len(self._items)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[NamedItem]:
        return iter(self._items)

    def __contains__(self, wanted: object) -> bool:
        return any(wanted in (item.id, item) for item in self._items)

    @overload
    def __getitem__(self, key: int | str) -> NamedItem: ...

    @overload
    def __getitem__(self, key: slice) -> Self: ...

    def __getitem__(self, key: int | str | slice) -> NamedItem | Self:
        """Return an item by its place or its id, or a value with some of the items."""
        if isinstance(key, slice):
            return replace(cast("Any", self), **{self.ITEMS: self._items[key]})
        if not isinstance(key, str):
            return self._items[key]
        found = next((item for item in self._items if item.id == key), None)
        if found is None:
            names = ", ".join(item.id for item in self._items[:SHOWN_IDS]) or "no grasps"
            more = f" and {len(self) - SHOWN_IDS} more" if len(self) > SHOWN_IDS else ""
            raise KeyError(f"no grasp is named {shown(key)}; there are {names}{more}")
        return found


def frame_of(rows: Sequence[Mapping[str, object]], ids: Sequence[str]) -> Any:
    """Return a `pandas.DataFrame` of rows, cells by column, indexed by id."""
    try:
        pandas: Any = importlib.import_module("pandas")
    except ImportError as error:
        raise InputError(
            "to_dataframe: expected that pandas is installed, but it is not; install it with "
            "pip install pandas"
        ) from error
    return pandas.DataFrame(list(rows), index=pandas.Index(list(ids), name="id"))
