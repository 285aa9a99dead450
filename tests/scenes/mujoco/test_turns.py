"""Rotation matrices of quaternions and of the palm's hinges are those about their axes."""

import numpy as np
import pytest

from scenes.mujoco.held_scene import hinged
from scenes.mujoco.mjcf_text import rotations


def turn_about(axis, angle):
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    c = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * c + (1 - np.cos(angle)) * c @ c


def quaternions(axis, angles):
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    half = 0.5 * np.asarray(angles)
    return np.column_stack([np.cos(half), np.sin(half)[:, None] * axis])


def test_rotations_of_quaternions_are_those_about_axes():
    rng = np.random.default_rng(0)
    for _ in range(20):
        axis, angle = rng.normal(size=3), rng.uniform(-3, 3)
        assert rotations(quaternions(axis, [angle]))[0] == pytest.approx(turn_about(axis, angle))


def test_hinges_turn_about_the_axes_that_the_earlier_ones_have_turned():
    a, b, c = 0.3, -0.7, 1.1
    x, y, z = np.eye(3)
    wanted = turn_about(x, a) @ turn_about(y, b) @ turn_about(z, c)
    assert hinged(np.array([[a, b, c]]))[0] == pytest.approx(wanted)
