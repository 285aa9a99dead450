from dataclasses import replace

import numpy as np
import pytest
import trimesh

import grasp_core as gc
import scenes
from scenes.mujoco import fingertip_room
from scenes.mujoco.closure_scene import arrange
from scenes.mujoco.fingertip_room import clashes, fitting_radius


@pytest.mark.parametrize("name", ["l-bracket", "wedge"])
def test_fingertips_that_fit_meet_neither_each_other_nor_the_object_elsewhere(name):
    body = scenes.example_object(name)
    tested = 0
    for grasp in gc.plan(body, 0.5, families=("free",), limit=6).grasps:
        radius = arrange(body, grasp, 0.5).drive.radius_m
        found = clashes(body, grasp.positions, grasp.normals, radius)
        centers = grasp.positions - radius * grasp.normals
        apart = min(np.linalg.norm(a - b) for i, a in enumerate(centers) for b in centers[:i])
        if found:
            assert radius == pytest.approx(1e-3 * body.radius)
            continue
        assert apart >= 2.0 * radius * (1.0 - 1e-6)
        rooms = trimesh.proximity.closest_point_naive(body.to_trimesh(), centers)[1]
        assert rooms.min() >= radius * (1.0 - 1e-5)
        tested += 1
    assert tested >= 4


def test_near_an_inner_corner_the_radius_is_the_distance_to_it():
    """A sphere on one face of a right angle, d from the corner, touches the other from r = d on."""
    body = scenes.example_object("l-bracket")
    inner, point, normal = _inner_corner(body)
    for share in (0.05, 0.1, 0.2):
        distance = share * body.radius
        at = point + distance * inner
        radius = fitting_radius(body, at[None], normal[None])
        expected = 0.1 * body.radius if distance >= 0.1 * body.radius else 0.95 * distance
        assert radius == pytest.approx(expected, rel=1e-5)


def test_a_fingertip_that_shrinks_too_often_is_shown_to_be_clear_nowhere(monkeypatch):
    body = scenes.example_object("l-bracket")
    inner, point, normal = _inner_corner(body)
    at, radius = (point + 0.05 * body.radius * inner)[None], 0.1 * body.radius
    assert fitting_radius(body, at, normal[None]) > 0.04 * body.radius
    monkeypatch.setattr(fingertip_room, "MAX_SHRINKING", 1)
    assert fitting_radius(body, at, normal[None]) == pytest.approx(1e-3 * body.radius)
    assert "meets face" in clashes(body, at, normal[None], radius)[0]


def _inner_corner(body):
    """Two faces that meet in a reflex edge: where, and in which direction the first goes."""
    for one in body.faces:
        for other in body.faces:
            meets = abs(one.normal @ other.normal) < 1e-9
            ahead = (other.centroid - one.centroid) @ one.normal < -1e-9
            behind = (one.centroid - other.centroid) @ other.normal < -1e-9
            if meets and ahead and behind:
                away = -other.normal
                height = (other.centroid - one.centroid) @ other.normal
                return away, one.centroid + height * other.normal, one.normal
    raise AssertionError("an L-bracket has an inner corner")


def test_two_fingertips_at_one_edge_always_overlap():
    """Their centres are r sqrt(2) apart, less than 2 r at any radius."""
    body = scenes.example_object("box")
    length, width, _ = np.ptp(body.vertices, axis=0)
    at = np.array([[length / 2, width / 2, 0.0]] * 2)
    normals = np.array([[-1.0, 0, 0], [0, -1.0, 0]])
    radius = fitting_radius(body, at, normals)
    assert radius == pytest.approx(1e-3 * body.radius)
    found = clashes(body, at, normals, radius)
    assert len(found) == 1
    assert "fingertips 0 and 1 of radius" in found[0]


def test_fingers_arrive_on_their_planned_lines():
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, limit=1, finger=gc.Finger(0.004, 0.05)).grasps[0]
    leaning = grasp.normals + np.array([0.0, 0.0, 0.3])
    leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
    for ways in (grasp.approach_directions, leaning):
        layout = arrange(body, replace(grasp, approach_directions=ways), 0.5)
        found = -layout.approach / np.linalg.norm(layout.approach, axis=1, keepdims=True)
        np.testing.assert_allclose(found, ways, atol=1e-8)
