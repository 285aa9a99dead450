"""Repeats with noise: analysis and simulation agree on each, and the share is a statistic."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sim_validate as sv
from grasp_core.objects.on_faces import face_under
from sim_validate.closure.validate import noisy_trial
from sim_validate.closure.verdict import interval
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.misplacement import disturbed
from sim_validate.engine.rig import squeezed
from sim_validate.engine.setup import Agenda, NamedWrench, Setup
from sim_validate.settings import Noise
from tests.sim_validate.rigs import grasps

STILL = Noise(shift=0.0, turn_deg=0.0, normal_deg=0.0, friction=0.0, mass=0.0)
POSE = dataclasses.replace(STILL, shift=0.01, turn_deg=2.0)
ONLY_NOISE = Agenda(repeats=12, controls=False, critical_friction=False)


def repeated(body, grasp, friction, **changed):
    agenda = dataclasses.replace(ONLY_NOISE, **changed)
    return sv.validate(body, grasp, friction, agenda=agenda)


@pytest.mark.parametrize("name", ["wedge", pytest.param("screwdriver", marks=pytest.mark.slow)])
def test_analysis_and_simulation_agree_on_every_repeat(name):
    """With noise that opens contacts, makes loads too large, and lets fingers miss."""
    held = let_go = missed = 0
    much = Noise(shift=0.02, turn_deg=3.0, normal_deg=3.0, friction=0.3, mass=0.3)
    body, (grasp,) = grasps(name, 0.5, 1)
    verdict = repeated(body, grasp, 0.5, noise=much)
    assert verdict.held
    assert not verdict.mismatches
    for trial in verdict.robustness.trials:
        if trial.outcome is not Outcome.INVALID_START:
            assert (trial.outcome is Outcome.HELD) == trial.predicted
            held += trial.predicted
            if "misses its face" in trial.reason:
                assert trial.outcome is Outcome.LOST_CONTACT
                missed += 1
            let_go += trial.wrench != ""
    assert min(held, let_go, missed) >= 1


def test_a_load_beyond_the_limit_is_not_held_however_it_came_about():
    """Loads are 80 % of what is resisted: a mass a third larger is too much, one a tenth is not."""
    body, (grasp,) = grasps("wedge", 0.5, 1)
    noise = dataclasses.replace(STILL, mass=0.3)
    cases = [disturbed(body, grasp, 0.5, noise, 0, number) for number in range(12)]
    found = repeated(body, grasp, 0.5, noise=noise).robustness
    assert {case.mass > 1.25 for case in cases} == {True, False}
    for case, trial in zip(cases, found.trials, strict=True):
        if abs(case.mass - 1.25) > 0.01:
            assert (trial.outcome is Outcome.HELD) == (case.mass < 1.25)


def test_a_simulator_that_holds_what_it_must_not_is_contradicted(monkeypatch):
    body, (grasp,) = grasps("wedge", 0.5, 1)
    noise = dataclasses.replace(STILL, friction=1.0)
    friction = 1.02 * grasp.critical_friction
    cases = [disturbed(body, grasp, friction, noise, 0, number) for number in range(30)]
    slippery = next(case for case in cases if case.friction < 0.8 * grasp.critical_friction)
    sticky = max(case.friction for case in cases)
    loads = [NamedWrench("lift", [0.0, 0.0, 1e-3, 0.0, 0.0, 0.0])]
    honest = noisy_trial(body, slippery, loads, 0, Setup())
    assert honest.outcome is not Outcome.HELD
    assert not honest.contradictions

    def sticking(bench, setup, idle, _, high):
        return squeezed(bench, setup, idle, sticky, max(high, sticky))

    monkeypatch.setattr("sim_validate.closure.controls.squeezed", sticking)
    wrong = noisy_trial(body, slippery, loads, 0, Setup())
    assert wrong.outcome is Outcome.HELD
    assert wrong.contradictions


def test_the_same_seed_gives_the_same_repeats():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    much = Noise(shift=0.04, turn_deg=3.0, normal_deg=3.0, friction=0.3, mass=0.3)
    one, same = (repeated(body, grasp, 0.5, noise=much, repeats=3).robustness for _ in range(2))
    assert one == same
    other = repeated(body, grasp, 0.5, noise=much, repeats=3, seed=1).robustness
    assert other.trials != one.trials
    more = repeated(body, grasp, 0.5, noise=much, repeats=4).robustness
    assert more.trials[:3] == one.trials


def test_intervals_are_those_of_the_tables():
    """Clopper and Pearson at 95 %: 0 and 10 of 10 by the closed form, 5 of 10 as printed."""
    assert interval(0, 10) == pytest.approx((0.0, 1.0 - 0.025**0.1))
    assert interval(10, 10) == pytest.approx((0.025**0.1, 1.0))
    assert interval(5, 10) == pytest.approx((0.187, 0.813), abs=5e-4)


def pose(body, noise, seed, number):
    """Where the object stands, by another way: a rotation about its centre of mass, and a shift."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1, number)))
    shift = noise.shift * body.radius * rng.normal(size=3)
    return Rotation.from_rotvec(math.radians(noise.turn_deg) * rng.normal(size=3)), shift


def test_contacts_are_on_their_faces_and_on_the_lines_of_the_fingers():
    """In the world the object has moved; a finger's line through it has not."""
    body, found = grasps("wedge", 0.5, 2)
    landed = missed = 0
    for grasp in found:
        for place in range(100):
            case = disturbed(body, grasp, 0.5, POSE, 3, place)
            missed += len(case.missed)
            fingers = [finger for finger in range(4) if finger not in case.missed]
            turned, shift = pose(body, POSE, 3, place)
            for finger, contact in zip(fingers, case.contacts, strict=True):
                face = body.faces[grasp.faces[finger]]
                assert face_under(body, contact) is face
                center = body.center_of_mass
                at = turned.apply(contact.position - center) + center + shift
                beside = np.cross(at - grasp.positions[finger], grasp.normals[finger])
                assert np.linalg.norm(beside) < 1e-12 * body.radius
                landed += 1
    assert landed > 300
    assert missed >= 5


@pytest.mark.parametrize("size", [1.0, 45.0])
def test_normals_friction_and_mass_are_off_by_what_is_drawn(size):
    """Draws of a standard normal distribution, replayed."""
    body, (grasp,) = grasps("wedge", 0.5, 1)
    noise = dataclasses.replace(STILL, normal_deg=size, friction=0.1, mass=0.2)
    leans, drawn = [], []
    for number in range(50):
        case = disturbed(body, grasp, 0.5, noise, 0, number)
        rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(1, number)))
        *_, slipperiness, heaviness = rng.normal(size=8)
        assert case.friction == pytest.approx(0.5 * math.exp(0.1 * slipperiness))
        assert case.mass == pytest.approx(math.exp(0.2 * heaviness))
        drawn.append(np.radians(size) * np.linalg.norm(rng.normal(size=(4, 2)), axis=1))
        normals = np.array([contact.normal for contact in case.contacts])
        leans.append(np.arccos(np.clip(np.einsum("ki,ki->k", normals, grasp.normals), -1, 1)))
    wrapped = np.arccos(np.cos(drawn))
    np.testing.assert_allclose(leans, wrapped, atol=1e-7)
