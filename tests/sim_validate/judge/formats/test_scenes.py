"""The object of a record is found in the scene that the record has, or names."""

import numpy as np
import pytest

from sim_validate.judge.records import BadRecord
from tests.sim_validate.judge.recorded import qpos, random_pose, records, seven

NAMED = "assets/object/DGN/scene_cfg/mug/floating/scale006.npy"


def scene(place, **other):
    body = {"type": "rigid_object", "scale": [0.06] * 3, "pose": seven(place),
            "file_path": "../../../processed_data/mug/mesh/simplified.obj"}  # fmt: skip
    return {"scene": {"cup": body | other, "table": {"type": "plane"}},
            "task": {"type": "force_closure", "obj_name": "cup"}}  # fmt: skip


def grasp(**other):
    pose, row = qpos(np.random.default_rng(0))
    return {"grasp_qpos": row, **other}, pose


PLACE = random_pose(np.random.default_rng(1))


def check(found, pose, named):
    assert (found.object, found.scale) == (named, pytest.approx(0.06))
    assert found.grasp.root == pytest.approx(np.linalg.inv(PLACE) @ pose, abs=1e-9)
    assert found.axes == pytest.approx(PLACE[:3, :3].T)


@pytest.mark.parametrize("near", ["records", "objects", "inside objects"])
def test_a_scene_file_is_found_near_records_or_objects(near, tmp_path):
    table, pose = grasp(scene_path=NAMED)
    folder = tmp_path / "output" / "set"
    folder.mkdir(parents=True)
    np.save(folder / "0.npy", table)
    objects = tmp_path / "elsewhere" / "DGN" / "processed_data"
    place = {"records": tmp_path / NAMED,
             "objects": tmp_path / "elsewhere" / "DGN" / NAMED.partition("DGN/")[2],
             "inside objects": objects / NAMED.partition("DGN/")[2]}[near]  # fmt: skip
    place.parent.mkdir(parents=True)
    np.save(place, scene(PLACE))
    (found,) = records(folder, objects=objects)
    check(found, pose, "assets/object/DGN/processed_data/mug")
    if near != "records":
        (found,) = records(folder)
        assert isinstance(found, BadRecord)
        assert "is not in a folder above the records or the objects" in found.reason


def test_rows_of_published_sets_have_scales_of_their_own(tmp_path):
    rng = np.random.default_rng(2)
    rows = [qpos(rng) for _ in range(2)]
    table = {stage: np.array([row for _, row in rows]) for stage in
             ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")}  # fmt: skip
    np.save(
        tmp_path / "set.npy", table | {"scene_path": NAMED, "scene_scale": np.array([1.0, 2.0])}
    )
    (tmp_path / NAMED).parent.mkdir(parents=True)
    np.save(tmp_path / NAMED, scene(PLACE))
    first, second = records(tmp_path / "set.npy")
    check(first, rows[0][0], "assets/object/DGN/processed_data/mug")
    assert second.scale == pytest.approx(0.12)


def test_a_record_may_have_its_scene(tmp_path):
    older = {"scene": scene(PLACE)["scene"], "interest_obj_name": "cup"}
    for each in (scene(PLACE), older):
        table, pose = grasp(scene_cfg=each)
        np.save(tmp_path / "0.npy", table)
        (found,) = records(tmp_path)
        check(found, pose, "../../../processed_data/mug")


def test_a_record_with_scale_and_pose_needs_no_file(tmp_path):
    table, pose = grasp(scene_path=NAMED, obj_pose=seven(PLACE), obj_scale=np.full(3, 0.06))
    np.save(tmp_path / "0.npy", table)
    (found,) = records(tmp_path)
    check(found, pose, "mug")


@pytest.mark.parametrize(
    ("change", "said"),
    [({}, "expected obj_path, obj_scale and obj_pose, or scene_path"), ({"scene_cfg": 3}, "task"),
     ({"scene_path": 3}, "scene_path must be text"), ({"scene_path": "\0"}, "scene_path"),
     ({"scene_path": "a" * 900}, "is not in a folder"), ({"scene_path": "0.npy"}, "task"),
     ({"scene_cfg": {"task": {"obj_name": "x"}, "scene": {}}}, "x: missing"),
     ({"scene_cfg": {"task": {"obj_name": "x"}, "scene": {"x": 3}}}, "file_path"),
     ({"scene_cfg": scene(PLACE, scale=[0.1, 0.1, 0.2])}, "stretched"),
     ({"scene_cfg": scene(PLACE, pose=[0.0] * 7)}, "quaternion")],
    ids=str,
)  # fmt: skip
def test_a_wrong_scene_is_named(change, said, tmp_path):
    np.save(tmp_path / "0.npy", grasp(**change)[0])
    (found,) = records(tmp_path)
    assert isinstance(found, BadRecord)
    assert said in found.reason
