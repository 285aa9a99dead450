"""Why no grasp of least friction is sought: where the largest ball touches, none is needed."""

import numpy as np
import pytest
from scipy.optimize import linprog

import grasp_core as gc
from grasp_core.closure.contacts import contact_frames
from scenes.example_objects import example_object

ANY = 1e-3
"""Friction that stands for any."""


def touched(body):
    """Points and inward normals where the largest ball in a convex object touches its faces."""
    normals = np.array([face.normal for face in body.faces])
    offsets = np.array([face.normal @ face.polygon[0] for face in body.faces])
    # the farthest point inside from all faces: n.x - r >= offset
    rows = np.hstack([-normals, np.ones((len(normals), 1))])
    ball = linprog([0, 0, 0, -1], rows, -offsets, bounds=[(None, None)] * 3 + [(0, None)])
    middle, radius = ball.x[:3], ball.x[3]
    near = np.flatnonzero(normals @ middle - offsets < radius * (1.0 + 1e-9))
    return middle - radius * normals[near], normals[near], near


@pytest.mark.parametrize(
    "name", ["tetrahedron", "octahedron", "wedge", "random-8-7", "random-9-3", "dodecahedron"]
)
def test_four_contacts_on_the_largest_ball_are_closed_with_any_friction(name):
    body = example_object(name)
    points, normals, faces = touched(body)
    balance = linprog(
        np.arange(len(faces)), A_eq=np.vstack([normals.T, np.ones(len(faces))]), b_eq=[0, 0, 0, 1]
    )
    kept = np.flatnonzero(balance.x > 1e-9)
    assert 2 <= len(kept) <= 4
    points, normals, faces = points[kept], normals[kept], faces[kept]
    if len(kept) == 2:  # parallel faces: two contacts on each, beside where the ball touches
        aside = 0.1 * body.radius * contact_frames(normals[:1])[0, :, 1]
        points = np.vstack([points + aside, points - aside])
        normals, faces = np.tile(normals, (2, 1)), np.tile(faces, 2)
    assert gc.critical_friction(points, normals) == pytest.approx(0.0, abs=1e-6)
    assert gc.force_closure(points, normals, friction=ANY).closed
    for point, face in zip(points, faces, strict=True):
        polygon = body.faces[face].polygon
        along = np.roll(polygon, -1, axis=0) - polygon
        apart = np.linalg.norm(np.cross(point - polygon, along), axis=1)
        assert (apart / np.linalg.norm(along, axis=1)).min() > 0.04 * body.radius


def test_a_bound_of_the_usual_quality_bounds_that_of_single_forces():
    body = example_object("tetrahedron")
    best = gc.best_grasp(body, 0.5, gap=0.3)
    single = gc.ferrari_canny(
        best.grasp, friction=0.5, norm="linf", center=body.center_of_mass, torque_scale=body.radius
    )
    assert best.quality.lower < single.lower
    assert single.lower <= 4.0 * best.bound
