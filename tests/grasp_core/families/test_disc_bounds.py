"""Bounds on discs from corners: compiled, and beside what programs reach."""

import math

import numpy as np
import pytest

from grasp_core.cones.spanning import span_sines
from grasp_core.families.disc_bounds import corners_of, disc_limits
from grasp_core.families.placements import LEAST_RADIUS, Attempts
from grasp_core.families.placing import CONSTRUCTIONS, ContactPlacing
from grasp_core.objects.face_pieces import face_shapes
from scenes.example_objects import example_object
from tests.grasp_core.quadruples import spanning_quadruples

FAMILIES = ("concurrent", "pencil")
BODIES = ("random-14-1", "chamfered-box", "double-wedge-bar")


def quadruples(body, seed=0):
    """Faces, axes beside their normals, and half-angles at which these span."""
    rng = np.random.default_rng(seed)
    faces = spanning_quadruples(body.normals, 0.01)
    axes = body.normals[faces] + 0.03 * rng.normal(size=(len(faces), 4, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    sines = span_sines(axes)
    spans = sines > 0.01
    half_angles = 0.999 * np.minimum(np.arcsin(sines[spans]), math.radians(20.0))
    return faces[spans], axes[spans], half_angles


def bounds_on(shapes, construction, attempts, least):
    """Bounds of a construction on the hulls of faces."""
    return construction.bounds(ContactPlacing(construction, shapes).table, attempts, least)


@pytest.mark.parametrize("name", BODIES)
def test_no_program_reaches_beyond_its_limit(name):
    body = example_object(name)
    faces, axes, half_angles = quadruples(body, seed=1)
    limits = disc_limits(corners_of(body), body.normals, faces, axes, half_angles)
    shapes, held = face_shapes(body), 0
    for family in FAMILIES:
        construction = CONSTRUCTIONS[family]
        for order, limit in zip(construction.orders, limits[:, construction.limits].T, strict=True):
            attempts = Attempts(faces[:, order], axes[:, order], half_angles)
            found = bounds_on(shapes, construction, attempts, LEAST_RADIUS)
            larger = found > LEAST_RADIUS + 1e-6
            assert (found[larger] <= limit[larger] + 1e-7).all()
            held += int(larger.sum())
    assert held >= 12


def test_with_a_larger_least_radius_bounds_above_it_stay_and_others_stay_below():
    body = example_object("random-14-1")
    shapes, some = face_shapes(body), Attempts(*quadruples(body))
    for family in FAMILIES:
        every = bounds_on(shapes, CONSTRUCTIONS[family], some, -np.inf)
        least = float(np.median(every))
        few = bounds_on(shapes, CONSTRUCTIONS[family], some, least)
        larger = every > least + 1e-6
        assert larger.sum() >= 50
        np.testing.assert_allclose(few[larger], every[larger], atol=1e-9)
        assert (few[~larger] <= least + 2e-6).all()
