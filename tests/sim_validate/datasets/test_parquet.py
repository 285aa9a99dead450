"""Tables of a unit of work, as columns and as files."""

import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.figures import figures
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets import parquet
from sim_validate.datasets.columns import TABLES, GraspRow
from sim_validate.datasets.config import KEYS, DatasetConfig
from sim_validate.datasets.making_rows import compute_rows, split_of
from sim_validate.datasets.parquet import TableColumn, agrees, each_batch, parquet_bytes, read_table
from sim_validate.datasets.work_units import body_of, units_of
from sim_validate.engine.held_or_let_go import HoldVerdict

pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def unit():
    (unit,) = units_of(DatasetConfig(objects=("tetrahedron",), limit=2))
    return unit


@pytest.fixture(scope="module")
def rows(unit):
    made = compute_rows(unit, body_of(unit)).rows
    return {name: made.cells(name, columns) for name, columns in TABLES.items()}


@pytest.fixture
def written(rows, tmp_path):
    found = {}
    for name in TABLES:
        path = tmp_path / f"{name}.parquet"
        path.write_bytes(parquet_bytes(name, rows[name], TABLES))
        found[name] = path
    return found


def test_a_file_of_another_version_is_refused(written):
    more = {**TABLES, "objects": (*TABLES["objects"], TableColumn("taste", "text", "new"))}
    for read in (read_table, lambda *of: list(each_batch(*of))):
        with pytest.raises(gc.InputError, match="expected the columns of"):
            read(written["objects"], "objects", more)


def test_tables_are_read_as_they_were_written(rows, written):
    for name, path in written.items():
        back = read_table(path, name, TABLES).to_pylist()
        given = sorted(rows[name], key=lambda row: [row[key] for key in KEYS[name]])
        assert len(back) == len(given) >= 1
        for row, original in zip(back, given, strict=True):
            for column in TABLES[name]:
                expected = original[column.name]
                assert row[column.name] == expected
                if column.shape and expected is not None:
                    assert np.shape(row[column.name]) == column.shape


def test_files_do_not_depend_on_the_order_of_rows(rows):
    for name in TABLES:
        once = parquet_bytes(name, rows[name], TABLES)
        assert parquet_bytes(name, rows[name][::-1], TABLES) == once


def test_two_rows_with_one_name_are_refused(rows):
    with pytest.raises(gc.InputError, match="two rows"):
        parquet_bytes("grasps", [*rows["grasps"], rows["grasps"][0]], TABLES)


def test_objects_are_split_by_their_hash_in_stated_shares():
    splits = [split_of(f"object {number}", 0) for number in range(4000)]
    assert splits.count("train") == pytest.approx(3200, abs=120)
    assert splits.count("validation") == pytest.approx(400, abs=80)
    assert [split_of(f"object {number}", 1) for number in range(4000)] != splits


def test_columns_of_other_types_and_another_table_are_refused(written, tmp_path):
    arrow, files = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    table = files.read_table(written["objects"])
    place = table.schema.get_field_index("vertices")
    other = table.set_column(place, "vertices", table["vertices"].cast(arrow.float64()))
    files.write_table(other, tmp_path / "t.parquet")
    with pytest.raises(gc.InputError, match="the column types of the table objects"):
        read_table(tmp_path / "t.parquet", "objects", TABLES)
    turned = table.select(list(reversed(table.column_names)))
    files.write_table(turned, tmp_path / "t.parquet")
    with pytest.raises(gc.InputError, match="expected the columns of the table objects"):
        read_table(tmp_path / "t.parquet", "objects", TABLES)
    with pytest.raises(gc.InputError, match="expected the columns of the table objects"):
        read_table(written["grasps"], "objects", TABLES)
    (tmp_path / "t.parquet").write_bytes(written["objects"].read_bytes()[:-8])
    with pytest.raises(gc.InputError, match=r"t.parquet: this file is not Parquet, or is damaged"):
        read_table(tmp_path / "t.parquet", "objects", TABLES)


def test_files_that_claim_too_much_are_refused_before_they_are_read(written, monkeypatch):
    monkeypatch.setattr(parquet, "MOST_FILE_ROWS", 1)
    with pytest.raises(gc.InputError, match=r"claims [0-9]+ rows, .* limits are 1 and"):
        read_table(written["trials"], "trials", TABLES)


def test_every_figure_of_a_verdict_and_its_trials_is_a_column():
    of_grasps, of_trials = ({each.name for each in TABLES[name]} for name in ("grasps", "trials"))
    told_otherwise = {"id", "predicted_critical_friction"}
    assert {each.name for each in figures(Verdict)} - told_otherwise <= of_grasps
    assert {
        each.name for kind in (HoldVerdict, WrenchVerdict) for each in figures(kind)
    } <= of_trials


def test_numbers_agree_as_far_as_their_fields_say():
    assert agrees(GraspRow, "mass_kg", 1.0, 1.0 + 1e-7)
    assert not agrees(GraspRow, "mass_kg", 1.0, 1.0 + 1e-5)
    assert not agrees(GraspRow, "load_multiple", 1.0, 1.0 + 1e-7)
    assert agrees(GraspRow, "predicted_loss", None, math.inf)
    assert not agrees(GraspRow, "mass_kg", None, 1.0)
