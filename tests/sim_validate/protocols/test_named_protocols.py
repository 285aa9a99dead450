"""Published tests are what their own files say: loads, durations, thresholds, physics."""

import numpy as np
import pytest

from sim_validate.protocols.published import protocol, protocol_names

AXES = {(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)}


def test_dexgraspbench_is_its_file():
    """eval.yaml: obj_mass 0.1, miu_coef 0.6 and 0.02, trans_thre 0.05, angle_thre 15, max_pene
    0.01. fc_mocap.py: 10 times the mass, six directions, ten looks after 50 steps of 4 ms each.
    hand_util.py: ten commands of ten steps for each of two stages, impratio 10, noslip 2."""
    test = protocol("dexgraspbench")
    assert (test.mass_kg, test.friction, test.physics.torsion_m) == (0.1, 0.6, 0.02)
    assert (test.passing.most_m, test.passing.most_deg) == (0.05, 15.0)
    assert test.passing.most_overlap_m == 0.01
    assert test.passing.fingers == 0
    assert test.close_s == test.squeeze_s == pytest.approx(10 * 10 * 0.004)
    assert {tuple(way) for way in np.sign(np.round(test.forces(1.0), 9))} == AXES
    assert len(test.runs) == 6
    for (step,) in test.runs:
        assert np.linalg.norm(step.force(0.1)) == pytest.approx(10 * 0.1)
        assert step.seconds == pytest.approx(10 * 50 * 0.004)
        assert step.look_s == pytest.approx(50 * 0.004)
    physics = test.physics
    assert (physics.timestep, physics.impratio, physics.noslip_iterations) == (0.004, 10.0, 2)
    assert (physics.integrator, physics.cone) == ("implicitfast", "elliptic")
    assert test.servo_n_m_per_rad == 5.0


def test_contacts_of_dexgraspbench_are_the_mean_of_a_hands_and_an_objects():
    """MuJoCo takes the mean of both geoms. hand_util.py: solref 0.005 1 and solimp 0.5 0.99 0.0001
    for hands; objects have MuJoCo's defaults."""
    physics = protocol("dexgraspbench").physics
    assert physics.solref == pytest.approx(np.mean([[0.005, 1.0], [0.02, 1.0]], axis=0))
    both = [[0.5, 0.99, 0.0001, 0.5, 2.0], [0.9, 0.95, 0.001, 0.5, 2.0]]
    assert physics.solimp == pytest.approx(np.mean(both, axis=0))


@pytest.mark.parametrize("name", protocol_names())
def test_tests_have_dense_jacobians(name):
    """So the Newton solver is right in MuJoCo 4.0.0, however many joints a hand has."""
    assert protocol(name).physics.jacobian == "dense"
