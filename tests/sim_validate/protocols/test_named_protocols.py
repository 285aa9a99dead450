"""Published tests are what their own files say: loads, durations, thresholds, physics."""

import re
from dataclasses import replace

import numpy as np
import pytest

import scenes
import sim_validate as sv
from grasp_core.errors import InputError
from sim_validate.cli.flag_groups import ProtocolName
from sim_validate.protocols.named_protocols import PROTOCOLS, protocol, protocol_names

AXES = {(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)}
IN_MUJOCO = {"dexgraspbench", "dexgraspbench-paper", "dexonomy", "mj-grasp-sim", "molmospaces"}


def directions(test, mass_kg=1.0):
    return {tuple(np.round(f / np.linalg.norm(f)).astype(int)) for f in test.forces(mass_kg)}


def test_dexgraspbench_is_its_file():
    """eval.yaml: obj_mass 0.1, miu_coef 0.6 and 0.02, trans_thre 0.05, angle_thre 15, max_pene
    0.01. fc_mocap.py: 10 times the mass, six directions, ten looks after 50 steps of 4 ms each.
    hand_util.py: ten commands of ten steps for each of two stages, impratio 10, noslip 2."""
    test = protocol("dexgraspbench")
    assert (test.mass_kg, test.friction, test.physics.torsion_m) == (0.1, 0.6, 0.02)
    assert (test.passing.most_m, test.passing.most_deg) == (0.05, 15.0)
    assert test.passing.most_overlap_m == 0.01
    assert test.passing.runs is None
    assert test.passing.fingers == 0
    assert test.close_s == test.squeeze_s == pytest.approx(10 * 10 * 0.004)
    assert directions(test) == AXES
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


def test_the_paper_has_a_lighter_object_and_softer_joints():
    """Branch baseline: obj_mass 0.03; README: kp was 1, and is 5."""
    paper, main = protocol("dexgraspbench-paper"), protocol("dexgraspbench")
    assert (paper.mass_kg, paper.servo_n_m_per_rad) == (0.03, 1.0)
    assert np.linalg.norm(paper.forces(0.03), axis=1) == pytest.approx(0.3)
    assert (paper.passing, paper.physics, paper.runs) == (main.passing, main.physics, main.runs)


def test_dexonomy_is_its_file():
    """eval.yaml: 0.05 m and 15 deg; mujoco_env.py: 9.8 times the mass, ten looks after 50 steps of
    4 ms each, and five commands of five steps for each stage."""
    test = protocol("dexonomy")
    assert (test.mass_kg, test.friction, test.physics.torsion_m) == (0.1, 0.6, 0.02)
    assert (test.passing.most_m, test.passing.most_deg) == (0.05, 15.0)
    assert test.close_s == test.squeeze_s == pytest.approx(5 * 5 * 0.004)
    assert directions(test) == AXES
    assert {step.seconds for run in test.runs for step in run} == {2.0}
    assert np.linalg.norm(test.forces(0.1), axis=1) == pytest.approx(0.98)


def test_graspqp_is_its_file():
    """grasp_mining_env.py: 200 Hz, friction 1, 3 N for 0.5 s from 0.25, 1, 1.75, ... s on, along z,
    x, y and back, anew each 1.5 s, and 0.03 m. eval.py: one of three axes is enough."""
    test = protocol("graspqp")
    assert (test.timestep_s, test.friction) == (1.0 / 200.0, 1.0)
    assert (test.passing.most_m, test.passing.runs) == (0.03, 1)
    assert np.isinf(test.passing.most_deg)
    assert directions(test) == AXES
    assert np.linalg.norm(test.forces(1.0), axis=1) == pytest.approx(3.0)
    begins = [
        1.5 * number + sum(step.seconds for step in run[:place])
        for number, run in enumerate(test.runs)
        for place in (1, 3)
    ]
    assert begins == pytest.approx([0.25, 1.0, 1.75, 2.5, 3.25, 4.0])
    assert all(sum(step.seconds for step in run) == pytest.approx(1.5) for run in test.runs)


def test_dexgraspnet_is_its_file():
    """isaac_validator.py: friction 3, density 500, 9.8 m/s^2, 100 steps of 1/60 s with two
    substeps, any contact; validate_grasps.py: 1 mm."""
    test = protocol("dexgraspnet")
    assert (test.friction, test.density_kg_per_m3, test.timestep_s) == (3.0, 500.0, 1.0 / 120.0)
    assert directions(test) == AXES
    assert {step.seconds for run in test.runs for step in run} == {100.0 / 60.0}
    assert np.linalg.norm(test.forces(2.0), axis=1) == pytest.approx(2.0 * 9.8)
    assert (test.passing.fingers, test.passing.most_overlap_m) == (1, 0.001)
    box = scenes.example_object("box")
    assert test.mass_of(box) == pytest.approx(500.0 * box.volume)


def test_gendexgrasp_is_its_file():
    """grasp_test_force.yaml: friction 10, density 10,000, 5,000 N per cubic metre, 50 steps of 1/60
    s in each of six directions, 0.02 m."""
    test = protocol("gendexgrasp")
    assert (test.friction, test.density_kg_per_m3) == (10.0, 10_000.0)
    box = scenes.example_object("box")
    forces = test.forces(test.mass_of(box))
    assert np.linalg.norm(forces, axis=1) == pytest.approx(5_000.0 * box.volume)
    (run,) = test.runs
    assert [step.seconds for step in run] == pytest.approx([50.0 / 60.0] * 6)
    assert (test.passing.most_m, test.passing.since) == (0.02, "each step")


def test_get_a_grip_is_its_file():
    """isaac_validator.py: friction 0.9, density 500, 0.2 m up in eight of ten parts of 125 steps of
    1/60 s, three links, 0.1 m, 45 deg, noise of 5 mm and 5 deg; dataset_generation.md: 5 copies."""
    test = protocol("get-a-grip")
    assert (test.friction, test.density_kg_per_m3, test.copies) == (0.9, 500.0, 5)
    assert (test.noise_m, test.noise_deg) == (0.005, 5.0)
    assert (test.passing.most_m, test.passing.most_deg, test.passing.fingers) == (0.1, 45.0, 3)
    (run,) = test.runs
    assert run[0].line_m == (0.0, 0.0, 0.2)
    assert run[0].seconds == pytest.approx(0.8 * 125 / 60)
    assert sum(step.seconds for step in run) == pytest.approx(125 / 60)


def test_imitations_are_called_so_in_their_value_and_in_tables():
    for test in PROTOCOLS.values():
        assert test.imitation == (test.name not in IN_MUJOCO)
        assert ("imitation" in test.label) == test.imitation
        assert bool(test.imitates) == test.imitation


def test_every_test_names_files_at_a_commit():
    assert len(PROTOCOLS) == 13
    for test in PROTOCOLS.values():
        assert test.sources
        for source in test.sources:
            assert re.fullmatch(r"[\w.-]+/[\w.-]+", source.repository)
            assert re.fullmatch(r"[0-9a-f]{40}", source.commit)
            assert source.paths


def test_flags_python_and_values_have_the_same_names():
    assert protocol_names() == ProtocolName.__args__ == tuple(PROTOCOLS)
    assert all(name == test.name for name, test in PROTOCOLS.items())
    assert sv.protocol_names() == protocol_names()


def test_an_unknown_name_is_refused_with_the_names_there_are():
    with pytest.raises(InputError, match=r"name must be .*dexgraspbench.*get-a-grip.*nothing"):
        protocol("nothing")


def test_a_test_with_another_friction_is_another_value():
    test = protocol("graspqp")
    assert replace(test, friction=0.5) != test
