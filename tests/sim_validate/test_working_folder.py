"""Commands leave nothing in the working folder, whatever MuJoCo warns of."""

import re

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.engine.stepping import compiled
from sim_validate.main import main
from tests.scenes.meshes import box_obj
from tests.three_fingers import THREE_TIPS, three_fingers_mjcf


@pytest.fixture
def noisy(tmp_path):
    """A box with a texture coordinate that is missing, of which MuJoCo warns."""
    path = tmp_path / "noisy.obj"
    text = re.sub(r" (\d+)(?= |$)", r" \1/9", box_obj(0.01, 0.01, 0.01), flags=re.MULTILINE)
    path.write_text(f"vt 0 0\n{text}")
    return path


@pytest.fixture
def empty(tmp_path, monkeypatch):
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


def test_a_hand_of_which_mujoco_warns_leaves_nothing(noisy, empty, capfd):
    text = three_fingers_mjcf().replace('type="cylinder"', 'type="mesh" mesh="noisy"')
    asset = f'<asset><mesh file="{noisy.name}"/></asset>'
    path = noisy.with_name("hand.xml")
    path.write_text(text.replace("</mujoco>", f"{asset}</mujoco>"))
    assert main(["hand", str(path), "--fingertips", ",".join(THREE_TIPS)]) == Exit.GOOD
    said = capfd.readouterr()
    assert not said.err
    assert "WARNING" not in said.out
    assert not list(empty.iterdir())


def test_a_scene_of_which_mujoco_warns_leaves_nothing(noisy, empty, capfd):
    scene = f'<asset><mesh name="m" file="{noisy}"/></asset><worldbody><geom type="mesh" mesh="m"/>'
    assert compiled(f"<mujoco>{scene}</worldbody></mujoco>").nmesh == 1
    assert not "".join(capfd.readouterr())
    assert not list(empty.iterdir())
