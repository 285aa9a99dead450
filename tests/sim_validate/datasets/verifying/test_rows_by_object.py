import pytest

from sim_validate.datasets.columns import TABLES
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.verifying.rows_by_object import by_object
from tests.sim_validate.datasets.small import build_small

pytest.importorskip("pyarrow")


@pytest.mark.parametrize("split", ["train", "validation", "test"])
def test_every_row_is_met_once_with_its_object(tmp_path, split):
    folder = build_small(tmp_path / "ds")
    chosen = Selection(folder, read_manifest(folder), split)
    groups = list(by_object(chosen))
    assert len(groups) == chosen.counts()["objects"]
    for name in TABLES:
        assert sum(len(group[name]) for group in groups) == chosen.counts()[name] > 0
    for group in groups:
        (owner,) = group["objects"]
        assert {row["object_id"] for row in group["grasps"]} == {owner["object_id"]}
        names = {row["grasp_id"] for row in group["grasps"]}
        assert {row["grasp_id"] for row in group["trials"]} == names
