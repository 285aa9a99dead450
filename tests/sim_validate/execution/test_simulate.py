"""Held objects in the simulator, against mechanics by hand."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
from scenes.settings import SAMPLE_S
from sim_validate.execution import paths
from sim_validate.execution.paths import TablePlane
from sim_validate.execution.simulate import HeldBench
from tests.grasp_core.execution.held import box
from tests.sim_validate.execution.held_rigs import MASS, G, box_bench, box_grip, box_scene

DOWN = np.array([0.0, 0.0, -G])
UP = np.array([0.0, 0.0, 1.0])


def test_the_squeeze_comes_and_leaves_the_object_where_it_is():
    motion, _ = box_bench().settled(paths.closing())
    assert not motion.health.fault
    assert motion.forces[-1] == pytest.approx(box_scene().layout.pushes, rel=1e-3, abs=1e-6)
    assert np.abs(motion.moved).max() < 1e-6
    assert motion.table == pytest.approx(np.zeros_like(motion.table), abs=1e-9)


def test_the_palm_follows_its_path_and_takes_the_object_along():
    drive, begun = paths.lift(UP, 0.2, 0.6)
    height = box().center_of_mass[2] - box().vertices[:, 2].min()
    (motion,) = box_bench().run([replace(drive, table=TablePlane(-height * UP, UP))])
    assert not motion.health.fault
    speeds = SAMPLE_S * np.cumsum(drive.accelerations[:, 2])
    path = SAMPLE_S * np.cumsum(speeds - 0.5 * SAMPLE_S * drive.accelerations[:, 2])
    # within a step the simulator's palm has the velocity at the end of it
    late = 0.5 * box_scene().physics.timestep * speeds.max()
    assert motion.palm[:, 2] == pytest.approx(path, abs=1.01 * late)
    assert motion.palm[-1, 2] == pytest.approx(0.2, rel=1e-3)
    assert motion.moved[-1, 2] - motion.palm[-1, 2] == pytest.approx(-MASS * G / 8000.0, abs=1e-4)
    assert np.abs(motion.palm[:, [0, 1, 3, 4, 5]]).max() < 1e-4
    # the table carries the weight before the lift, and nothing after it
    assert motion.table[begun - 1] == pytest.approx([0, 0, MASS * G], abs=0.01)
    assert motion.table[-1] == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_finger_that_meets_nothing_pushes_nothing():
    """Its base stands away from the object; its spring moves it freely by push over stiffness."""
    layout = box_scene().layout
    reached = np.zeros((4, 3))
    reached[0] = -0.02 * layout.axes[0].T @ layout.frames[0, :, 0]
    bench = box_bench()
    (motion,) = bench.run([replace(paths.closing(0.5), reached=reached)])
    assert not motion.health.fault
    assert not motion.forces[:, 0].any()
    travel = motion.tips[-1, 0] - reached[0]
    assert np.linalg.norm(travel) == pytest.approx(5.0 / 2000.0, rel=1e-3)


def test_a_sample_must_be_a_number_of_steps():
    physics = replace(box_scene().physics, timestep=0.002)
    scene = scenes.build_held_scene(
        box(), box_grip(), scenes.HeldSettings(mass_kg=MASS), physics=physics
    )
    with pytest.raises(gc.InputError, match=r"timestep must divide .* 0\.00125"):
        HeldBench(scene)


def test_a_trial_ends_where_the_object_is_lost():
    """It falls from open fingers; another trial goes on."""
    falling = replace(paths.weighed(DOWN), grasping=np.zeros(60))
    held = paths.closing(0.2)
    scene = box_scene()
    whole = HeldBench(scene).run([falling, held])
    lost_m = 0.5 * float(np.abs(whole[0].moved[-1]).max())
    assert lost_m > 0.01
    ended = HeldBench(scene, lost_m=lost_m).run([falling, held])
    away = np.linalg.norm(whole[0].moved, axis=1)
    last = int(np.argmax(away > lost_m))
    np.testing.assert_array_equal(ended[0].moved[: last + 1], whole[0].moved[: last + 1])
    assert (ended[0].moved[last:] == whole[0].moved[last]).all()
    assert not ended[0].forces[last:].any()
    np.testing.assert_array_equal(ended[1].forces, whole[1].forces)
    (alone,) = HeldBench(scene, lost_m=lost_m).run([falling])
    np.testing.assert_array_equal(alone.joints, ended[0].joints)
