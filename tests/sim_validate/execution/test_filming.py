"""Clips of executions: which trials are filmed, and what a clip shows."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from scenes.drawing.clips import GraphicsError
from sim_validate.execution import filming
from sim_validate.execution.execute import ExecutionJob
from sim_validate.execution.filming import FRAMES, film, worth_seeing
from sim_validate.settings import ExecutionSettings
from tests.scenes.drawing.whole import frames_of
from tests.sim_validate.execution.executed import execution, trial
from tests.sim_validate.rigs import grasps

SETTINGS = ExecutionSettings(0.2, trials=("lift", "shake"), shake_g=1.0)
FRICTION = 0.5


def chosen(*trials):
    return [each.name for each in worth_seeing(execution(*trials))]


LIFT, EASY = trial("lift"), trial("shake", "shake along x", simulated_first_slip=1.8)
HARD = trial("shake", "shake about z", simulated_first_slip=1.2)


def test_the_lift_and_the_worst_shake_are_filmed():
    stop = trial("stop", "stop +x", simulated_first_slip=1.1)
    assert chosen(LIFT, EASY, HARD, stop) == ["lift", "shake about z"]
    lost = replace(EASY, survived=False)
    assert chosen(trial("weight"), HARD, lost) == ["shake along x"]
    alike = replace(EASY, predicted_first_slip=1.5), replace(EASY, name="y", predicted_first_slip=1)
    assert chosen(*alike) == ["y"]
    assert chosen() == []


def test_the_worst_slip_is_filmed_once():
    slid = trial("stop", "stop +x", fate="slipped", slip_m=2e-3)
    less = trial("stop", "stop -x", fate="slipped", slip_m=1e-3)
    dropped = trial("knock", "knock +x", survived=False, fate="dropped", slip_m=1e-4)
    unseen = trial("stop", "stop -x", fate="slipped", slip_m=1e-6)
    assert chosen(EASY, unseen) == ["shake along x"]
    assert chosen(EASY, less, slid) == ["shake along x", "stop +x"]
    assert chosen(EASY, slid, less, dropped) == ["shake along x", "knock +x"]
    assert chosen(replace(HARD, fate="slipped"), EASY) == ["shake about z"]


@pytest.fixture(scope="module")
def held():
    """A grasp of which no fingertip is in the way of a table."""
    body, (_, grasp) = grasps("wedge", FRICTION, 2, ("concurrent",), "tilted")
    return body, grasp


def test_a_trial_that_there_is_not_is_refused(held, tmp_path):
    with pytest.raises(gc.InputError, match=r"name must be .*shake along x.*got 'stop"):
        film(ExecutionJob(*held, FRICTION, SETTINGS), "stop +x", tmp_path / "clip.gif")
    assert not list(tmp_path.iterdir())


def test_what_is_filmed_is_the_motion_in_its_true_size_and_slowed_down(held, monkeypatch):
    """The palm follows the shake: a over omega squared to either side of its middle. The time of
    0.75 s is that of the frames over the factor that the caption says."""
    asked = {}

    def write(_scene, joints, path, caption, **more):
        asked.update(joints=joints, caption=caption, **more)
        return path

    monkeypatch.setattr(filming, "write_held_clip", write)
    film(ExecutionJob(*held, FRICTION, SETTINGS), "shake along z", held[0].name)
    count = len(asked["joints"])
    assert count >= FRAMES
    name, _, slower = asked["caption"].partition(", ")
    assert name == "shake along z"
    factor = float(slower.removesuffix(" times slower"))
    assert count / 25.0 / factor == pytest.approx(0.15 + 3.0 / SETTINGS.shake_hz, rel=0.03)
    palm = asked["joints"][:, 7:10]
    assert np.abs(palm[:, :2]).max() < 1e-4
    reach = 9.80665 / (2.0 * np.pi * SETTINGS.shake_hz) ** 2
    assert 1.5 * reach < np.ptp(palm[:, 2]) < 2.5 * reach
    np.testing.assert_allclose(asked["joints"][:, :3], palm, atol=3e-3)
    np.testing.assert_allclose(asked["up"], [0.0, 0.0, 1.0], atol=1e-12)
    assert asked["table"] is None


@pytest.mark.slow
def test_a_clip_of_a_lift_shows_the_object_rising(held, tmp_path):
    try:
        path = film(ExecutionJob(*held, FRICTION, SETTINGS), "lift", tmp_path / "lift.gif")
    except GraphicsError as error:
        pytest.skip(str(error))
    count, first, last = frames_of(path, 0, -1)
    assert count > FRAMES // 2  # equal frames at the start and at the end are one
    assert (np.abs(first - last).max(axis=2) > 30).mean() > 0.01
