"""Records of DexGraspBench, Dexonomy and DexLearn are read alone, in rows and in lists."""

import numpy as np
import pytest

import grasp_core as gc
from sim_validate.hands.dexgraspbench import dex_record, hand_file, write_dex_record
from sim_validate.judge.records import BadRecord
from tests.grasp_core.hands.gripping import reaches
from tests.sim_validate.judge.recorded import listed, qpos, random_pose, records, seven

STAGES = ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")


def grasps(rng, count):
    """A record of several grasps at one object, its poses of roots, and that of the object."""
    poses, rows = zip(*(qpos(rng) for _ in range(count)), strict=True)
    place = random_pose(rng)
    table = {"obj_path": "assets/mug", "obj_scale": np.float64(0.06), "obj_pose": seven(place)}
    table |= {stage: np.array(rows) + 0.01 * k * (np.arange(len(rows[0])) > 6)
              for k, stage in enumerate(STAGES)}  # fmt: skip
    return table, poses, place


def alone(table, place):
    return {key: value[place] if key in STAGES else value for key, value in table.items()}


@pytest.mark.parametrize("kind", ["<f8", ">f8", "<f4", ">f4"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_postures_are_in_the_frame_of_the_object(kind, order, tmp_path):
    table, poses, place = grasps(np.random.default_rng(0), 4)
    table |= {stage: np.array(table[stage], kind, order=order) for stage in STAGES}
    np.save(tmp_path / "set.npy", table)
    found = records(tmp_path)
    assert [each.id for each in found] == [f"set.npy#{k}" for k in range(4)]
    for k, each in enumerate(found):
        assert (each.object, each.scale, each.joint_names) == ("assets/mug", 0.06, ())
        assert each.grasp.root == pytest.approx(np.linalg.inv(place) @ poses[k], abs=1e-6)
        assert each.axes == pytest.approx(place[:3, :3].T, abs=1e-12)
        for stage, posture in zip(STAGES, (each.pregrasp, each.grasp, each.squeeze), strict=True):
            assert posture.joints == pytest.approx(table[stage][k, 7:], abs=1e-12)
            assert posture.root == pytest.approx(each.grasp.root, abs=1e-12)


def test_one_record_rows_and_lists_say_the_same(tmp_path):
    table, _, _ = grasps(np.random.default_rng(1), 3)
    np.save(tmp_path / "rows.npy", table)
    np.save(tmp_path / "list.npy", listed([alone(table, k) for k in range(3)]))
    np.save(tmp_path / "one.npy", alone(table, 1))
    rows, several, one = (records(tmp_path / f"{name}.npy") for name in ("rows", "list", "one"))
    assert [each.grasp for each in rows] == [each.grasp for each in several]
    assert [each.squeeze for each in rows] == [each.squeeze for each in several]
    assert [each.id for each in one] == ["one.npy"]
    assert one[0].grasp == rows[1].grasp


def test_objects_scales_and_poses_may_differ_by_row(tmp_path):
    table, poses, _ = grasps(np.random.default_rng(2), 3)
    places = [random_pose(np.random.default_rng(k)) for k in range(3)]
    table |= {"obj_path": ["a", "b", "c"], "obj_scale": np.array([0.1, 0.2, 0.3]),
              "obj_pose": np.array([seven(each) for each in places])}  # fmt: skip
    np.save(tmp_path / "set.npy", table)
    for k, each in enumerate(records(tmp_path)):
        assert (each.object, each.scale) == ("abc"[k], pytest.approx(0.1 * (k + 1)))
        assert each.grasp.root == pytest.approx(np.linalg.inv(places[k]) @ poses[k], abs=1e-9)
        assert each.axes == pytest.approx(places[k][:3, :3].T)


def test_the_first_of_several_pregrasps_counts_as_in_dexonomy(tmp_path):
    table, _, _ = grasps(np.random.default_rng(3), 5)
    table |= {"grasp_qpos": table["grasp_qpos"][:1], "squeeze_qpos": table["squeeze_qpos"][:1],
              "obj_scale": np.full(3, 0.1, np.float32)}  # fmt: skip
    np.save(tmp_path / "one.npy", table)
    (found,) = records(tmp_path)
    assert found.id == "one.npy"
    assert found.pregrasp.joints == pytest.approx(table["pregrasp_qpos"][0, 7:])
    assert found.scale == pytest.approx(0.1)


def test_stages_may_be_left_out_and_other_fields_are_left_alone(tmp_path):
    table, _, _ = grasps(np.random.default_rng(4), 2)
    np.save(tmp_path / "set.npy", {k: v for k, v in table.items() if k[0] not in "ps"}
            | {"contacts": [np.zeros(9), None, "text"], "scene": {"a": 1}})  # fmt: skip
    for found in records(tmp_path):
        assert (found.pregrasp, found.squeeze) == (None, None)


@pytest.mark.parametrize(
    ("change", "said"),
    [({"grasp_qpos": np.full(10, np.nan)}, "grasp_qpos must be finite"),
     ({"grasp_qpos": np.zeros(10)}, "quaternion"), ({"grasp_qpos": "text"}, "grasp_qpos must be"),
     ({"grasp_qpos": seven(np.eye(4))}, "joints"), ({"obj_path": 3}, "object"),
     ({"obj_path": ""}, "object"), ({"obj_path": None}, "obj_path"), ({"obj_scale": 0.0}, "scale"),
     ({"obj_scale": [1.0, 2.0, 1.0]}, "stretched"), ({"obj_pose": np.ones(7)}, "length 1"),
     ({"grasp_qpos": None}, "grasp must be"), ({"obj_pose": np.zeros((0, 7))}, "obj_pose"),
     ({"squeeze_qpos": np.concatenate([seven(np.eye(4)), np.zeros(4)])}, "the 3 joints"),
     ({"pregrasp_qpos": np.concatenate([seven(np.eye(4)), [60.0] * 3])}, "joints must be radians")],
    ids=str,
)  # fmt: skip
def test_a_wrong_record_of_a_list_loses_only_itself(change, said, tmp_path):
    table, _, _ = grasps(np.random.default_rng(5), 3)
    np.save(
        tmp_path / "l.npy", listed([alone(table, 0), alone(table, 1) | change, alone(table, 2)])
    )
    first, bad, last = records(tmp_path)
    assert (bad.id, first.id, last.id) == ("l.npy#1", "l.npy#0", "l.npy#2")
    assert said in bad.reason
    assert not isinstance(first, BadRecord)
    assert not isinstance(last, BadRecord)


def test_rows_that_do_not_fit_are_refused(tmp_path):
    table, _, _ = grasps(np.random.default_rng(6), 3)
    for name, rows in (("squeeze_qpos", 2), ("obj_pose", 0)):
        np.save(tmp_path / "set.npy", table | {name: table["squeeze_qpos"][:rows]})
        said = f"{name} must have a row for each of the 3 grasps"
        assert {each.reason for each in records(tmp_path)} == {said}


def test_our_own_records_are_read(tmp_path):
    hand = gc.load_hand("allegro")
    reach = next(each for each in reaches("allegro", "dodecahedron", 0.035) if each.reached)
    write_dex_record(dex_record(hand, reach, "objects/dodecahedron"), tmp_path / "0.npy")
    (found,) = records(tmp_path)
    assert found.grasp.joints == pytest.approx(reach.joints)
    assert found.grasp.root @ hand_file(hand).root == pytest.approx(reach.palm_pose, abs=1e-9)
