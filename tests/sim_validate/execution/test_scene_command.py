"""The command `scene`: scenes of closure tests, and scenes in which an object of true mass is held.

Scenes of true mass are judged with MuJoCo itself, as a user opens them.
"""

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.scenes.mujoco.compiled import state_of

SETTLED_S = 2.0


def of_first(plan):
    """The command for the first grasp of a plan."""
    return ["scene", str(plan), "--grasp", gc.load_grasps(plan)[0].id]


@pytest.fixture
def words(wedge_plan):
    return of_first(wedge_plan)


def moved(path):
    """How far the object's centre moves in two seconds of `squeeze` [m], and its turn [rad]."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = state_of(model, "squeeze")
    place, turn = data.body("object").xipos.copy(), data.body("object").xquat.copy()
    for _ in range(round(SETTLED_S / model.opt.timestep)):
        mujoco.mj_step(model, data)
    cosine = min(1.0, abs(float(turn @ data.body("object").xquat)))
    return float(np.linalg.norm(data.body("object").xipos - place)), 2.0 * np.arccos(cosine), model


def test_an_object_of_true_mass_is_held_from_the_keyframe_on(bracket_plan, tmp_path):
    words = of_first(bracket_plan)
    assert main([*words, "--density-kg-m3", "500", "--out", str(tmp_path), "-q"]) == Exit.GOOD
    (path,) = tmp_path.iterdir()
    distance, angle, model = moved(path)
    assert distance < 2e-3
    assert angle < 0.05
    mass = 500.0 * scenes.example_object("l-bracket").volume
    assert model.body("object").mass == pytest.approx(mass, rel=1e-8)
    assert model.opt.gravity.tolist() == [0.0, 0.0, -9.80665]


def test_flags_of_the_hand_are_in_the_scene(words, tmp_path):
    flags = "--mass-kg 0.2 --tip-stiffness-n-per-m 3000 --tip-mass-kg 0.03 --tip-radius-m 0.004"
    words += [*flags.split(), "--down", "2", "0", "0", "--friction", "0.6"]
    assert main([*words, "--out", str(tmp_path), "-q"]) == Exit.GOOD
    (path,) = tmp_path.iterdir()
    distance, _, model = moved(path)
    assert distance < 2e-3
    assert model.body("object").mass == 0.2
    assert model.body("finger0").mass == 0.03
    assert model.geom("finger0").size[0] == 0.004
    assert model.geom("finger0").friction[0] == 0.6
    assert model.actuator_gainprm[0, 0] == pytest.approx(3000.0)
    assert model.opt.gravity.tolist() == [9.80665, 0.0, 0.0]


def test_a_mass_that_is_too_large_is_warned_of(words, tmp_path, capsys):
    words += ["--mass-kg", "3", "--out", str(tmp_path)]
    assert main(words) == Exit.GOOD
    assert "certified for 0.278 of the weight only" in capsys.readouterr().err
    (path,) = tmp_path.iterdir()
    assert moved(path)[0] > 2e-3


def test_a_grasp_that_no_squeeze_holds_has_no_scene(words, tmp_path, answer, capsys):
    words += ["--mass-kg", "0.3", "--friction", "0.01"]
    assert main([*words, "--out", str(tmp_path)]) == Exit.NEGATIVE
    assert "no scene: no squeeze carries any part of the weight" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    assert "no squeeze" in answer(*words, code=Exit.NEGATIVE)["absence"]


REFUSED = {
    "--mass-kg 1 --surface pads": "for scenes with scaled masses",
    "--tip-stiffness-n-per-m 1000": "give --mass-kg or --density-kg-m3 too",
}


@pytest.mark.parametrize("flags", REFUSED)
def test_flags_of_the_other_kind_of_scene_are_refused(words, tmp_path, capsys, flags):
    assert main([*words, *flags.split(), "--out", str(tmp_path)]) == Exit.USAGE
    assert REFUSED[flags] in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
