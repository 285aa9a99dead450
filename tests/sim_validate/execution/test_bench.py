"""Held objects in the simulator, against mechanics by hand."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
from scenes.mujoco.held_scene import SAMPLE_S
from sim_validate.execution import paths
from sim_validate.execution.bench import HeldBench, outcome
from sim_validate.execution.paths import Pose, Table, idle
from tests.grasp_core.execution.held import box
from tests.sim_validate.execution.held_rigs import (
    MASS,
    G,
    box_bench,
    box_grip,
    box_scene,
    squeezed,
)

DOWN = np.array([0.0, 0.0, -G])
UP = np.array([0.0, 0.0, 1.0])
FIELDS = ("moved", "turned", "palm", "tips", "forces", "table")


def ran(*drives, start=None, **rig):
    state = squeezed(**rig) if start is None else start
    motions = box_bench(**rig).run(drives, state)
    assert not any(motion.health.fault for motion in motions)
    return motions


def in_world(motion):
    """Contact forces along the world's axes, (n, k, 3)."""
    return np.einsum("kij,nkj->nki", box_scene().layout.axes, motion.forces)


def same(one, other):
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def several():
    """Trials of different lengths."""
    return (
        paths.weighed(DOWN, paths.samples(0.3)),
        paths.shake(DOWN, np.array([0, 6.0, 0, 0, 0, 0]), 10.0),
        paths.knock(DOWN, np.array([0.02, 0, 0]), np.array([0, 0.01, 0])),
        paths.stop(DOWN, UP, 10.0, 0.3),
    )


def test_the_squeeze_comes_and_leaves_the_object_where_it_is():
    motion, _ = box_bench().settled(paths.closing())
    assert not motion.health.fault
    assert motion.forces[-1] == pytest.approx(box_scene().layout.pushes, rel=1e-3, abs=1e-6)
    assert np.abs(motion.moved).max() < 1e-6
    assert motion.table == pytest.approx(np.zeros_like(motion.table), abs=1e-9)


@pytest.mark.parametrize("stiffness", [2000.0, 10000.0])
def test_the_weight_sinks_by_load_over_stiffness(stiffness):
    """Across the pushes four equal springs carry it; contacts give a little beside them."""
    (motion,) = ran(paths.weighed(DOWN, paths.samples(1.0)), stiffness=stiffness)
    assert motion.moved[-1] == pytest.approx([0, 0, -MASS * G / (4 * stiffness)], abs=1e-6)
    assert in_world(motion)[-1, :, 2] == pytest.approx(MASS * G / 4, rel=1e-3)


def test_an_object_that_is_let_go_falls():
    """Fingers open in an instant and swing outwards; it is free from then on."""
    count = 80
    falling = replace(
        idle(count), gravity=np.tile(DOWN, (count, 1)), grasping=np.full(count, -2.0),
        shares=np.ones(count),
    )  # fmt: skip
    (motion,) = ran(falling)
    assert not motion.forces[20:].any()
    fallen = motion.moved[20:, 2]
    speeds = np.diff(fallen) / SAMPLE_S
    assert np.diff(speeds) / SAMPLE_S == pytest.approx(-G, rel=1e-6)
    assert outcome(motion, falling, np.full(4, 0.5)).dropped


def test_a_held_object_swings_at_its_natural_frequency():
    """Struck across the pushes, it crosses its place after half of the damped period of
    M = m + 4 m_t on four springs. The integrator adds omega h / 2 = 0.08 to the damping ratio."""
    light = scenes.HeldSettings(mass_kg=MASS, damping_ratio=0.05)
    scene = scenes.build_held_scene(box(), box_grip(), light)
    strike = np.zeros((100, 6))
    strike[0, 2] = 2.0
    bench = HeldBench(scene)
    _, state = bench.settled(paths.closing(0.5))
    (motion,) = bench.run([replace(idle(100), wrenches=strike)], state)
    heights = motion.moved[:, 2]
    down = np.flatnonzero((heights[:-1] > 0) & (heights[1:] <= 0))[0]
    crossing = down + heights[down] / (heights[down] - heights[down + 1])
    rate = np.sqrt(4 * 2000.0 / (MASS + 4 * scene.layout.tip_mass_kg))
    zeta = 0.05 + 0.5 * rate * scene.physics.timestep
    half = np.pi / (rate * np.sqrt(1.0 - zeta**2))
    # the strike lasts a sample, and its middle is half a sample after the start
    assert (crossing + 0.5) * SAMPLE_S == pytest.approx(half, rel=0.05)


