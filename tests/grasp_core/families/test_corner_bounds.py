"""Bounds on discs from corners: compiled, by the formulas, and beside what programs reach."""

import math

import numpy as np
import pytest

from grasp_core.cones.spanning import span_sines, spanning_quadruples
from grasp_core.families.constructions import CONSTRUCTIONS, PAIRINGS
from grasp_core.families.disc_bounds import AttemptBounds, corners_of, disc_limits
from grasp_core.families.kernel_tables import Attempts
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.objects.face_pieces import face_shapes
from scenes.example_objects import example_object
from tests.grasp_core.families import reference_corner_bounds as reference

BODIES = ("random-14-1", "chamfered-box", "double-wedge-bar")


def quadruples(body, seed=0):
    """Faces, axes beside their normals, and half-angles at which these span."""
    rng = np.random.default_rng(seed)
    faces = spanning_quadruples(body.normals, 0.01).indices
    axes = body.normals[faces] + 0.03 * rng.normal(size=(len(faces), 4, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    sines = span_sines(axes)
    spans = sines > 0.01
    half_angles = 0.999 * np.minimum(np.arcsin(sines[spans]), math.radians(20.0))
    return faces[spans], axes[spans], half_angles


def limits_on(body, *quads):
    return disc_limits(corners_of(body), body.normals, *quads)


def test_compiled_limits_are_those_of_the_formulas_or_sharper():
    tested = sharper = 0
    for body in map(example_object, BODIES):
        found = limits_on(body, *quadruples(body))
        slow = reference.disc_limits(corners_of(body), *quadruples(body))
        np.testing.assert_allclose(found[:, 0], slow[:, 0], rtol=1e-9)
        assert (found <= slow * (1.0 + 1e-9)).all()
        tested += len(found)
        sharper += (found[:, 1:] < 0.9 * slow[:, 1:]).sum()
    assert tested >= 100
    assert sharper >= 50


@pytest.mark.parametrize("name", BODIES)
def test_no_program_reaches_beyond_its_limit(name):
    body = example_object(name)
    faces, axes, half_angles = quadruples(body, seed=1)
    limits, discs, held = (
        limits_on(body, faces, axes, half_angles),
        AttemptBounds(face_shapes(body)),
        0,
    )
    for family in ("concurrent", "pencil"):
        construction = CONSTRUCTIONS[family]
        for order, limit in zip(construction.orders, limits[:, construction.limits].T, strict=True):
            attempts = Attempts(faces[:, order], axes[:, order], half_angles)
            found = discs.of(construction, attempts, LEAST_RADIUS)
            larger = found > LEAST_RADIUS + 1e-6
            assert (found[larger] <= limit[larger] + 1e-7).all()
            held += int(larger.sum())
    assert held >= 12


def test_no_focus_is_farther_from_contacts_than_reach_and_widths_allow():
    """Random contacts and foci, against the definition of both bounds."""
    body, rng, tested = example_object("random-14-1"), np.random.default_rng(0), 0
    corners = corners_of(body).points
    for faces in spanning_quadruples(body.normals, 0.01).indices[:60]:
        axes, points = body.normals[faces], corners[faces]
        (reach,) = reference.reaches(points[None], axes[None])
        (widths,) = reference.widths(points[None], axes[None])
        shares = rng.dirichlet(np.ones(points.shape[1]), size=(50, 4))
        contacts = np.einsum("tfk,fki->tfi", shares, points)
        depths = np.einsum("fi,tfi->tf", axes, rng.normal(size=(50, 1, 3)) - contacts)
        assert (depths.min(axis=1) <= reach + 1e-12).all()
        for i, j, _, _ in PAIRINGS:
            between = (contacts[:, j] - contacts[:, i]) @ (axes[i] - axes[j])
            assert (between / (1.0 - axes[i] @ axes[j]) <= widths[i, j] + 1e-12).all()
        tested += 50
    assert tested >= 1000
