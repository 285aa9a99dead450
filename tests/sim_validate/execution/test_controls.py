"""Grips that are weaker than chosen must slip, by analysis and in simulation."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from scenes.example_objects import example_object
from sim_validate.execution.execute import SpringFingers
from sim_validate.execution.trials import SURE, slipping_load, weaker_grips

FRICTION = 0.5
SETTINGS = sv.ExecutionSettings(mass_kg=0.55, trials=("weight",))


def squeezed(name):
    body = example_object(name)
    for grasp in gc.plan(body, FRICTION, limit=4).grasps:
        fingers = SpringFingers(body, grasp.contacts, FRICTION)
        best = fingers.squeeze(SETTINGS)
        yield best, fingers.scene(SETTINGS, best).layout


@pytest.mark.parametrize("name", ["wedge", "l-bracket"])
def test_loads_of_controls_slip_by_analysis_with_a_quarter_to_spare(name):
    followed = 0
    for best, layout in squeezed(name):
        least = slipping_load(best)
        for weaker in weaker_grips(best, layout):
            share = np.linalg.norm(weaker.load) / np.linalg.norm(least)
            assert share >= 1.0 - 1e-12
            assert weaker.load == pytest.approx(share * least, rel=1e-12)
            assert weaker.idle == (weaker.pushing.min() == 0.0)
            if not weaker.idle:
                squeeze = weaker.pushing[:, None] * best.grip.squeeze
                grip = replace(best.grip, squeeze=squeeze, friction=weaker.friction)
                slip = gc.first_slip(grip, least)
                assert share == pytest.approx(max(1.0, SURE * slip.multiple), rel=1e-9)
                followed += 1
    assert followed >= 8


def test_an_object_that_slides_while_fingers_close_is_let_go():
    """Without its strongest finger this grasp slides at once, and then would carry the load."""
    body = example_object("box")
    grasps = gc.plan(body, FRICTION, families=("concurrent",), limit=8).grasps
    for grasp in grasps[:4]:
        found = sv.execute(body, grasp, FRICTION, SETTINGS)
        assert found.controls_let_go
        if found.controls[2].first_slip == 0.0:
            return
    pytest.fail("no grasp slides")


def test_the_slipping_load_slips_also_where_a_push_reaches_its_limit_first():
    """Some of these squeezes end at a limit of 10 N, which simulated springs do not have."""
    body = example_object("l-bracket")
    grasps = gc.plan(body, FRICTION, families=("pencil",), limit=8).grasps
    limited = 0
    for grasp in grasps:
        fingers = SpringFingers(body, grasp.contacts, FRICTION)
        best = fingers.squeeze(SETTINGS)
        load = slipping_load(best)
        slip = gc.first_slip(best.grip, load, model="linear")
        assert slip.event == "slip"
        assert slip.multiple == pytest.approx(1.0, rel=1e-6)
        assert np.linalg.norm(load) >= np.linalg.norm(best.load) * (1.0 - 1e-6)
        limited += gc.first_slip(best.grip, best.load, model="linear").multiple > 1.01
    assert 0 < limited < len(grasps)
