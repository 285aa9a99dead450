"""Grasps executed with a hand end as they are predicted to, and weak hands lose the object."""

from dataclasses import replace

import numpy as np
import pytest

import sim_validate as sv
from grasp_core.errors import InputError
from sim_validate.hands.execute import HandHolder, hand_execution_settings
from tests.grasp_core.hands.gripping import FRICTION, scaled
from tests.sim_validate.hands.executing import MASS, OBJECT, RADIUS, stood

NEAR = 0.02
"""Relative error of multiples of first slip: predictions are linear, and under these loads objects
move by a hundredth of their radius; contacts in simulation creep by as much again at most."""


def executed(name, **changes):
    reach, hand = stood(name)
    settings = replace(hand_execution_settings(MASS), **changes)
    return sv.execute_hand(hand, scaled(OBJECT, RADIUS), reach, FRICTION, settings)


@pytest.mark.parametrize("name", ["allegro", pytest.param("leap", marks=pytest.mark.slow)])
def test_a_hand_keeps_a_light_object_and_would_slip_where_it_is_predicted_to(name):
    found = executed(name, trials=("weight", "shake", "stop", "misplaced"), misplacements=2)
    assert len(found.trials) == 15
    assert found.survived, [trial for trial in found.trials if not trial.survived]
    assert len(found.controls) == 3
    assert found.controls_let_go
    assert found.load_multiple > 1.0
    placed = [trial for trial in found.trials if trial.kind != "misplaced"]
    assert max(trial.displacement_m for trial in placed) <= 0.5 * NEAR * RADIUS
    multiples = np.array([(t.predicted_first_slip, t.simulated_first_slip) for t in placed])
    assert multiples.min() > 1.0
    errors = multiples[:, 1] / multiples[:, 0] - 1.0
    assert np.abs(errors).max() < NEAR, errors


def test_an_object_ten_times_as_heavy_as_motors_carry_is_lost_and_an_open_hand_refused():
    reach, hand = stood("allegro")
    body = scaled(OBJECT, RADIUS)
    able = HandHolder(body, hand, reach, FRICTION).squeeze(hand_execution_settings(MASS))
    heavy = 10.0 * able.scale * MASS
    found = sv.execute_hand(
        hand, body, reach, FRICTION, replace(hand_execution_settings(heavy), trials=("weight",))
    )
    assert not found.survived
    assert found.least_predicted_loss < 1.0
    with pytest.raises(InputError, match="not in force closure"):
        sv.execute_hand(hand, body, reach, 0.001)
