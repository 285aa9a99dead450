"""A dataset, loaded by the lines that its card gives, is what `load_dataset` gives."""

import re
from pathlib import Path

import numpy as np
import pytest

import sim_validate
from sim_validate.datasets.columns import TABLES
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.parquet import parquet_bytes, read_columns, read_table

pytest.importorskip("pyarrow")
SPLITS = ("train", "validation", "test")


@pytest.fixture
def beside(small_dataset, monkeypatch):
    """A working folder that holds the dataset as `ds`."""
    monkeypatch.chdir(small_dataset.parent)
    return small_dataset


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


def same(expected, rows):
    """Compare text, truth values and points of rows in lists with the arrays of a table."""
    assert len(rows) >= 1
    for name in ("grasp_id", "outcome", "held"):
        assert [row[name] for row in rows] == list(expected[name])
    points = np.array([row["contact_points_m"] for row in rows], dtype=float)  # nan for null
    np.testing.assert_array_equal(points, expected["contact_points_m"])


def test_polars_loads_it_as_the_card_says(beside):
    pytest.importorskip("polars")
    found = run(snippet(beside, "polars"))["grasps"]
    same(sim_validate.load_dataset(beside)["grasps"], found.to_dicts())


def test_pandas_and_we_load_it_as_the_card_says_and_stack_lists_to_arrays(beside):
    pytest.importorskip("pandas")
    names = run(snippet(beside, "pandas"))
    expected = sim_validate.load_dataset(beside)["grasps"]
    own = run(snippet(beside, "sim_validate"))["grasps"]["contact_points_m"]
    train = sim_validate.load_dataset(beside, "train")["grasps"]["contact_points_m"]
    np.testing.assert_array_equal(own, train)
    np.testing.assert_array_equal(names["points"], expected["contact_points_m"])
    np.testing.assert_array_equal(names["grasps"]["held"].to_numpy(), expected["held"])
    assert len(names["grasps"]) == len(names["points"]) >= 10


def test_truth_values_are_bool_or_floats_that_refuse_to_be_negated(beside, tmp_path):
    """Objects would take `~` and give -1 or -2 for it, which both count as true."""
    grasps = sim_validate.load_dataset(beside)["grasps"]
    held, closed = grasps["held"], grasps["force_closed"]
    assert held.dtype == closed.dtype == bool
    assert 0 < (~held).sum() < len(held)
    (path,) = sorted(Path(beside).glob("data/grasps/train-*.parquet"))
    rows = read_table(path, "grasps", TABLES).to_pylist()
    unknown = tmp_path / "grasps.parquet"
    unknown.write_bytes(parquet_bytes("grasps", [rows[0] | {"held": None}, *rows[1:]], TABLES))
    found = read_columns([unknown], "grasps", TABLES)["held"]
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
    same(sim_validate.load_dataset(beside, "train")["grasps"], found.to_list())
    for split in SPLITS:
        expected = sim_validate.load_dataset(beside, split)["grasps"]
        own = str(tmp_path / "own")
        found = offline.load_dataset("ds", "grasps", split=split, cache_dir=own)
        same(expected, found.to_list())


@pytest.mark.parametrize("split", SPLITS)
def test_every_row_is_met_once_with_its_object(small_dataset, split):
    chosen = select(small_dataset, split)
    groups = list(chosen.by_object())
    assert len(groups) == chosen.manifest.count("objects", split)
    for name in TABLES:
        count = chosen.manifest.count(name, split)
        assert sum(len(group.of(name)) for group in groups) == count > 0
    for group in groups:
        (owner,) = group.objects
        assert {row.object_id for row in group.grasps} == {owner.object_id}
        names = {row.grasp_id for row in group.grasps}
        assert {row.grasp_id for row in group.trials} == names
