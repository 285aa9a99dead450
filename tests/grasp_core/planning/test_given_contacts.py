"""Contacts from elsewhere, put on an object."""

import math

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.objects.on_faces import face_under, nearest_on_surface
from grasp_core.planning.given_contacts import LARGEST_LEAN, LARGEST_MOVE, grasp_of, seat
from scenes.example_objects import example_object

NAMES = ("l-bracket", "mug")


def random_contacts(body, rng, count):
    """Points inside random faces with the faces' normals."""
    faces = rng.integers(len(body.faces), size=count)
    pieces = [body.faces[i].pieces[rng.integers(len(body.faces[i].pieces))] for i in faces]
    points = np.array([rng.dirichlet(np.ones(len(piece))) @ piece for piece in pieces])
    return points, np.array([body.faces[i].normal for i in faces])


@pytest.mark.parametrize("name", NAMES)
def test_contacts_beside_the_surface_go_to_the_nearest_point_of_it(name):
    body = example_object(name)
    rng = np.random.default_rng(2)
    compared = 0
    for _ in range(20):
        points, normals = random_contacts(body, rng, 4)
        lifted = points - 0.9 * LARGEST_MOVE * body.radius * rng.uniform(size=(4, 1)) * normals
        seated = seat(body, lifted, normals)
        nearest = nearest_on_surface(body.vertices, body.triangles, lifted)
        for contact, at, point in zip(seated.contacts, nearest, lifted, strict=True):
            # another face may be nearer, but turned too far
            moved = np.linalg.norm(contact.position - point)
            assert moved >= np.linalg.norm(at - point) - 1e-12
            compared += np.allclose(contact.position, at, atol=1e-12)
    assert compared >= 60


def test_a_curved_surface_is_judged_everywhere():
    rng = np.random.default_rng(5)
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    body = gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces, faces="patches")
    corners = body.vertices[body.triangles]
    outward = body.to_trimesh().face_normals
    for _ in range(8):
        chosen = rng.integers(len(corners), size=4)
        shares = rng.dirichlet(np.ones(3), size=4)
        points = np.einsum("ki,kij->kj", shares, corners[chosen])
        seated = seat(body, points, -outward[chosen])
        assert seated.moved_m <= 1e-12
        for contact, normal in zip(seated.contacts, outward[chosen], strict=True):
            np.testing.assert_allclose(contact.normal, -normal, atol=1e-12)
            assert face_under(seated.body, contact) is not None
        assert len(seated.body.faces) == len(body.faces) + 4


def turned(normal, angle):
    across = np.cross(normal, [0.6, 0.0, 0.8])
    across /= np.linalg.norm(across)
    return math.cos(angle) * normal + math.sin(angle) * across


@pytest.mark.parametrize("side", [0.999, 1.001])
def test_limits_of_leaning_and_moving_are_where_they_are_said_to_be(side):
    body = example_object("tetrahedron")
    points = np.array([face.centroid for face in body.faces])
    lean = body.normals.copy()
    lean[2] = turned(body.normals[2], side * LARGEST_LEAN)
    away = points.copy()
    away[2] -= side * LARGEST_MOVE * body.radius * body.normals[2]
    for given in ((points, lean), (away, body.normals)):
        if side < 1.0:
            seat(body, *given)
        else:
            with pytest.raises(gc.InputError, match="contact 2 is on no face"):
                seat(body, *given)


def test_a_grasp_or_the_proof_that_there_is_none():
    body = example_object("tetrahedron")
    points = np.array([face.centroid for face in body.faces])
    seated = seat(body, points, body.normals)
    with pytest.raises(gc.InputError, match="seat and grasp_of"):
        gc.certify_regions(body, seated.contacts, 0.5)
    grasp = grasp_of(seated, 0.5, "mine")
    assert isinstance(grasp, gc.Grasp)
    assert grasp.critical_friction < 0.5
    assert gc.force_closure(grasp, friction=0.5).closed
    assert gc.force_closure(grasp, friction=0.5).margin == pytest.approx(grasp.closure_margin)
    pairs = body.faces[0].polygon
    spots = np.array([pairs[0], pairs[1], pairs[2], pairs.mean(axis=0)])
    flat = grasp_of(seat(body, spots, [body.normals[0]] * 4), 0.5, "flat")
    assert not isinstance(flat, gc.Grasp)
    assert not flat.closed
    assert flat.verify()
