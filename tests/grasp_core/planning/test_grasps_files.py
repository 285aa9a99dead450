import json
from dataclasses import replace

import pytest

import grasp_core as gc
import scenes
from grasp_core.planning.result import Moved
from sim_validate.main import main
from tests.grasp_core.curved import curved_body


@pytest.fixture(scope="module")
def plan():
    return gc.plan(scenes.example_object("wedge"), 0.5, limit=8)


def test_a_saved_plan_is_loaded_as_it_was(plan, tmp_path):
    path = gc.save_grasps(tmp_path / "new" / "grasps.json", plan)
    found = gc.load_grasps(path)
    assert found == plan
    assert found.grasps == plan.grasps


def test_a_plan_on_a_curved_surface_and_its_moves_are_loaded_as_they_were(tmp_path):
    body = curved_body(subdivisions=3)
    assert body.notes
    planned = gc.plan(body, 0.5, families=("concurrent", "pencil", "regulus"), limit=4)
    moves = (Moved("a", "b", (0.1, 0.2), (0.2, 0.25), None), Moved("c", "c", (0, 1), (0, 1), 2.0))
    moved = replace(planned, moves=moves)
    assert gc.load_grasps(gc.save_grasps(tmp_path / "grasps.json", moved)) == moved


@pytest.mark.parametrize(
    "flags", [["--optimize"], ["--finger-radius-m", "0.002", "--approach-m", "0.02"]]
)
def test_a_file_that_is_loaded_and_saved_again_keeps_its_bytes(flags, tmp_path):
    assert main(["plan", "tetrahedron", "--limit", "1", "--out", str(tmp_path), *flags]) == 0
    written = tmp_path / "grasps.json"
    again = gc.save_grasps(tmp_path / "again.json", gc.load_grasps(written))
    assert again.read_bytes() == written.read_bytes()


def test_a_file_keeps_the_versions_that_made_its_grasps(plan, tmp_path):
    path = gc.save_grasps(tmp_path / "grasps.json", plan)
    old = json.loads(path.read_text())
    old["versions"]["numpy"] = "1.0"
    path.write_text(json.dumps(old))
    gc.save_grasps(path, gc.load_grasps(path)[:1])
    assert json.loads(path.read_text())["versions"]["numpy"] == "1.0"
