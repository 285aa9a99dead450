"""Fingers go where they were planned to go, and the object stands elsewhere."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from grasp_core.objects.on_faces import face_under
from sim_validate.closure.validate import disturbed
from sim_validate.settings import Noise
from tests.sim_validate.rigs import grasps

STILL = Noise(shift=0.0, turn_deg=0.0, normal_deg=0.0, friction=0.0, mass=0.0)
POSE = dataclasses.replace(STILL, shift=0.01, turn_deg=2.0)


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


def test_a_finger_beside_its_face_misses_it():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    far = dataclasses.replace(STILL, shift=1.0)
    cases = [disturbed(body, grasp, 0.5, far, 0, place) for place in range(50)]
    assert any(len(case.missed) == 4 for case in cases)
    for case in cases:
        assert len(case.contacts) == 4 - len(case.missed)


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


def test_a_draw_depends_on_seed_and_number_only():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    one, same, other, seed = (
        disturbed(body, grasp, 0.5, Noise(), *draw) for draw in [(0, 1), (0, 1), (0, 2), (1, 1)]
    )
    assert one.friction == same.friction
    assert len({one.friction, other.friction, seed.friction}) == 3
    twice = disturbed(body, grasp, 0.5, dataclasses.replace(Noise(), friction=0.1), 0, 1)
    assert math.log(twice.friction / 0.5) == pytest.approx(2.0 * math.log(one.friction / 0.5))
    assert twice.mass == one.mass
