"""Bounds on reaches and widths, compiled and not."""

import numpy as np

from grasp_core.reaches import _reaches, _widths, corners_of, reaches_and_widths
from grasp_core.spanning import spanning_quadruples
from scenes.objects import example_object


def test_compiled_bounds_are_those_of_the_formulas():
    tested = 0
    for seed, name in enumerate(("random-14-1", "chamfered-box", "octahedron")):
        body, rng = example_object(name), np.random.default_rng(seed)
        faces = spanning_quadruples(body.normals, 0.01).indices
        axes = body.normals[faces] + 0.05 * rng.normal(size=(len(faces), 4, 3))
        axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
        corners = corners_of(body)
        reaches, widths = reaches_and_widths(corners, faces, axes)
        np.testing.assert_allclose(reaches, _reaches(corners.points[faces], axes), atol=1e-12)
        np.testing.assert_allclose(widths, _widths(corners.points[faces], axes), rtol=1e-12)
        tested += len(faces)
    assert tested >= 100


def test_no_focus_is_farther_from_contacts_than_the_bounds():
    """Foci behind random contacts along random axes, against the definition of both bounds."""
    body, rng, tested = example_object("random-14-1"), np.random.default_rng(0), 0
    body_corners = corners_of(body)
    for faces in spanning_quadruples(body.normals, 0.01).indices[:60]:
        axes = body.normals[faces]
        (reach,), (widths,) = reaches_and_widths(body_corners, faces[None], axes[None])
        points = body_corners.points[faces]
        shares = rng.dirichlet(np.ones(points.shape[1]), size=(50, 4))
        contacts = np.einsum("tfk,fki->tfi", shares, points)
        foci = rng.normal(size=(50, 1, 3))
        depths = np.einsum("fi,tfi->tf", axes, foci - contacts)
        assert (depths.min(axis=1) <= reach + 1e-12).all()
        tested += 50
        i, j = 0, 1
        apart = axes[i] - axes[j]
        between = (contacts[:, j] - contacts[:, i]) @ apart / (1.0 - axes[i] @ axes[j])
        assert (between <= widths[i, j] + 1e-12).all()
    assert tested >= 1000
