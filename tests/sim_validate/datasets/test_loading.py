"""A dataset, loaded by the lines that its card gives, is what `load_dataset` gives."""

import re
from pathlib import Path

import numpy as np
import pytest

import sim_validate
from sim_validate.datasets.open_dataset import by_object, select
from sim_validate.datasets.parquet import parquet_bytes, read_columns, read_rows
from sim_validate.datasets.tables import TABLES

pytest.importorskip("pyarrow")
SPLITS = ("train", "validation", "test")
PAGE = Path(__file__).parents[3] / "docs" / "datasets.md"


@pytest.fixture(scope="module")
def folder(small_dataset):
    return small_dataset


@pytest.fixture
def beside(folder, monkeypatch):
    """A working folder that holds the dataset as `ds`."""
    monkeypatch.chdir(folder.parent)
    return folder


def snippet(folder, package):
    """The code of the card that imports a package."""
    blocks = re.findall(r"```python\n(.*?)```", (folder / "README.md").read_text(), re.DOTALL)
    (found,) = [block for block in blocks if re.search(rf"^import .*\b{package}$", block, re.M)]
    return found


def run(code):
    """The names that a piece of code leaves."""
    names = {}
    exec(code, names)  # noqa: S102 - it is what the card tells people to run
    return names


def same_cells(expected, rows, name):
    """Compare every cell of rows in lists with arrays; the number of numbers and words compared."""
    count = 0
    for column in TABLES[name]:
        values = expected[column.name]
        assert len(values) == len(rows) >= 1
        for value, row in zip(values, rows, strict=True):
            cell = row[column.name]
            if column.kind in ("text", "bool"):
                assert value == cell
                count += 1
                continue
            missing = np.nan if column.kind == "float" else -1
            there = np.full(column.shape, missing) if cell is None else filled(cell, missing)
            assert there.shape == column.shape
            np.testing.assert_array_equal(there, value)
            count += there.size
    return count


def filled(cell, missing):
    """A cell as an array, with numbers for what is null."""
    values = np.array(cell, dtype=object)
    values[values == None] = missing  # noqa: E711 - elementwise
    return values.astype(np.float64)


def cells(expected):
    """How many there are to compare."""
    return sum(np.asarray(values).size for values in expected.values())


def test_polars_loads_it_as_the_card_says(beside):
    polars = pytest.importorskip("polars")
    found = run(snippet(beside, "polars"))["grasps"]
    expected = sim_validate.load_dataset(beside)
    assert same_cells(expected["grasps"], found.to_dicts(), "grasps") == cells(expected["grasps"])
    for name in TABLES:
        rows = polars.read_parquet(f"ds/data/{name}/*.parquet").to_dicts()
        assert same_cells(expected[name], rows, name) == cells(expected[name]) >= 30


def test_pandas_loads_it_as_the_card_says_and_stacks_lists_to_arrays(beside):
    pandas = pytest.importorskip("pandas")
    names = run(snippet(beside, "pandas"))
    expected = sim_validate.load_dataset(beside)
    compared = 0
    for name in TABLES:
        found = pandas.read_parquet(f"ds/data/{name}")
        for column in TABLES[name]:
            values, there = expected[name][column.name], found[column.name]
            if column.shape:
                missing = np.full(column.shape, np.nan if column.kind == "float" else -1)
                stacked = names["stacked"](there, missing)
                assert stacked.shape == (len(found), *column.shape)
                np.testing.assert_array_equal(stacked, values)
            elif column.kind == "float":
                np.testing.assert_array_equal(there.to_numpy(), values)
            elif column.kind == "bool":
                assert values.dtype == bool
                np.testing.assert_array_equal(there.to_numpy(), values)
            else:
                assert [None if pandas.isna(cell) else cell for cell in there] == list(values)
            compared += values.size
    assert compared == sum(cells(table) for table in expected.values())
    np.testing.assert_array_equal(names["points"], expected["grasps"]["contact_points_m"])
    assert len(names["grasps"]) == len(names["points"]) >= 10


def test_truth_values_are_bool_or_floats_that_refuse_to_be_negated(beside, tmp_path):
    """Objects would take `~` and give -1 or -2 for it, which both count as true."""
    grasps = sim_validate.load_dataset(beside)["grasps"]
    held, closed = grasps["held"], grasps["force_closed"]
    assert held.dtype == closed.dtype == bool
    assert 0 < (~held).sum() < len(held)
    (path,) = sorted(Path(beside).glob("data/grasps/train-*.parquet"))
    rows = read_rows(path, "grasps")
    unknown = tmp_path / "grasps.parquet"
    unknown.write_bytes(parquet_bytes("grasps", [rows[0] | {"held": None}, *rows[1:]], {}))
    found = read_columns([unknown], "grasps")["held"]
    assert found.dtype == np.float64
    assert np.isnan(found).sum() == 1
    assert (found == True).sum() + (found == False).sum() == len(rows) - 1  # noqa: E712
    with pytest.raises(TypeError):
        np.invert(found)
    with pytest.raises(TypeError):
        np.bitwise_and(found, closed[: len(rows)])
    with pytest.raises(IndexError):
        closed[: len(rows)][found]


@pytest.fixture
def offline(monkeypatch, tmp_path):
    """Hugging Face datasets, with a cache of its own and no network."""
    for name in ("HF_HUB_OFFLINE", "HF_DATASETS_OFFLINE"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    datasets = pytest.importorskip("datasets")
    monkeypatch.setattr(datasets.config, "HF_HUB_OFFLINE", True)
    monkeypatch.setattr(datasets.config, "HF_DATASETS_CACHE", tmp_path / "cache")
    monkeypatch.setattr(datasets.config, "HF_MODULES_CACHE", str(tmp_path / "modules"))
    return datasets


@pytest.mark.slow
def test_hugging_face_datasets_loads_it_as_the_card_says(beside, offline, tmp_path):
    found = run(snippet(beside, "datasets"))["grasps"]
    expected = sim_validate.load_dataset(beside, "train")["grasps"]
    assert same_cells(expected, found.to_list(), "grasps") == cells(expected)
    compared = 0
    for split in SPLITS:
        expected = sim_validate.load_dataset(beside, split)
        for name in TABLES:
            found = offline.load_dataset("ds", name, split=split, cache_dir=str(tmp_path / "own"))
            compared += same_cells(expected[name], found.to_list(), name)
    whole = sim_validate.load_dataset(beside)
    assert compared == sum(cells(table) for table in whole.values())


def test_graspproof_loads_it_as_the_card_says(beside):
    found = run(snippet(beside, "sim_validate"))["grasps"]
    expected = sim_validate.load_dataset(beside, "train")["grasps"]
    assert len(found["held"]) == len(expected["held"]) >= 3
    np.testing.assert_array_equal(found["contact_points_m"], expected["contact_points_m"])


@pytest.mark.parametrize("split", SPLITS)
def test_every_row_is_met_once_with_its_object(folder, split):
    chosen = select(folder, split)
    groups = list(by_object(chosen))
    assert len(groups) == chosen.counts()["objects"]
    for name in TABLES:
        assert sum(len(group[name]) for group in groups) == chosen.counts()[name] > 0
    for group in groups:
        (owner,) = group["objects"]
        assert {row["object_id"] for row in group["grasps"]} == {owner["object_id"]}
        names = {row["grasp_id"] for row in group["grasps"]}
        assert {row["grasp_id"] for row in group["trials"]} == names
