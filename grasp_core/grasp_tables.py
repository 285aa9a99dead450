"""Finds, chooses and tabulates grasps by their ids, families and figures."""

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar, cast, get_args, overload

import numpy as np

from grasp_core.errors import InputError
from grasp_core.kinds import Method, function, number, one_of, several, shown
from grasp_core.values import Grasp

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

    @property
    def _items(self) -> tuple[Item, ...]:
        return getattr(self, self.ITEMS)

    def __len__(self) -> int:
        return len(self._items)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[Item]:
        return iter(self._items)

    def __contains__(self, wanted: object) -> bool:
        return any(wanted in (item.id, item) for item in self._items)

    @overload
    def __getitem__(self, key: int | str) -> Item: ...

    @overload
    def __getitem__(self, key: slice) -> Self: ...

    def __getitem__(self, key: int | str | slice) -> Item | Self:
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


def chosen(
    grasps: Sequence[Grasp],
    where: Callable[[Grasp], bool] | None,
    family: Method | Iterable[Method] | None,
    min_radius_m: float | None,
    min_closure_margin: float | None,
    max_critical_friction: float | None,
    min_ferrari_canny_n: float | None,
) -> tuple[Grasp, ...]:
    """Return the grasps that meet all demands; only figures that are asked for are computed."""
    families = None
    if family is not None:
        families = several(
            (family,) if isinstance(family, str) else family, _family, "family", "families"
        )
    for name, bound in (
        ("min_radius_m", min_radius_m),
        ("min_closure_margin", min_closure_margin),
        ("max_critical_friction", max_critical_friction),
        ("min_ferrari_canny_n", min_ferrari_canny_n),
    ):
        if bound is not None:
            number(bound, name)
    if where is not None:
        function(where, "where")

    def meets(grasp: Grasp) -> bool:
        return (
            (families is None or any(_is_of(grasp, each) for each in families))
            and (min_radius_m is None or grasp.radius >= min_radius_m)
            and (min_closure_margin is None or grasp.closure_margin >= min_closure_margin)
            and (max_critical_friction is None or grasp.critical_friction <= max_critical_friction)
            and (min_ferrari_canny_n is None or grasp.ferrari_canny[0] >= min_ferrari_canny_n)
            and (where is None or bool(where(grasp)))
        )

    return tuple(filter(meets, grasps))


def _family(given: Any) -> Method:
    one_of(given, get_args(Method), "family")
    return cast("Method", given)


def _is_of(grasp: Grasp, family: Method) -> bool:
    """Return whether a grasp is of a family, by its id where the free method made it."""
    return grasp.id.startswith(FREE_IDS) if family == "free" else grasp.family == family


def data_frame(grasps: Sequence[Grasp]) -> Any:
    """Return a `pandas.DataFrame` with a row for each grasp, indexed by id.

    Columns are named as in `grasps.json`, with angles in degrees: `family`, `radius_m`,
    `span_angle_deg`, `critical_friction`, `closure_margin`, `ferrari_canny_lower_n` and `_upper_n`;
    for each finger `face_0`, its contact `position_0_x_m`, its inward normal `normal_0_x`, etc.
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
