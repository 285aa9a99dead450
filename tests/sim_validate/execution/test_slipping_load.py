"""Controls of executions bear loads that slip, and fingertips meet the same surface as before."""

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from scenes.example_objects import example_object
from scenes.execution.held import held_layout
from sim_validate.execution import slips, trials
from sim_validate.execution.controls import slipping_load
from sim_validate.execution.execute import chosen_squeeze

FRICTION = 0.5
SETTINGS = sv.ExecutionSettings(mass_kg=0.55)


@pytest.fixture(scope="module")
def bracket():
    body = example_object("l-bracket")
    return body, gc.plan(body, FRICTION, families=("pencil",), limit=8).grasps


def test_the_slipping_load_slips_also_where_a_push_reaches_its_limit_first(bracket):
    """Some of these squeezes end at a limit of 10 N, which simulated springs do not have."""
    body, grasps = bracket
    limited = 0
    for grasp in grasps:
        best = chosen_squeeze(body, grasp, FRICTION, SETTINGS)
        load = slipping_load(best)
        slip = gc.first_slip(best.grip, load, model="linear")
        assert slip.event == "slip"
        assert slip.multiple == pytest.approx(1.0, rel=1e-6)
        assert np.linalg.norm(load) >= np.linalg.norm(best.load) * (1.0 - 1e-6)
        limited += gc.first_slip(best.grip, best.load, model="linear").multiple > 1.01
    assert 0 < limited < len(grasps)


def test_fingertips_meet_the_same_points_of_triangles_nearby_as_of_all(bracket, monkeypatch):
    body, grasps = bracket
    best = chosen_squeeze(body, grasps[0], FRICTION, SETTINGS)
    layout = held_layout(body, best.grip, SETTINGS.mass_kg)
    near = trials._near(layout, layout.tip_centers[:1], 1e-3)
    assert 0 < len(near) < len(layout.triangles)
    poses = trials.misplacements(layout, 2e-3, 0.03, 20, seed=1)
    few = trials.met(layout, poses, 2e-3, 0.03)
    monkeypatch.setattr(trials, "_near", lambda layout, *_: layout.triangles)
    np.testing.assert_array_equal(few, trials.met(layout, poses, 2e-3, 0.03))


def test_a_slip_in_the_first_sample_of_a_load_has_a_multiple():
    """Before it nothing has changed and no load is there: nothing can be extrapolated from that."""
    forces = np.array([[[1.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], [[1.0, 0.6, 0.0]]])
    still, unmoved = np.zeros((3, 1, 3)), np.tile(np.eye(3), (3, 1, 1))
    found = slips.Seen(still[:, 0], unmoved, unmoved[:, None], still, forces)
    shares = np.array([0.0, 0.0, 0.3])
    assert slips._first_slip(found, shares, np.array([FRICTION]), 0) == 0.3
