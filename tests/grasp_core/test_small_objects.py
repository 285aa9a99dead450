"""Usual numbers, fitted to small objects."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.planning.plan_search import carried
from grasp_core.regions.certify_placement import usual_bound
from grasp_core.small_objects import SMALL_M, fitted
from scenes.example_objects import example_object


def test_numbers_stay_for_usual_objects_and_fall_smoothly_below():
    assert fitted(2.0, 0.07) == fitted(2.0, SMALL_M, 2) == 2.0
    assert fitted(2.0, SMALL_M * (1.0 - 1e-9)) == 2.0
    assert fitted(2.0, 0.1 * SMALL_M) == pytest.approx(0.2)
    assert fitted(10.0, 0.1 * SMALL_M, 2) == pytest.approx(0.1)


def test_rankings_treat_a_tiny_part_as_the_same_part_in_a_usual_size():
    usual, chances, masses = example_object("box"), [], []
    for radius in (0.1 * SMALL_M, SMALL_M):
        vertices = radius / usual.radius * usual.vertices
        body = gc.Polyhedron.from_mesh(vertices, usual.triangles)
        grasp = gc.plan(body, 0.5, limit=1)[0]
        chances.append(usual_bound(body, grasp, 0.5).lower)
        arms = grasp.positions - body.center_of_mass
        masses.append(carried(body, arms, grasp.normals, 0.5, None))
    assert chances[0] == pytest.approx(chances[1], rel=1e-3)
    assert chances[0] > 0.5
    assert masses[0] > 0.0
    assert np.isclose(masses[0], 0.01 * masses[1], rtol=0.01)
