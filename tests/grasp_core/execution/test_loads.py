import numpy as np
import pytest

import grasp_core as gc

G = 9.80665


def test_a_weight_in_any_direction_is_a_ball_of_forces():
    loads = gc.any_direction(0.5, 2.0)
    assert not loads.offset.any()
    assert loads.axes[:3] == pytest.approx(0.5 * (G + 2.0) * np.eye(3))
    assert not loads.axes[3:].any()


def test_gravity_of_a_palm_that_does_not_turn_is_the_offset():
    loads = gc.any_direction(0.5, 2.0, gravity=[0.0, 0.0, -G])
    assert loads.offset == pytest.approx([0, 0, -0.5 * G, 0, 0, 0])
    assert loads.axes[:3] == pytest.approx(np.eye(3))
