"""Clips: motions made larger as they are, and drawn where graphics are available."""

import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import grasp_core as gc
import scenes
from grasp_core.quality.contact_forces import even_forces
from scenes.drawing import clips
from scenes.drawing.clips import (
    MOST_ENLARGED,
    VISIBLE,
    GraphicsError,
    magnified,
    write_clip,
    write_held_clip,
)
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
    assert factor == MOST_ENLARGED
    wanted = joints_of(scene, factor * shifts, factor * turns, factor * slides)
    np.testing.assert_allclose(larger, wanted, atol=1e-12)


@pytest.mark.parametrize("share", [0.5, 0.03, 1e-3, 3e-5])
def test_motions_become_visible_and_no_larger(scene, share):
    size = scene.layout.grasp_size_m
    shifts = np.array([[0.0, 0.0, 0.0], [share * size, 0.0, 0.0]])
    _, factor = magnified(joints_of(scene, shifts, np.zeros((2, 3)), np.zeros((2, 12))), scene)
    if share > VISIBLE:
        assert factor == 1.0
        return
    assert VISIBLE / 2.0 < factor * share <= VISIBLE * (1.0 + 1e-9) or factor == MOST_ENLARGED
    assert factor == float(f"{factor:.0e}")


def test_without_graphics_the_message_says_so(scene, tmp_path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "no-such-library")
    said = r"MuJoCo cannot draw on this machine: no-such-library: .+"
    with pytest.raises(GraphicsError, match=said):
        write_clip(scene, np.eye(1, 19, 3), tmp_path / "clip.gif", "")
    assert not list(tmp_path.iterdir())


def test_without_pillow_the_extra_is_named(scene, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(GraphicsError, match=r"graspproof\[clips\]"):
        write_clip(scene, np.eye(1, 19, 3), tmp_path / "clip.gif", "")
    assert not list(tmp_path.iterdir())


def test_what_points_up_is_drawn_up(tmp_path, monkeypatch):
    """The motion of a palm and an object that shift together."""
    body, (grasp,) = grasps("wedge", 0.5, 1)
    squeeze = 3.0 * even_forces(grasp.positions, grasp.normals, 0.4)
    grip = gc.grip(body, grasp, 0.5, squeeze)
    held_scene = scenes.build_held_scene(body, grip, scenes.HeldSettings(mass_kg=0.2))
    up, parts = np.array([0.6, 0.0, 0.8]), {}
    joints = np.zeros((5, 25))
    joints[:, 3] = 1.0
    joints[:, :3] = joints[:, 7:10] = np.linspace(0.0, 0.3, 5)[:, None] * up
    table = (-0.1 * up, np.array([1.0, 0.0, 0.0, 0.0]))
    monkeypatch.setattr(clips, "_written", lambda path, **drawn: parts.update(drawn) or path)
    write_held_clip(held_scene, joints, tmp_path / "a.gif", "lift", up=up, table=table)
    np.testing.assert_allclose(parts["joints"][-1, :3], [0.0, 0.0, 0.3], atol=1e-12)
    np.testing.assert_allclose(parts["middle"], [0.0, 0.0, 0.15], atol=1e-12)
    np.testing.assert_allclose(parts["table"][:3], [0.0, 0.0, -0.1], atol=1e-12)
    for quaternion in (parts["palm"], parts["table"][3:], parts["joints"][0, 3:7]):
        turned = Rotation.from_quat(quaternion, scalar_first=True).apply(up)
        np.testing.assert_allclose(turned, [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_array_equal(parts["joints"][:, 7:], joints[:, 7:])  # in the palm's frame
    assert parts["radius"] >= 0.15 + held_scene.layout.radius_m
