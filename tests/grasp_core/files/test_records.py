import json
import math
from collections.abc import Mapping
from dataclasses import field, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from annotated_types import Len
from pydantic import Field, computed_field

import grasp_core as gc
from grasp_core.allowed_values import (
    FLAT,
    Count,
    Direction,
    Measured,
    OrInfinity,
    Quantity,
    Seed,
    Vector,
)
from grasp_core.arrays import Array, Indices, Point, Shape, UnitVector
from grasp_core.declared import Declared, declared
from grasp_core.files.json_text import json_of
from grasp_core.files.records import UNRECORDED, RecordFile, from_record, record_of
from tests.damaged import check_refused, optional_keys, value_at


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@declared
class Part(Declared):
    point: Annotated[Point, Field(alias="point_m")]
    way: UnitVector
    size: Annotated[Quantity, Field(alias="size_m")] = 1.0

    @computed_field
    @property
    def double_m(self) -> float:
        return 2.0 * self.size

    @computed_field
    @property
    def turned(self) -> UnitVector:
        return -self.way


@declared
class Flat(Declared):
    shift: Vector = (0.0, 0.0, 1.0)
    axis: Direction = (0.0, 0.0, 1.0)


@declared
class Whole(Declared):
    hidden: Annotated[object, UNRECORDED]
    text: str
    word: Literal["a", "b"]
    colour_name: Colour
    path: Path
    on: bool
    count: Count
    seed: Seed
    never: OrInfinity
    lost: Measured
    pair: tuple[Count, str]
    parts: Annotated[tuple[Part, ...], Len(1, 3)]
    table: Mapping[str, Part]
    numbers: Annotated[Mapping[Literal["x", "y"], Quantity], Field(alias="numbers_n")]
    places: Annotated[Indices, Shape("k", whole=True)]
    rows: Annotated[Array, Shape("k", 3)]
    gaps: Annotated[Array, Shape(None, nan=True)]
    part: Part | None
    flat: Annotated[Flat, FLAT] = field(default_factory=Flat)
    free: Any = None
    late: Annotated[Mapping[str, float], UNRECORDED] = field(default_factory=dict)


PART = Part([0, 1, 2], [0, 0, 1], 0.1)
WHOLE = Whole(
    hidden="here", text="é", word="b", colour_name=Colour.BLUE, path=Path("a/b"), on=True, count=2,
    seed=2**64 - 1, never=0.5, lost=1e-300, pair=(1, "x"), parts=(PART, Part([3, 4, 5], [1, 0, 0])),
    table={"one": PART}, numbers={"y": 2.0}, places=[1, 2], rows=np.eye(3)[:2], gaps=[1.0, np.nan],
    part=PART, flat=Flat((1, 2, 3)), free={"any": [1, None]},
)  # fmt: skip


def read(text):
    return from_record(Whole, json_of(text), hidden="here")


@pytest.mark.parametrize(
    "change",
    [
        {}, {"never": math.inf}, {"lost": math.nan}, {"part": None}, {"table": {}},
        {"places": [], "rows": np.empty((0, 3))}, {"gaps": []},
    ],
)  # fmt: skip
def test_a_value_is_read_as_it_was_written(change):
    value = replace(WHOLE, **change)
    found = read(json.dumps(record_of(value), allow_nan=False))
    assert found == value
    assert record_of(found) == record_of(value)


@declared
class PartFile(RecordFile):
    FILE, SCHEMA = "part", 3
    part: Annotated[Part, FLAT]


def test_a_record_can_have_a_file_with_a_schema():
    text = PartFile(PART).text()
    assert json.loads(text) == {
        "schema": 3, "point_m": [0, 1, 2], "way": [0, 0, 1], "size_m": 0.1, "double_m": 0.2,
        "turned": [0, 0, -1],
    }  # fmt: skip
    assert PartFile.of_text(text).part == PART
    with pytest.raises(gc.InputError, match="newer"):
        PartFile.of_text(text.replace("3", "4", 1))


def test_what_has_a_default_need_not_be_in_a_file():
    said = {key: value for key, value in record_of(WHOLE).items() if key not in {"free", "axis"}}
    assert from_record(Whole, said, hidden="here") == replace(WHOLE, free=None)


def test_every_damaged_field_is_refused_by_its_name():
    document = record_of(replace(WHOLE, gaps=[]))
    del document["free"]  # which may hold anything
    check_refused(
        read, document, optional=optional_keys(Whole), loose={"table", "numbers_n"},
        large={"shift", "never", "lost"},
    )  # fmt: skip


def test_what_a_recorded_property_says_otherwise_is_refused():
    for place, other in (
        (("parts", 1, "double_m"), 0.4),
        (("part", "turned"), [0.0, 0.0, 1.0]),
        (("part", "turned", 2), -1.000001),
        (("table", "one", "double_m"), None),
    ):
        document = record_of(WHOLE)
        value_at(document, place[:-1])[place[-1]] = other
        name = [key for key in place if isinstance(key, str)][-1]
        with pytest.raises(gc.InputError, match=f"{name}.* contradicts the other fields"):
            read(json.dumps(document))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"parts": []}, "parts must have a length of at least 1 and at most 3, got 0"),
        ({"places": [1, 2, 3]}, "rows must have one entry for each of the 3 of places, got 2"),
        ({"pair": [1]}, "pair must be 2 items: a whole number from 1 .*, text, got"),
        ({"numbers_n": {"z": 1.0}}, "numbers_n"),
        ({"rows": [[1.0, True, 0.0], [0, 0, 0]]}, "rows must hold numbers, got true or false"),
    ],
)
def test_what_does_not_fit_is_told_by_field(change, says):
    with pytest.raises(gc.InputError, match=says):
        read(json.dumps(record_of(WHOLE) | change))
