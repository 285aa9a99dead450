"""Finds, chooses and tabulates grasps by their ids, families and figures."""

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import (
    Any,
    ClassVar,
    Generic,
    Protocol,
    Self,
    TypeVar,
    cast,
    get_args,
    overload,
)

import numpy as np

from grasp_core.checked import number, one_of, several, shown
from grasp_core.errors import InputError
from grasp_core.values import Grasp, Method

SHOWN_IDS = 5
"""Largest number of ids that a message lists."""
AXES = ("x", "y", "z")
FREE_IDS = "f-"
"""Beginning of the ids of grasps that the free method made, whose family is that of their lines."""


class Named(Protocol):
    """A grasp, or a result about one."""

    @property
    def id(self) -> str:
        """Return the grasp's id."""
        ...


Item = TypeVar("Item", bound=Named)


class ById(Generic[Item]):
    """Base of frozen dataclasses that are sequences of grasps, or of results about them.

    They have a length and an order, and give an item by its place or its id, and a value of their
    own class for a slice. They are true even if empty: that there is no grasp is a result, too.
    """

    __slots__ = ()
    ITEMS: ClassVar[str] = "grasps"
    """Name of the field with the items."""

    def __len__(self) -> int:
        """Return the number of items."""
        return len(self._items)

    def __bool__(self) -> bool:
        """Return True."""
        return True

    def __iter__(self) -> Iterator[Item]:
        """Iterate over the items in their order."""
        return iter(self._items)

    def __contains__(self, wanted: object) -> bool:
        """Return whether there is an item, or an item with an id."""
        if isinstance(wanted, str):
            return any(item.id == wanted for item in self._items)
        return wanted in self._items

    @overload
    def __getitem__(self, key: int | str) -> Item: ...

    @overload
    def __getitem__(self, key: slice) -> Self: ...

    def __getitem__(self, key: int | str | slice) -> Item | Self:
        """Return an item by its place or its id, or a value with some of the items."""
        if isinstance(key, slice):
            return replace(cast("Any", self), **{self.ITEMS: self._items[key]})
        return self._named(key) if isinstance(key, str) else self._items[key]

    @property
    def _items(self) -> tuple[Item, ...]:
        return getattr(self, self.ITEMS)

    def _named(self, wanted: str) -> Item:
        found = next((item for item in self._items if item.id == wanted), None)
        if found is None:
            names = ", ".join(item.id for item in self._items[:SHOWN_IDS]) or "no grasps"
            more = f" and {len(self) - SHOWN_IDS} more" if len(self) > SHOWN_IDS else ""
            raise KeyError(f"no grasp is named {shown(wanted)}; there are {names}{more}")
        return found


@dataclass(frozen=True, slots=True)
class Demands:
    """What a grasp has to be like in order to be chosen; None demands nothing."""

    families: tuple[Method, ...] | None = None
    """Families of which a grasp must have one, or `free` for grasps of the free method."""
    min_radius_m: float | None = None
    """Least radius of the discs in which fingers may stand [m]."""
    min_closure_margin: float | None = None
    max_critical_friction: float | None = None
    min_ferrari_canny_n: float | None = None
    """Least proved lower bound of the quality [N]."""
    where: Callable[[Grasp], bool] | None = None
    """A further test of the user's own."""

    def __post_init__(self) -> None:
        figures = ("min_radius_m", "min_closure_margin", "max_critical_friction")
        for name in (*figures, "min_ferrari_canny_n"):
            if (least := getattr(self, name)) is not None:
                number(least, name)
        if self.where is not None and not callable(self.where):
            raise InputError(
                f"where must be a function of a grasp that gives True or False, got "
                f"{shown(self.where)}"
            )

    def are_met_by(self, grasp: Grasp) -> bool:
        """Return whether a grasp is chosen; only figures that are asked for are computed."""
        most = self.max_critical_friction
        return (
            (self.families is None or any(_is_of(grasp, family) for family in self.families))
            and (self.min_radius_m is None or grasp.radius >= self.min_radius_m)
            and (self.min_closure_margin is None or grasp.closure_margin >= self.min_closure_margin)
            and (most is None or grasp.critical_friction <= most)
            and (
                self.min_ferrari_canny_n is None
                or grasp.ferrari_canny[0] >= self.min_ferrari_canny_n
            )
            and (self.where is None or bool(self.where(grasp)))
        )


def families_of(given: Method | Iterable[Method] | None) -> tuple[Method, ...] | None:
    """Return the families that are asked for, one or several; None where any will do."""
    if given is None:
        return None
    listed = (given,) if isinstance(given, str) else given
    return several(listed, _family, "family", "families")


def _family(given: Any) -> Method:
    one_of(given, get_args(Method), "family")
    return cast("Method", given)


def _is_of(grasp: Grasp, family: Method) -> bool:
    """Return whether a grasp is of a family, by its id where the free method made it."""
    return grasp.id.startswith(FREE_IDS) if family == "free" else grasp.family == family


def data_frame(grasps: Sequence[Grasp]) -> Any:
    """Return a `pandas.DataFrame` with a row for each grasp, indexed by id.

    Columns have the names and units of `grasps.json`: `family`, `radius_m`, `span_angle_deg`,
    `critical_friction`, `closure_margin`, `ferrari_canny_lower_n` and `_upper_n`; for each finger
    `face_0`, its contact `position_0_x_m` and its inward normal `normal_0_x`, and so on.
    """
    return frame_of([_row(grasp) for grasp in grasps], [grasp.id for grasp in grasps])


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


def _row(grasp: Grasp) -> Mapping[str, object]:
    lower, upper = grasp.ferrari_canny
    row: dict[str, object] = {
        "family": grasp.family,
        "radius_m": grasp.radius,
        "span_angle_deg": float(np.degrees(grasp.span_angle)),
        "critical_friction": grasp.critical_friction,
        "closure_margin": grasp.closure_margin,
        "ferrari_canny_lower_n": lower,
        "ferrari_canny_upper_n": upper,
    }
    for finger, face in enumerate(grasp.faces):
        row[f"face_{finger}"] = face
    for finger, contact in enumerate(grasp.contacts):
        for axis, at, along in zip(AXES, contact.position, contact.normal, strict=True):
            row[f"position_{finger}_{axis}_m"] = float(at)
            row[f"normal_{finger}_{axis}"] = float(along)
    return row
