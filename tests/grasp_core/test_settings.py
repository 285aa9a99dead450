"""One declaration of a setting: checked in Python, in tables and as flags, in the same words."""

import math
import pickle
from dataclasses import field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pytest
from annotated_types import Interval

from grasp_core.allowed_values import Direction, Vector, ending
from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.messages import FieldError
from grasp_core.settings import CHOSEN, Settings, for_users


@declared
class Inner(Settings):
    share: Annotated[float, Interval(gt=0.0, le=1.0)] = 0.5
    drive: Annotated[Literal["servo", "rigid"], CHOSEN] = "servo"


@declared
class Outer(Settings):
    size_m: float
    count: Annotated[int, Interval(ge=1, le=9)] | None = None
    point_m: Vector = (0.0, 0.0, 0.0)
    down: tuple[Direction, ...] = ()
    time_s: Annotated[float, Interval(gt=0.0, le=math.inf)] = math.inf
    kind: Literal[1, "two"] = 1
    quick: bool = False
    path: Annotated[Path, ending(*(".svg", ".png"))] | None = None
    inner: Inner = field(default_factory=Inner)

    def _check_together(self) -> None:
        if self.quick and self.count is None:
            raise FieldError("quick", "needs a count")
        if self.count is not None and self.count > self.size_m:
            raise InputError("count times size_m is too much")


def test_values_are_kept_in_plain_form():
    kept = Outer(
        np.float32(4.5), np.int64(3), [1, 2, 3], [np.array([0.0, 0.0, -1e-9])], path="a.SVG"
    )
    assert kept == Outer(4.5, 3, (1.0, 2.0, 3.0), ((0.0, 0.0, -1e-9),), path=Path("a.SVG"))
    assert [type(each) for each in (kept.size_m, kept.count, kept.point_m[0])] == [
        float,
        int,
        float,
    ]
    assert repr(kept).startswith("Outer(size_m=4.5, count=3, point_m=(1.0, 2.0, 3.0), down=")
    assert repr(Outer(1.0)) == "Outer(size_m=1.0)"


WRONG = [
    ("size_m", True), ("size_m", "1"), ("size_m", math.nan), ("size_m", math.inf),
    ("size_m", 10**400),
    ("size_m", None), ("count", 0), ("count", 10), ("count", 1.5), ("count", True),
    ("point_m", (0.0, 0.0)), ("point_m", (0.0, math.nan, 0.0)), ("point_m", "abc"),
    ("down", ((0.0, 0.0, 0.0),)), ("down", ((0.0, 0.0, 2e9),)), ("down", 3), ("time_s", 0.0),
    ("time_s", math.nan), ("kind", True), ("kind", "one"), ("kind", 2), ("quick", 1),
    ("path", "a.txt"), ("path", ""), ("path", "a\0.svg"), ("inner", None), ("inner", "share"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_a_wrong_value_is_refused_by_its_name_in_python_and_in_a_table(name, value):
    with pytest.raises(FieldError, match=rf"^{name}(\[\d\])? must be ") as raised:
        Outer(**{"size_m": 1.0, name: value})
    assert raised.value.name.startswith(name)
    assert str(pickle.loads(pickle.dumps(raised.value))) == str(raised.value)  # noqa: S301 - ours
    said = "expected a table" if name == "inner" else "must be "
    with pytest.raises(InputError, match=rf"^part\.{name}(\[\d\])?:? {said}"):
        Outer.of_table({"size_m": 1.0, name: value}, "part")


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, r"part\.size_m: missing"),
        ({"size_m": 1.0, "sise": 2}, "part: no setting is named 'sise'; choose from size_m, count"),
        (
            {"size_m": 1.0, "inner": {"share": 2}},
            r"part\.inner\.share must be a number above 0 up to 1",
        ),
        ({"size_m": 1.0, "inner": {"drive": "rigid"}}, r"part\.inner: no setting .* from share$"),
        ({"size_m": 1.0, "quick": True}, r"part\.quick needs a count"),
        ({"size_m": 1.0, "count": 3}, "^part: count times size_m is too much"),
        ([], "part: expected a table of settings"),
    ],
)
def test_a_wrong_table_is_refused_by_where_it_is_wrong(table, said):
    with pytest.raises(InputError, match=said):
        Outer.of_table(table, "part")


def test_a_table_changes_what_it_names_and_nothing_else():
    usual = Outer(9.0, 3, inner=Inner(0.25, "rigid"))
    assert Outer.of_table({}, usual=usual) == usual
    changed = Outer.of_table({"count": 4, "inner": {"share": 1.0}}, usual=usual)
    assert changed == Outer(9.0, 4, inner=Inner(1.0, "rigid"))
    assert Outer.of_table({"size_m": 2, "inner": {}}) == Outer(2.0)
    assert for_users(Inner) == ("share",)
