"""The drives of trials, integrated: the palm's velocity, its path, and what comes when."""

import numpy as np
import pytest

from scenes.settings import SAMPLE_S
from sim_validate.execution import paths
from tests.sim_validate.execution.held_rigs import G

DOWN = np.array([0.0, 0.0, -G])
UP = np.array([0.0, 0.0, 1.0])


def velocities(drive):
    """Return the speeds of the palm after each sample, (n, 6)."""
    start = np.append(drive.velocity, np.zeros(3))
    return start + SAMPLE_S * np.cumsum(drive.accelerations, axis=0)


def positions(drive):
    """Return where the palm is after each sample, as accelerations are constant in one, (n, 6)."""
    after = velocities(drive)
    before = np.vstack([np.append(drive.velocity, np.zeros(3)), after[:-1]])
    return SAMPLE_S * np.cumsum(0.5 * (before + after), axis=0)


@pytest.mark.parametrize(("height", "duration"), [(0.2, 0.6), (0.01, 0.05), (1.0, 3.0)])
def test_a_lift_ends_at_its_height_and_rests(height, duration):
    drive, begun = paths.lift(UP, height, duration)
    assert positions(drive)[-1] == pytest.approx([0, 0, height, 0, 0, 0], rel=1e-3)
    assert velocities(drive)[-1] == pytest.approx(np.zeros(6), abs=1e-12)
    assert not drive.accelerations[:begun].any()
    assert (np.diff(positions(drive)[begun:, 2]) >= -1e-15).all()
    assert (drive.gravity[begun:] == DOWN).all()
    assert (np.diff(drive.gravity[:, 2]) <= 0.0).all()
    assert len(drive.accelerations) == len(drive.wrenches) == len(drive.grasping) == len(drive)


def test_a_lift_has_the_least_jerk():
    """Its position is 10 u^3 - 15 u^4 + 6 u^5, and its largest acceleration 10 h / (sqrt(3) T^2).
    Speeds that are straight between samples are off by dt^2 / 12 times the acceleration."""
    drive, begun = paths.lift(UP, 0.2, 0.6)
    u = np.arange(1, 121) / 120
    path = 0.2 * (10 * u**3 - 15 * u**4 + 6 * u**5)
    peak = 10 * 0.2 / (np.sqrt(3.0) * 0.6**2)
    off = 1.01 * SAMPLE_S**2 / 12 * peak
    assert positions(drive)[begun : begun + 120, 2] == pytest.approx(path, abs=off)
    assert np.abs(drive.accelerations).max() == pytest.approx(peak, rel=2e-3)


@pytest.mark.parametrize("give", [2e-4, 1e-3, 1.0])
def test_fingers_take_the_weight_as_far_as_the_palm_has_risen(give):
    """Springs that the weight bends by `give` carry z / give of it at the height z; those that it
    bends farther than the lift goes carry all of it at the end."""
    drive, begun = paths.lift(UP, 0.2, 0.6, give)
    risen = positions(drive)[begun : begun + 120, 2]
    wanted = np.minimum(risen / min(give, 0.2), 1.0)
    off = 1.01 * SAMPLE_S**2 / 12 * np.abs(drive.accelerations).max() / min(give, 0.2)
    assert drive.shares[begun : begun + 120] == pytest.approx(wanted, abs=off)
    assert (np.diff(drive.shares) >= 0.0).all()
    assert drive.shares[-1] == 1.0


@pytest.mark.parametrize(
    ("deceleration", "speed"), [(10.0, 0.5), (1.0, 0.5), (50.0, 0.5), (10.0, 0.02), (3.0, 2.0)]
)
def test_a_stop_ends_all_motion_at_no_more_than_its_deceleration(deceleration, speed):
    way = np.array([0.6, 0.0, -0.8])
    drive = paths.stop(DOWN, way, deceleration, speed)
    assert drive.velocity == pytest.approx(speed * way)
    assert velocities(drive)[-1] == pytest.approx(np.zeros(6), abs=1e-12)
    sizes = np.linalg.norm(drive.accelerations, axis=1)
    assert sizes.max() <= deceleration * (1 + 1e-12)
    forward = velocities(drive)[:, :3] @ way
    assert (np.diff(forward) <= 1e-15).all()
    assert (drive.shares[np.flatnonzero(sizes)] == 1.0).all()


@pytest.mark.parametrize("hertz", [0.5, 5.0, 20.0])
def test_a_shake_reaches_its_size_and_brings_the_palm_to_rest(hertz):
    """Means over samples are below the peak of a sinusoid by 1 - sinc(f dt) at most, and by as
    much again where no sample has its middle at the peak."""
    axis = np.array([0, 0, 10.0, 0, 0, 0])
    drive = paths.shake(DOWN, axis, hertz)
    peak = np.abs(drive.accelerations).max()
    lost = 1.0 - np.sinc(hertz * SAMPLE_S) * np.cos(np.pi * hertz * SAMPLE_S)
    assert 10.0 * (1.0 - lost) - 1e-9 <= peak <= 10.0 * 1.0001
    assert not drive.accelerations[:, [0, 1, 3, 4, 5]].any()
    # the middle of the motion stays: what is left is far less than an amplitude
    assert abs(positions(drive)[-1, 2]) < 2.0 * 10.0 / (2 * np.pi * hertz) ** 2


def test_a_knock_gives_its_impulse_where_it_strikes():
    impulse, point = np.array([0.01, 0.02, -0.03]), np.array([0.03, 0.0, 0.01])
    drive = paths.knock(DOWN, impulse, point)
    given = SAMPLE_S * drive.wrenches.sum(axis=0)
    assert given == pytest.approx(np.concatenate([impulse, np.cross(point, impulse)]), rel=1e-12)
    struck = np.flatnonzero(drive.wrenches.any(axis=1))
    assert len(struck) * SAMPLE_S == pytest.approx(0.02)
    assert (drive.shares[struck] == 1.0).all()
    assert not drive.accelerations.any()


@pytest.mark.parametrize("hertz", [3.0, 30.0, 1000.0])
def test_gravity_is_turned_through_all_directions(hertz):
    """Neighbouring turns are `SPACING` apart, so half of it is the farthest that a direction
    is from the path, and a hundredth more between samples."""
    drive = paths.turned_weight(hertz)
    ways = drive.gravity[drive.shares == 1.0] / G
    assert np.linalg.norm(ways, axis=1) == pytest.approx(1.0)
    many = np.random.default_rng(0).normal(size=(2000, 3))
    many /= np.linalg.norm(many, axis=1)[:, None]
    assert np.arccos((many @ ways.T).max(axis=1).clip(max=1.0)).max() < 0.505 * paths.TURN_GAP
