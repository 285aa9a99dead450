"""Contacts alone are read from contacts files and from plans."""

import json

import pytest

import grasp_core as gc
from sim_validate.judge.records import BadRecord
from tests.scenes.drawing.standing import small_plan
from tests.sim_validate.judge.recorded import records

PAIR = [{"position_m": [0, 0, z], "normal": [0, 0, -z]} for z in (1.0, -1.0)]


def test_one_grasp_and_several_are_read(tmp_path):
    (tmp_path / "mug.json").write_text(json.dumps({"contacts": PAIR, "friction": 0.5}))
    several = {"grasps": [{"id": "a", "contacts": PAIR}, {"contacts": PAIR * 2}]}
    (tmp_path / "set.json").write_text(json.dumps(several))
    one, first, second = records(tmp_path)
    assert [each.id for each in (one, first, second)] == ["mug.json", "set.json#0", "set.json#1"]
    assert [each.object for each in (one, first)] == ["mug", "set"]
    assert (one.scale, len(one.contacts), len(second.contacts)) == (1.0, 2, 4)
    assert one.contacts[1].position.tolist() == [0.0, 0.0, -1.0]
    assert one.contacts[1].normal.tolist() == [0.0, 0.0, 1.0]


def test_a_wrong_grasp_loses_only_itself(tmp_path):
    wrong = [{"contacts": PAIR[:1]}, {"contacts": [PAIR[0]] * 2}, 3, {"contacts": "text"},
             {"contacts": [PAIR[0], {"position_m": [0, 0, float("nan")], "normal": [0, 0, 1]}]},
             {"contacts": [PAIR[0], {"position_m": [0, 0, 1], "normal": [0, 0, 2]}]}]  # fmt: skip
    (tmp_path / "set.json").write_text(json.dumps({"grasps": [{"contacts": PAIR}, *wrong]}))
    good, *bad = records(tmp_path)
    assert len(good.contacts) == 2
    assert [type(each) for each in bad] == [BadRecord] * len(wrong)
    assert all(each.reason for each in bad)


@pytest.mark.parametrize(
    "text",
    ['{"grasps": 3}', '{"grasps": [], "contacts": []}', '[{"contacts": []}]', '{"contacts":'],
)
def test_a_wrong_file_is_one_bad_record(text, tmp_path):
    (tmp_path / "set.json").write_text(text)
    (found,) = records(tmp_path)
    assert (type(found), found.id) == (BadRecord, "set.json")


def test_grasps_of_a_plan_are_read_where_their_file_is_given(tmp_path):
    plan = small_plan()
    gc.save_grasps(tmp_path / "grasps.json", plan)
    found = records(tmp_path / "grasps.json")
    assert [each.id for each in found] == [f"grasps.json#{grasp.id}" for grasp in plan]
    assert {each.object for each in found} == {plan.body.name}
    for each, grasp in zip(found, plan, strict=True):
        assert [c.position.tolist() for c in each.contacts] == grasp.positions.tolist()
