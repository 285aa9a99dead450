"""Symmetries of objects are found by their shape, and copies of grasps by their contacts."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.objects.standard_order import SAME_GRASP, copies_of, symmetries
from grasp_core.values import Contact, ContactRegion, ForceCone, Witness, four
from tests.grasp_core.objects.test_standard_order import isometries
from tests.judges import random_rotation
from tests.sim_validate.rigs import grasps

KNOWN = {
    "tetrahedron": (12, 12), "octahedron": (24, 24), "dodecahedron": (60, 60), "wedge": (1, 0),
    "l-bracket": (1, 1), "hexagonal-pyramid": (6, 6), "box": (4, 4), "hex-nut": (4, 4),
}  # fmt: skip
"""Numbers of rotations and of reflections, by built-in object."""


def moved(body, grasp, A, order=(0, 1, 2, 3)):
    """A grasp as a rotation or reflection about the centre of mass makes it of another."""

    shared = len(grasp.focus_points)

    def at(points):
        return body.center_of_mass + (points - body.center_of_mass) @ A.T

    def of(items):
        return four([items[place] for place in order])

    faces = of([int(np.argmax(body.normals @ (A @ normal))) for normal in grasp.normals])
    return replace(
        grasp,
        id="moved",
        faces=faces,
        contacts=of([Contact(at(c.position), A @ c.normal) for c in grasp.contacts]),
        focus_points=at(np.repeat(grasp.focus_points, 4 // shared, axis=0)[list(order)])[
            :: 4 // shared
        ],
        force_cones=of([ForceCone(A @ c.axis, c.half_angle) for c in grasp.force_cones]),
        regions=of([ContactRegion(r.kind, at(r.polygon), 0.0) for r in grasp.regions]),
        witness=Witness(
            at(grasp.witness.points)[list(order)], (grasp.witness.forces @ A.T)[list(order)]
        ),
    )


@pytest.mark.parametrize("name", KNOWN)
def test_symmetries_of_known_objects(name):
    body = scenes.example_object(name)
    found = symmetries(body)
    assert (len(found.rotations), len(found.reflections)) == KNOWN[name]
    assert len(isometries(body, body)) == sum(KNOWN[name])
    np.testing.assert_allclose(found.rotations[0], np.eye(3), atol=1e-9)
    for turns, det in ((found.rotations, 1.0), (found.reflections, -1.0)):
        np.testing.assert_allclose(np.linalg.det(turns), det)
        for turn in turns:
            np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-9)


@pytest.mark.parametrize(("shake", "kept"), [(1e-6, True), (3e-3, False)])
def test_symmetries_are_found_within_a_tolerance_and_of_any_size(shake, kept):
    """An icosahedron has triangles for faces, so that shaken ones stay planar."""
    rng = np.random.default_rng(0)
    body = scenes.example_object("icosahedron")
    for size in (1e-2, 1.0, 30.0):
        shaken = body.vertices + shake * body.radius * rng.uniform(-1, 1, body.vertices.shape)
        other = gc.Polyhedron.from_mesh(size * shaken @ random_rotation(rng).T, body.triangles)
        found = symmetries(other)
        assert (len(found.rotations), len(found.reflections)) == ((60, 60) if kept else (1, 0))


@pytest.mark.parametrize(("name", "family"), [("tetrahedron", "concurrent"), ("box", "pencil")])
def test_images_are_copies_and_mirror_images_are_named_apart(name, family):
    body, (grasp,) = grasps(name, 0.5, 1, (family,), "tilted")
    found = symmetries(body)
    skewed = moved(body, grasp, np.eye(3))
    turned = [moved(body, skewed, turn, (2, 3, 1, 0)) for turn in found.rotations]
    mirrored = [moved(body, skewed, turn, (1, 0, 2, 3)) for turn in found.reflections]
    (copies,) = copies_of(body, [grasp, *turned, *mirrored])
    assert copies.first == 0
    assert set(range(1, 1 + len(turned))) <= set(copies.rotated)
    assert copies.places == tuple(range(1 + len(turned) + len(mirrored)))


@pytest.mark.parametrize(("off", "same"), [(0.5 * SAME_GRASP, True), (2.0 * SAME_GRASP, False)])
def test_contacts_must_agree_to_a_thousandth_of_the_radius(off, same):
    body, (grasp,) = grasps("tetrahedron", 0.5, 1, ("concurrent",), "tilted")
    turned = moved(body, grasp, symmetries(body).rotations[3])
    contact = turned.contacts[1]
    across = np.cross(contact.normal, [1.0, 2.0, 3.0])
    step = off * body.radius * across / np.linalg.norm(across)
    shifted = Contact(contact.position + step, contact.normal)
    other = replace(turned, contacts=(turned.contacts[0], shifted, *turned.contacts[2:]))
    assert len(copies_of(body, [grasp, other])) == (1 if same else 2)


def test_other_families_cones_and_foci_make_other_grasps():
    body, (grasp,) = grasps("tetrahedron", 0.5, 1, ("concurrent",), "tilted")
    cones = four([ForceCone(c.axis, 0.9 * c.half_angle) for c in grasp.force_cones])
    others = (
        replace(grasp, family="pencil", focus_points=np.repeat(grasp.focus_points, 2, axis=0)),
        replace(grasp, force_cones=cones),
        replace(grasp, focus_points=grasp.focus_points + 0.01 * body.radius),
    )
    for other in others:
        assert len(copies_of(body, [grasp, other])) == 2
