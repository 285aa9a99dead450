"""Clips: motions made larger as they are, and drawn where graphics are available."""

import math

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

import scenes
from scenes.drawing.clips import MOST, VISIBLE, GraphicsError, magnified, write_clip
from tests.sim_validate.rigs import grasps


@pytest.fixture(scope="module")
def scene():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    return scenes.build_scene(body, grasp, 0.5)


def joints_of(scene, shifts, turns, slides):
    """Joint positions of a scene whose grasp's centre is shifted and turned."""
    center = scene.layout.center
    rotation = Rotation.from_rotvec(turns)
    places = center + shifts - rotation.apply(center)
    return np.column_stack([places, rotation.as_quat(scalar_first=True), slides])


def test_every_motion_is_multiplied_by_one_factor(scene):
    rng = np.random.default_rng(0)
    shifts, turns, slides = (1e-8 * rng.normal(size=(5, n)) for n in (3, 3, 12))
    shifts[0] = turns[0] = slides[0] = 0.0
    larger, factor = magnified(joints_of(scene, shifts, turns, slides), scene)
    assert factor == MOST
    wanted = joints_of(scene, factor * shifts, factor * turns, factor * slides)
    np.testing.assert_allclose(larger, wanted, atol=1e-12)


def test_what_moved_before_the_first_sample_is_not_shown(scene):
    shifts, turns = np.full((2, 3), 1e-7), np.full((2, 3), 1e-6)
    larger, _ = magnified(joints_of(scene, shifts, turns, np.full((2, 12), 1e-6)), scene)
    np.testing.assert_allclose(larger[:, :3], 0.0, atol=1e-15)
    np.testing.assert_allclose(larger[:, 3:7], [[1.0, 0.0, 0.0, 0.0]] * 2, atol=1e-15)
    np.testing.assert_array_equal(larger[:, 7:], 0.0)


@pytest.mark.parametrize("share", [0.5, 0.03, 1e-3, 3e-5])
def test_motions_become_visible_and_no_larger(scene, share):
    size = scene.layout.grasp_size_m
    shifts = np.array([[0.0, 0.0, 0.0], [share * size, 0.0, 0.0]])
    _, factor = magnified(joints_of(scene, shifts, np.zeros((2, 3)), np.zeros((2, 12))), scene)
    if share > VISIBLE:
        assert factor == 1.0
        return
    assert VISIBLE / 2.0 < factor * share <= VISIBLE * (1.0 + 1e-9) or factor == MOST
    assert factor == float(f"{factor:.0e}")


@pytest.mark.slow
def test_a_clip_shows_the_object_moving(scene, tmp_path):
    still = np.zeros((6, 19))
    still[:, 3] = 1.0
    moving = still.copy()
    moving[:, 3:7] = [[math.cos(a), 0.0, math.sin(a), 0.0] for a in np.linspace(0.0, 0.5, 6)]
    try:
        path = write_clip(scene, moving, tmp_path / "new" / "clip.gif", "turning")
    except GraphicsError as error:
        pytest.skip(str(error))
    with Image.open(path) as clip:
        assert clip.n_frames == 6
        first = np.asarray(clip.convert("RGB")).astype(int)
        clip.seek(5)
        last = np.asarray(clip.convert("RGB")).astype(int)
    assert np.unique(first.reshape(-1, 3), axis=0).shape[0] > 20
    changed = (np.abs(first - last).max(axis=2) > 30).mean()
    assert 0.01 < changed < 0.5


def test_without_graphics_the_message_says_so(scene, tmp_path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "no-such-library")
    with pytest.raises(
        GraphicsError, match=r"MuJoCo cannot draw on this machine: no-such-library: .+"
    ):
        write_clip(scene, np.eye(1, 19, 3), tmp_path / "clip.gif", "")
    assert not list(tmp_path.iterdir())
