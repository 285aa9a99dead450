"""A run is judged at its looks, from the pose that the test counts from."""

import numpy as np
import pytest

from sim_validate.protocols.judging import Look, judged_run
from sim_validate.protocols.published import Passing

START = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def moving(*heights, fingers=2):
    """An object that is at these heights after samples 0, 1, .., and looked at from 2 on."""
    poses = np.tile(START, (len(heights), 1))
    poses[:, 2] = heights
    return [Look(pose, fingers) for pose in poses[2:]]


def judged(passing, *heights, fault="", **more):
    return judged_run(0, moving(*heights, **more), fault, passing)


def test_displacement_counts_from_before_closing():
    found = judged(Passing(most_m=0.035), 0.01, 0.02, 0.03, 0.04)
    assert (found.passed, found.displacement_m) == (False, pytest.approx(0.04))


def test_a_threshold_itself_does_not_pass():
    assert not judged(Passing(most_m=0.02), 0.0, 0.0, 0.02).passed
    assert judged(Passing(most_m=0.02), 0.0, 0.0, 0.0199).passed


def test_what_comes_after_a_failed_look_does_not_count():
    found = judged(Passing(most_m=0.02), 0.0, 0.0, 0.03, 9.0)
    assert found.displacement_m == pytest.approx(0.03)
    assert "moved by 30 mm" in found.reason


def test_a_turn_counts_as_an_angle():
    looks = moving(0.0, 0.0, 0.0)
    half = np.radians(20.0) / 2.0
    looks[0].pose[3:] = [np.cos(half), 0.0, np.sin(half), 0.0]
    assert not judged_run(0, looks, "", Passing(most_deg=15.0)).passed
    found = judged_run(0, looks, "", Passing(most_deg=25.0))
    assert (found.passed, found.turn_deg) == (True, pytest.approx(20.0))


def test_fingers_must_touch_at_each_look():
    assert judged(Passing(fingers=2), 0.0, 0.0, 0.0).passed
    found = judged(Passing(fingers=3), 0.0, 0.0, 0.0)
    assert (found.passed, found.fingers) == (False, 2)
    assert "2 fingers touched" in found.reason


def test_a_fault_of_the_simulator_is_no_pass():
    found = judged(Passing(), 0.0, 0.0, 0.0, fault="it diverged")
    assert (found.passed, found.reason) == (False, "it diverged")


def test_a_position_that_is_no_number_does_not_pass():
    assert not judged(Passing(most_m=1.0), 0.0, 0.0, float("nan")).passed
