"""How the simulator is started, stepped and kept quiet."""

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from scenes.mujoco.silent_mujoco import unlogged
from sim_validate.engine.bench import compiled

FALLING = """<mujoco><option integrator="discrete"/><worldbody><body><freejoint/>
<geom size=".1" mass="1"/></body></worldbody></mujoco>"""


def test_text_that_is_no_scene_is_refused():
    for text in ("", "<mujoco", "<mujoco><nonsense/></mujoco>"):
        with pytest.raises(gc.InputError, match="MuJoCo cannot compile the scene"):
            compiled(text)


def test_warnings_leave_no_file_behind(tmp_path, monkeypatch):
    """A state that is not a number makes the simulator warn."""
    monkeypatch.chdir(tmp_path)
    model = compiled(FALLING)
    data = mujoco.MjData(model)
    data.qpos[0] = np.nan
    before = mujoco.MjLogConfig.get().logto_file
    with unlogged():
        mujoco.mj_step(model, data)
    assert data.warning.number.sum() > 0
    assert not list(tmp_path.iterdir())
    assert mujoco.MjLogConfig.get().logto_file == before