def test_the_palm_follows_its_path_and_takes_the_object_along():
    drive, begun = paths.lift(UP, 0.2, 0.6)
    height = box().center_of_mass[2] - box().vertices[:, 2].min()
    (motion,) = box_bench().run([replace(drive, table=Table(-height * UP, UP))])
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


def test_a_turn_of_the_palm_takes_the_object_along():
    drive = paths.shake(0 * DOWN, np.array([0, 0, 0, 0, 0, 30.0]), 5.0)
    (motion,) = ran(drive)
    assert np.abs(motion.palm[:, 5]).max() > 0.02
    assert np.abs(motion.palm[:, :5]).max() < 1e-4
    angles = 2.0 * np.arctan2(motion.turned[:, 3], motion.turned[:, 0])
    assert angles[-1] == pytest.approx(motion.palm[-1, 5], abs=5e-3)


def test_uniform_motion_changes_nothing():
    """Galilei: a knock in a hand that moves at 2 m/s, seen from the hand."""
    knock = several()[2]
    still, moving = ran(knock, replace(knock, velocity=np.array([2.0, -1.0, 0.5])))
    assert moving.palm[-1, :3] == pytest.approx(len(knock) * SAMPLE_S * np.array([2.0, -1.0, 0.5]))
    assert moving.shifts == pytest.approx(still.shifts, abs=1e-8)
    assert moving.pushes == pytest.approx(still.pushes, abs=1e-4)


def test_results_depend_on_no_company_order_or_threads():
    drives = several()
    together = ran(*drives)
    back = ran(*drives[::-1])[::-1]
    (alone,) = ran(drives[1])
    threaded = HeldBench(box_scene(), threads=2).run(drives, squeezed())
    same(together[1], alone)
    for one, reversed_, two in zip(together, back, threaded, strict=True):
        same(one, reversed_)
        same(one, two)


def test_a_trial_in_two_parts_is_the_trial():
    """What the settled state holds is all that the future depends on."""
    whole, _ = box_bench().settled(paths.closing().then(several()[0]))
    (rest,) = ran(several()[0])
    first = len(paths.closing())
    np.testing.assert_array_equal(whole.moved[first:], rest.moved)
    np.testing.assert_array_equal(whole.forces[first:], rest.forces)


def test_friction_is_that_of_each_contact():
    """Only two fingers across from each other hold, and carry the weight in halves."""
    light = 0.8 * 2 * 0.5 * 5.0 / G
    friction = np.array([0.5, 0.0, 0.0, 0.5])
    drive = paths.weighed(DOWN, paths.samples(0.4))
    bench = box_bench(mass=light)
    (motion,) = bench.run([replace(paths.closing().then(drive), friction=friction)])
    assert not motion.health.fault
    across = np.linalg.norm(motion.forces[..., 1:], axis=2)
    assert across[:, 1:3].max() < 1.1e-5 * 5.0  # the simulator's least friction is 1e-5
    assert across[-1, [0, 3]] == pytest.approx(light * G / 2, rel=0.02)


def test_a_displaced_object_starts_where_it_is():
    pose = Pose(np.array([0.0, 1e-3, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    reached = np.zeros((4, 3))
    bench = box_bench()
    (motion,) = bench.run([replace(paths.closing(), pose=pose, reached=reached)])
    assert not motion.health.fault
    assert motion.moved[0] == pytest.approx(pose.moved, abs=1e-6)
    assert motion.forces[-1] == pytest.approx(box_scene().layout.pushes, abs=0.05)


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
