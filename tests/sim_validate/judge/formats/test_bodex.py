"""Files of BODex are read with the object of their world."""

import numpy as np
import pytest

from sim_validate.judge.records import BadRecord
from tests.sim_validate.judge.recorded import qpos, random_pose, records, seven

NAMES = ["a", "b", "c"]


def file_of(rng, count=2):
    """What BODex saves of some grasps, with the poses of roots and of the object."""
    place, stages = random_pose(rng), [[qpos(rng) for _ in range(3)] for _ in range(count)]
    numbers = np.array([[[row for _, row in each] for each in stages]], np.float32)
    world = {"mesh": {"mug_scale006mug": {
        "scale": np.full(3, 0.06), "pose": seven(place).tolist(), "urdf_path": "x.urdf",
        "file_path": "/data/object/scene_cfg/../processed_data/mug/mesh/simplified.obj",
    }}, "cuboid": {"table": {"dims": [5.0, 5.0, 0.2]}}}  # fmt: skip
    return {
        "robot_pose": numbers, "joint_names": NAMES, "manip_name": ["mug_scale006mug"],
        "scene_path": ["/data/object/scene_cfg/mug/floating/scale006.npy"], "world_cfg": [world],
        "contact_point": np.zeros((1, count, 4, 3)),
    }, [[pose for pose, _ in each] for each in stages], place  # fmt: skip


def test_each_grasp_has_three_postures_by_names_of_joints(tmp_path):
    table, poses, place = file_of(np.random.default_rng(0))
    np.save(tmp_path / "mug_grasp.npy", table)
    found = records(tmp_path)
    assert len(found) == 2
    for k, each in enumerate(found):
        assert (each.object, each.joint_names) == ("/data/object/processed_data/mug", (*NAMES,))
        assert each.scale == pytest.approx(0.06)
        for stage, posture in enumerate((each.pregrasp, each.grasp, each.squeeze)):
            wanted = np.linalg.inv(place) @ poses[k][stage]
            assert posture.root == pytest.approx(wanted, abs=1e-6)
            assert posture.joints.tolist() == table["robot_pose"][0, k, stage, 7:].tolist()


def test_older_files_name_the_object_in_fields(tmp_path):
    table, poses, _ = file_of(np.random.default_rng(1))
    for name in ("world_cfg", "scene_path", "manip_name"):
        del table[name]
    table |= {"obj_path": ["assets/mug"], "obj_scale": np.array([0.1]),
              "obj_pose": seven(np.eye(4))[None]}  # fmt: skip
    np.save(tmp_path / "mug_grasp.npy", table)
    first, _ = records(tmp_path)
    assert (first.object, first.scale) == ("assets/mug", 0.1)
    assert first.grasp.root == pytest.approx(poses[0][1], abs=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [({"robot_pose": np.zeros((1, 2, 30, 29))}, "paths are not read"),
     ({"robot_pose": np.zeros((2, 1, 3, 9))}, "robot_pose"), ({"robot_pose": "text"}, "robot_pose"),
     ({"joint_names": ["a"]}, "joint_names"), ({"joint_names": [1, 2, 3]}, "joint_names"),
     ({"manip_name": ["other"]}, "other: missing"), ({"world_cfg": [3]}, "mesh"),
     ({"world_cfg": [{"mesh": {"mug_scale006mug": {"file_path": "a"}}}]}, "scale: missing")],
    ids=str,
)  # fmt: skip
def test_wrong_files_are_refused(change, said, tmp_path):
    table, _, _ = file_of(np.random.default_rng(2))
    np.save(tmp_path / "mug_grasp.npy", table | change)
    for found in records(tmp_path):
        assert isinstance(found, BadRecord)
        assert said in found.reason
