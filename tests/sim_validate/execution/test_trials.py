"""Which trials an execution consists of."""

from dataclasses import replace

import numpy as np
import pytest

import sim_validate as sv
from scenes.mujoco.held_scene import SAMPLE_S
from sim_validate.execution.trials import Skipped, trials_of
from tests.grasp_core.execution.held import box
from tests.sim_validate.execution.held_rigs import G, box_scene

SETTINGS = sv.ExecutionSettings(0.3)


def listed(**changes):
    return trials_of(box(), box_scene().layout, replace(SETTINGS, **changes), 30.0)


def test_every_kind_has_its_trials():
    trials, skipped = listed(misplacements=3)
    assert not skipped
    counts = {kind: sum(t.kind == kind for t in trials) for kind in SETTINGS.trials}
    assert counts == {"weight": 1, "lift": 1, "shake": 6, "stop": 6, "knock": 6, "misplaced": 3}
    assert len({trial.name for trial in trials}) == len(trials)
    assert all(trial.name.startswith(trial.kind) for trial in trials)


@pytest.mark.parametrize(("kind", "setting"), [("shake", "shake_g"), ("knock", "knock_n_s")])
def test_trials_of_no_size_are_left_out_with_a_reason(kind, setting):
    trials, skipped = listed(trials=("weight", kind), **{setting: 0.0})
    assert [trial.kind for trial in trials] == ["weight"]
    (left_out,) = skipped
    flag = setting.replace("_", "-")
    assert left_out == Skipped(kind, f"its size is 0 ({setting}, --{flag})")
    trials, skipped = listed(trials=("weight", kind), **{setting: 1e-6})
    assert len(trials) == 7
    assert not skipped


def test_trials_begin_before_their_load_comes():
    """At `begun` the object is squeezed, and nothing of the load is there."""
    trials, _ = listed()
    for trial in trials:
        drive, begun = trial.drive, trial.begun
        if trial.apart:
            assert (drive.grasping[begun] == 1.0).all()
            assert drive.shares[begun] == 0.0
        else:
            assert begun == 0
            assert drive.shares[0] < 0.01
        assert not drive.accelerations[:begun].any()


def test_shakes_have_the_acceleration_of_the_settings_at_the_surface():
    trials, _ = listed(trials=("shake",), shake_g=2.0, shake_hz=4.0)
    radius = box_scene().layout.radius_m
    for axis, trial in enumerate(trials):
        peak = np.abs(trial.drive.accelerations).max(axis=0)
        expected = np.zeros(6)
        expected[axis] = 2.0 * G / (1.0 if axis < 3 else radius)
        assert peak == pytest.approx(expected, rel=0.01)


def test_stops_and_knocks_come_from_every_side():
    for kind in ("stop", "knock"):
        trials, _ = listed(trials=(kind,))
        ways = []
        for trial in trials:
            sums = SAMPLE_S * (
                trial.drive.accelerations[:, :3] if kind == "stop" else trial.drive.wrenches[:, :3]
            ).sum(axis=0)
            ways.append(sums)
        sizes = np.linalg.norm(ways, axis=1)
        expected = SETTINGS.stop_from_m_per_s if kind == "stop" else SETTINGS.impulse_n_s
        assert sizes == pytest.approx(expected)
        assert np.linalg.matrix_rank(np.array(ways)) == 3
        assert np.sum(ways, axis=0) == pytest.approx(np.zeros(3), abs=1e-12)


def test_the_box_is_lifted_from_the_table_under_it():
    (trial,), _ = listed(trials=("lift",))
    table = trial.drive.table
    points = box().vertices - box().center_of_mass
    heights = (points - table.point) @ table.normal
    assert heights.min() == pytest.approx(0.0, abs=1e-9)
    assert trial.drive.gravity[-1] == pytest.approx(-G * table.normal)
    layout = box_scene().layout
    clear = (layout.tip_centers - table.point) @ table.normal - layout.tip_radius_m
    assert clear.min() > 0.0
    assert abs(table.normal @ [1, 0, 0]) == pytest.approx(0.0)


def test_a_misplaced_object_is_predicted_in_its_planned_place():
    trials, _ = listed(trials=("misplaced",), misplacements=2)
    for trial in trials:
        assert trial.drive.pose is not None
        assert trial.drive.reached.shape == (4, 3)
        assert trial.expected.pose is None
        np.testing.assert_array_equal(
            trial.expected.gravity, trial.drive.gravity[trial.begun + 1 :]
        )
