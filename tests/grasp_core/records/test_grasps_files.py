import json

import numpy as np
import pytest

import grasp_core as gc
import scenes
from sim_validate.main import main


@pytest.fixture(scope="module")
def plan():
    return gc.plan(scenes.example_object("wedge"), 0.5, limit=8)


def test_a_saved_plan_is_loaded_as_it_was(plan, tmp_path):
    path = gc.save_grasps(tmp_path / "new" / "grasps.json", plan)
    found = gc.load_grasps(path)
    assert found.body == plan.body
    assert [grasp.id for grasp in found] == [grasp.id for grasp in plan]
    assert (found.counts, found.outcomes) == (plan.counts, plan.outcomes)
    for ours, theirs in zip(plan, found, strict=True):
        assert ours.contacts == theirs.contacts
        assert ours.witness == theirs.witness
        assert ours.critical_friction == theirs.critical_friction
        assert np.isclose(ours.span_angle, theirs.span_angle, rtol=1e-15)


def test_the_command_line_reads_what_python_saves_and_the_other_way_round(plan, tmp_path):
    gc.save_grasps(tmp_path / "grasps.json", plan[:2])
    assert main(["validate", str(tmp_path / "grasps.json"), "--out", str(tmp_path / "v")]) == 0
    planned = ["plan", "wedge", "--limit", "8", "--out", str(tmp_path / "p")]
    assert main(planned) == 0
    found = gc.load_grasps(tmp_path / "p" / "grasps.json")
    assert [grasp.id for grasp in found] == [grasp.id for grasp in plan]
    again = gc.save_grasps(tmp_path / "again.json", found)
    old, new = (json.loads(p.read_text()) for p in (tmp_path / "p" / "grasps.json", again))
    assert new["grasps"] == old["grasps"]


def test_what_is_no_plan_or_no_file_of_grasps_is_refused(plan, tmp_path):
    with pytest.raises(gc.InputError, match=r"plan must be a Plan.*gc\.plan"):
        gc.save_grasps(tmp_path / "a.json", plan.grasps)
    with pytest.raises(gc.InputError, match="cannot be read"):
        gc.load_grasps(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(gc.InputError, match=r"bad\.json: "):
        gc.load_grasps(tmp_path / "bad.json")
