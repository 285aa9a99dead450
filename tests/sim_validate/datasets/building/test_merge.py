"""Merged datasets are what one build of everything makes, but for what says how they were made."""

from dataclasses import replace

import pytest

import grasp_core as gc
from sim_validate.datasets.building.build import build
from sim_validate.datasets.building.merge import merge
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.settings import Learning
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.quarantine import read_left_out
from sim_validate.datasets.verifying.redo import Sample
from sim_validate.datasets.verifying.verify import verify
from tests.sim_validate.datasets.engines import Here, contents, silent

pytest.importorskip("pyarrow")
WHOLE = DatasetConfig(
    objects=("tetrahedron", "wedge", "prism"), frictions=(0.4, 0.5), families=("concurrent",),
    limit=1, learning=Learning(synthetic=1, rests=True, split_by="object"),
)  # fmt: skip


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    folder = tmp_path_factory.mktemp("merging")
    parts = {
        "a": replace(WHOLE, objects=("tetrahedron", "wedge"), frictions=(0.4,)),
        "b": replace(WHOLE, objects=("wedge", "prism"), frictions=(0.5,)),
        "c": replace(WHOLE, objects=("tetrahedron",), frictions=(0.5,)),
        "whole": WHOLE,
    }
    for name, config in parts.items():
        assert build(config, folder / name, Here(), silent).quarantined == 0
    return folder


def rows_of(folder, name):
    keys = {"objects": "object_id", "rests": "object_id"}
    return sorted(
        (row for row in select(folder).rows(name)),
        key=lambda row: (row[keys.get(name, "grasp_id")], row.get("trial", row.get("rest", 0))),
    )


def test_merged_rows_are_those_of_one_build_where_all_were_made(folders, tmp_path):
    manifest = merge([folders / "a", folders / "b", folders / "c"], tmp_path / "ds")
    assert manifest.units == 5
    left_out = read_left_out(tmp_path / "ds" / "quarantine.jsonl")
    assert [(each.object, each.friction) for each in left_out] == [("prism", 0.4)]
    prism = next(
        row["object_id"] for row in rows_of(folders / "whole", "objects")
        if row["source_name"] == "prism"
    )  # fmt: skip
    gone = f"{prism[:16]}-0.4-"
    for name in manifest.tables:
        wanted = [
            row for row in rows_of(folders / "whole", name)
            if not row.get("grasp_id", "").startswith(gone)
        ]  # fmt: skip
        assert wanted
        assert rows_of(tmp_path / "ds", name) == wanted, name
    assert verify(tmp_path / "ds", Sample(1.0)) == []
    assert {each.split for each in manifest.files if each.split} == {"train", "validation", "test"}


def test_an_object_in_two_datasets_is_there_once(folders, tmp_path):
    one = merge([folders / "a", folders / "b"], tmp_path / "one")
    two = merge([folders / "a", folders / "b", folders / "a"], tmp_path / "two")
    assert one.rows() == two.rows()
    for name in one.tables:
        assert rows_of(tmp_path / "one", name) == rows_of(tmp_path / "two", name)


def test_merging_twice_gives_the_same_bytes(folders, tmp_path):
    for name in ("x", "y"):
        merge([folders / "a", folders / "b"], tmp_path / name)
    assert contents(tmp_path / "x") == contents(tmp_path / "y")


def test_datasets_of_other_settings_are_refused(folders, tmp_path):
    other = replace(WHOLE, objects=("wedge",), limit=2)
    build(other, tmp_path / "other", Here(), silent)
    with pytest.raises(gc.InputError, match="limit"):
        merge([folders / "a", tmp_path / "other"], tmp_path / "ds")
    with pytest.raises(gc.InputError, match="at least two"):
        merge([folders / "a"], tmp_path / "ds")
    with pytest.raises(gc.InputError, match="is not empty"):
        merge([folders / "a", folders / "b"], folders / "c")
