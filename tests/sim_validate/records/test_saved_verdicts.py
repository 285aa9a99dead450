import json
from dataclasses import replace

import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.main import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verdicts")
    plan = gc.plan(scenes.example_object("wedge"), 0.5, limit=2)
    gc.save_grasps(folder / "grasps.json", plan)
    assert main(["validate", str(folder / "grasps.json"), "--out", str(folder)]) == 0
    return folder


def test_verdicts_are_loaded_with_their_figures(folder):
    plan, found = gc.load_grasps(folder / "grasps.json"), sv.load_verdicts(folder / "verdicts.json")
    assert found.object_sha256 == plan.body.content_sha256
    assert (found.friction, found.complete, len(found)) == (0.5, True, 2)
    for grasp, verdict in zip(plan, found, strict=True):
        assert verdict is found[grasp.id]
        assert verdict.held
        assert verdict.outcome is sv.Outcome.HELD
        assert verdict.controls_let_go
        assert verdict.predicted_critical_friction == pytest.approx(grasp.critical_friction)
        assert 0.0 <= verdict.displacement_m < 1e-3
    assert found[0] is found.verdicts[0]
    assert found[-1].id in found
    assert found[1:] == replace(found, verdicts=found.verdicts[1:])
    with pytest.raises(KeyError, match="c-9"):
        found["c-9"]
    assert sv.load_verdicts(folder / "verdicts.json") == found


def test_a_control_that_holds_is_told(folder, tmp_path):
    document = json.loads((folder / "verdicts.json").read_text())
    controls = document["verdicts"][0]["controls"]
    next(iter(controls.values()))["wrenches"][0]["outcome"] = "held"
    path = tmp_path / "verdicts.json"
    path.write_text(json.dumps(document))
    assert [verdict.controls_let_go for verdict in sv.load_verdicts(path)] == [False, True]


def test_other_files_are_refused(folder, tmp_path):
    with pytest.raises(gc.InputError, match=r"grasps\.json: "):
        sv.load_verdicts(folder / "grasps.json")
    with pytest.raises(gc.InputError, match="cannot be read"):
        sv.load_verdicts(tmp_path / "none.json")
