"""Columns are the fields of row classes, and figures of records are columns by themselves."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.arrays import Array, Shape
from grasp_core.declared import Declared
from grasp_core.figures import Kept, Shown, figures, keeps
from grasp_core.files.records import FLAT, from_record, recorded
from grasp_core.kinds import Null
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets.columns import (
    Asked,
    Known,
    agrees,
    cells_of,
    columns_of,
    in_columns,
)
from sim_validate.datasets.rows import ROWS, TABLES, GraspRow, dataset_tables, groups_asked
from sim_validate.engine.traces import HoldVerdict


class Taste(StrEnum):
    SWEET = "sweet"


@dataclass(frozen=True, slots=True, eq=False)
class Pie(Declared):
    """What a row has figures of."""

    taste: Annotated[Taste, Shown("taste")]
    """What it tastes like; None is no taste."""
    layers: Annotated[tuple[str, ...], Shown("layers")]
    parts: Annotated[tuple["Part", ...], Shown("parts")] = ()

    @recorded
    def weight_kg(self) -> Annotated[float, Null(math.nan), Shown("kg")]:
        """How heavy it is."""
        return math.nan


@dataclass(frozen=True, slots=True, eq=False)
class Part(Declared):
    """A record in the row."""

    slips_m: Annotated[Array, Shape(None, nan=True)]


@keeps(in_columns(Pie, (), "pie_"))
class PieCells(Kept):
    """The figures of a pie."""


@dataclass(frozen=True, slots=True, eq=False)
class Row(Declared):
    """A row with a column of each kind."""

    name: str
    part: Annotated[Part, FLAT]
    limit: Known = None
    angles_rad: Annotated[Annotated[Array, Shape("hand")] | None, Asked("hand")] = None
    pie: Annotated[PieCells | None, FLAT] = None


PIE = Pie(Taste.SWEET, ("dough", "apples"))
GIVEN = Row("a", Part([0.1, math.nan]), math.inf, [1.0, 2.0], PieCells.of(PIE))


def test_each_field_and_each_figure_is_a_column():
    found = {each.name: each for each in columns_of(Row, {"hand": 2})}
    assert list(found) == [
        "name", "slips_m", "limit", "angles_rad", "pie_taste", "pie_layers", "pie_weight_kg",
    ]  # fmt: skip
    assert [(each.kind, each.shape, each.unit) for each in found.values()] == [
        ("text", (), ""), ("float", (4,), "m"), ("float", (), "1"), ("float", (2,), "rad"),
        ("text", (), ""), ("int", (), ""), ("float", (), "kg"),
    ]  # fmt: skip
    assert found["pie_taste"].meaning == "What it tastes like; null is no taste."
    assert "angles_rad" not in {each.name for each in columns_of(Row, {})}


def test_cells_are_plain_and_make_the_row_again():
    cells = cells_of(GIVEN, columns_of(Row, {"hand": 2}))
    assert cells == {
        "name": "a", "slips_m": [0.1, None, None, None], "limit": None, "angles_rad": [1.0, 2.0],
        "pie_taste": "sweet", "pie_layers": 2, "pie_weight_kg": None,
    }  # fmt: skip
    back = from_record(Row, cells)
    assert cells_of(back, columns_of(Row, {"hand": 2})) == cells
    np.testing.assert_array_equal(back.angles_rad, [1.0, 2.0])
    with pytest.raises(gc.InputError, match=r"file: row 3\.name must be text, got 1"):
        from_record(Row, {**cells, "name": 1}, "file: row 3")


def test_every_figure_of_a_verdict_and_its_trials_is_a_column():
    of_grasps, of_trials = ({each.name for each in TABLES[name]} for name in ("grasps", "trials"))
    told_otherwise = {"id", "predicted_critical_friction"}
    assert {each.name for each in figures(Verdict)} - told_otherwise <= of_grasps
    assert {
        each.name for kind in (HoldVerdict, WrenchVerdict) for each in figures(kind)
    } <= of_trials


def test_no_table_has_a_column_twice():
    tables = dataset_tables(dict.fromkeys(groups_asked(), 16))
    assert list(tables) == list(ROWS)
    for columns in tables.values():
        names = [each.name for each in columns]
        assert len(set(names)) == len(names)
        assert all(each.meaning for each in columns)


def test_numbers_agree_as_far_as_their_fields_say():
    assert agrees(GraspRow, "mass_kg", 1.0, 1.0 + 1e-7)
    assert not agrees(GraspRow, "mass_kg", 1.0, 1.0 + 1e-5)
    assert not agrees(GraspRow, "load_multiple", 1.0, 1.0 + 1e-7)
    assert agrees(GraspRow, "predicted_loss", None, math.inf)
    assert not agrees(GraspRow, "mass_kg", None, 1.0)
