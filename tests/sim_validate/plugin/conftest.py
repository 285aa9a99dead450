"""The project, made once."""

import pytest

import grasp_core as gc
from grasp_core.files.text_files import write_text
from grasp_core.records.grasps_json import plan_to_json
from scenes.example_objects import example_object
from tests.sim_validate.plugin.project import run_pytest


@pytest.fixture(scope="module")
def blessed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project")
    body = example_object("wedge")
    plan = gc.plan(body, 0.5, families=("concurrent",), limit=2)
    write_text(folder / "grasps.json", plan_to_json(body, plan))
    write_text(folder / "wedge.grasps.toml", 'grasps = "grasps.json"\n')
    code, said = run_pytest(folder, "--grasp-bless")
    assert code == 0, said
    assert (folder / "wedge.baseline.json").is_file()
    return folder
