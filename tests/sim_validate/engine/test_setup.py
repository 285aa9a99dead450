import re

import numpy as np
import pytest

import grasp_core as gc
from sim_validate.engine.setup import Agenda, NamedWrench, Setup, setup_from_file, weights


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[physics]\ntimestp = 0.001\n", r"physics: no setting is named .timestp.*timestep"),
        ("timestep = 0.001\n", "no setting is named .timestep.; choose from fingers, physics"),
        ("[physics]\ngravity = [0.0, 0.0, -9.81]\n", r"gravity must be zero.*--weight-n"),
        ("[physics]\ncondim = 4\n", r"setup.toml: physics.condim must be 3"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path, text, words):
    path = tmp_path / "setup.toml"
    path.write_text(text)
    with pytest.raises(gc.InputError, match=words) as refusal:
        setup_from_file(path, Setup())
    assert str(refusal.value).count(str(path)) == 1


def test_weight_acts_at_the_centre_of_mass_along_each_direction_of_gravity():
    six = weights(2.0, ())
    assert len({each.name for each in six}) == 6
    forces = np.array([each.wrench[:3] for each in six])
    np.testing.assert_allclose(np.linalg.norm(forces, axis=1), 2.0)
    assert not forces.sum(axis=0).any()
    (down,) = weights(3.0, ((0.0, 0.0, -10.0),))
    np.testing.assert_array_equal(down.wrench, [0, 0, -3.0, 0, 0, 0])


def test_wrenches_of_one_name_are_refused_ours_included():
    push = np.array([1.0, 0, 0, 0, 0, 0])
    for name in ("+force_x", "weakest", "random_1"):
        with pytest.raises(gc.InputError, match=re.escape(f"two wrenches are named {name!r}")):
            Agenda(random_wrenches=2, wrenches=(NamedWrench(name, push),))
    with pytest.raises(gc.InputError, match="two wrenches are named 'a'"):
        Agenda(wrenches=(NamedWrench("a", push), NamedWrench("a", -push)))
    assert len(Agenda(wrenches=(NamedWrench("random_0", push),)).wrenches) == 1
