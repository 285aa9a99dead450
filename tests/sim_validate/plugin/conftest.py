"""The project, made once."""

import pytest

from grasp_core.files.text_files import write_text
from tests.sim_validate.plugin.project import run_pytest
from tests.sim_validate.rigs import saved_plan


@pytest.fixture(scope="module")
def blessed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project")
    saved_plan(folder, limit=2)
    write_text(folder / "wedge.grasps.toml", 'grasps = "grasps.json"\n')
    code, said = run_pytest(folder, "--grasp-bless")
    assert code == 0, said
    assert (folder / "wedge.baseline.json").is_file()
    return folder
