import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import grasp_map
from grasp_core.execution.first_slip import Equilibrium
from tests.grasp_core.execution.held import box, opposed, opposed_grip, planned_grips, pressed


def moved(grip, motion):
    """The grip once its object has moved from rest, there and back."""
    rest = Equilibrium(grip, grip, np.zeros(3), np.eye(3))
    return [rest.stepped(sign * motion).grip for sign in (1.0, -1.0)]


def differences(grip, step=1e-6):
    """Wrench of all contacts against each small motion, by central differences, (6, 6)."""
    columns = []
    for motion in np.eye(6) * step:
        there, back = (grasp_map(end.arms) @ end.squeeze.ravel() for end in moved(grip, motion))
        columns.append((back - there) / (2.0 * step))
    return np.array(columns).T


@pytest.mark.parametrize("radius", [0.0, 0.01, 0.05])
def test_the_stiffness_is_that_of_finite_differences(radius):
    """Translations, turns, and tips that roll; central differences are good to the step squared."""
    for stiffness in (300.0, 5000.0, np.diag([500.0, 1500.0, 900.0]) * np.ones((4, 1, 1))):
        for grip in planned_grips(stiffness=stiffness, tip_radius_m=radius):
            K = grip.grasp_stiffness
            assert np.abs(differences(grip) - K).max() < 1e-8 * np.abs(K).max()
            assert np.abs(grip.geometric_stiffness).max() > 0.0


def test_the_response_is_that_of_finite_differences():
    """Changes of forces along axes that turn with the object."""
    for grip in planned_grips(stiffness=800.0):
        for motion in np.eye(6) * 1e-6:
            ends = moved(grip, motion)
            turns = [motion[3:], -motion[3:]]
            local = [
                np.einsum("kij,ki->kj", grip.frames, end.squeeze - np.cross(turn, end.squeeze))
                for end, turn in zip(ends, turns, strict=True)
            ]
            found = grip.response @ (grip.grasp_stiffness @ motion)
            expected = 0.5 * (local[0] - local[1])
            assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_squeeze_makes_turns_less_stiff_and_large_tips_help():
    """About z: 4 K times the squared arm, less the pushes times the arms along them."""
    stiff = {}
    for radius in (0.0, 0.02, 0.04):
        grip = opposed_grip(push=5.0, stiffness=1000.0, tip_radius_m=radius)
        arm = 0.03**2 + 0.02**2
        assert grip.grasp_stiffness[5, 5] == pytest.approx(
            4000.0 * arm - 4.0 * 5.0 * (0.03 - radius)
        )
        stiff[radius] = grip.least_stiffness
    assert stiff[0.0] <= stiff[0.02] <= stiff[0.04]


def test_two_fingers_have_no_stiffness_about_their_line():
    grip = gc.grip(box(), opposed(1), 0.5, pressed(5.0, 1))
    assert not grip.stable
    with pytest.raises(gc.InputError, match="no stiffness against some motion"):
        _ = grip.response


@pytest.mark.parametrize("least", [-1.0, 1e30])
def test_a_stiffness_that_is_huge_or_not_positive_definite_is_refused(least):
    wrong = np.diag([1.0, 1.0, least]) * np.ones((4, 1, 1))
    with pytest.raises(gc.InputError, match="stiffness must be pos"):
        gc.grip(box(), opposed(), 0.5, pressed(5.0), stiffness=wrong)
