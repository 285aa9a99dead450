"""Turned, mirrored and renumbered objects are planned alike."""

from itertools import permutations

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.objects.standard_order import mirror_image, standard
from tests.judges import random_rotation
from tests.marks import MORE, more

OBJECTS = ("wedge", "box", "octahedron", "l-bracket", "hexagonal-pyramid", "random-10-3")
EVERYDAY = {"wedge", "hexagonal-pyramid"}
OTHERS = ("dodecahedron", "hex-nut", "double-wedge-bar", "random-14-6")
SAME = 1e-7
"""Object radii."""


def moved(body, kind, rng):
    """The object as another file might have it, and the isometry that took it there."""
    vertices, triangles, A = body.vertices, body.triangles, np.eye(3)
    if kind == "mirrored":
        A, triangles = np.diag([1.0, -1.0, 1.0]), triangles[:, ::-1]
    if kind == "turned":
        A = random_rotation(rng)
    if kind == "renumbered":
        order = rng.permutation(len(vertices))
        vertices, triangles = vertices[order], np.argsort(order)[triangles]
        triangles = triangles[rng.permutation(len(triangles))]
        triangles = np.array([np.roll(corners, rng.integers(3)) for corners in triangles])
    return gc.Polyhedron.from_mesh(vertices @ A.T, triangles), A


def isometries(one, two):
    """All rotations and reflections that take the corners of one object to those of another."""
    a, b = ((body.vertices - body.center_of_mass) / one.radius for body in (one, two))
    basis = next(i for i in permutations(range(len(a)), 3) if abs(np.linalg.det(a[list(i)])) > 0.1)
    lengths = np.linalg.norm(b, axis=1)
    like = [np.flatnonzero(np.abs(lengths - np.linalg.norm(a[i])) < SAME) for i in basis]
    found = []
    for i in like[0]:
        for j in like[1]:
            for k in like[2]:
                A = np.linalg.solve(a[list(basis)], b[[i, j, k]]).T
                if np.abs(A @ A.T - np.eye(3)).max() < SAME:
                    gaps = np.linalg.norm((a @ A.T)[:, None] - b[None], axis=2).min(axis=1)
                    found += [A] if gaps.max() < SAME else []
    return found


def grasps_of(body, plan, A):
    """Families and contacts about the centre of mass in object radii, moved by an isometry."""
    return [
        (grasp.family, (grasp.positions - body.center_of_mass) / body.radius @ A.T)
        for grasp in plan.grasps
    ]


def same_grasps(some, others):
    """Whether each grasp of some is one of the others, whatever the order of fingers."""
    return len(some) == len(others) and all(
        any(
            family == other
            and np.linalg.norm(x[:, None] - y[None], axis=2).min(axis=1).max() < SAME
            for other, y in others
        )
        for family, x in some
    )


@pytest.mark.parametrize("kind", ["turned", "mirrored", "renumbered"])
@pytest.mark.parametrize(
    "name", ["wedge", "hexagonal-pyramid", *more(*sorted({*OBJECTS, *OTHERS} - EVERYDAY))]
)
def test_an_object_from_another_file_has_the_same_grasps_up_to_that_motion(name, kind):
    """And up to the object's symmetries, as it may have been taken for its image under one."""
    body = scenes.example_object(name)
    other, A = moved(body, kind, np.random.default_rng(len(name)))
    limit = 12 if name in {"octahedron", "dodecahedron"} else 40
    there = grasps_of(other, gc.plan(other, limit=limit), np.eye(3))
    here = gc.plan(body, limit=limit)
    motions = isometries(body, other)
    assert any(np.abs(A - motion).max() < SAME for motion in motions)
    assert len(there) >= 12
    assert any(same_grasps(grasps_of(body, here, motion), there) for motion in motions)


@pytest.mark.parametrize(
    "names",
    [sorted(EVERYDAY), pytest.param(OBJECTS, marks=MORE)],
    ids=["some", "all"],
)
def test_fingers_are_listed_by_the_faces_of_the_object_as_it_was_given(names):
    """Ascending, in pencils and reguli within pairs and by the first of each."""
    for name in names:
        body = scenes.example_object(name)
        assert len(body.faces) == len(standard(body).faces)
        for grasp in gc.plan(body, limit=30).grasps:
            pairs = grasp.id[0] in "pr"
            f = grasp.faces
            assert grasp.id[2:] == "-".join(map(str, f))
            ordered = (
                f[0] < f[1] and f[2] < f[3] and f[0] < f[2] if pairs else f == tuple(sorted(f))
            )
            assert ordered
            for face, contact in zip(f, grasp.contacts, strict=True):
                away = (contact.position - body.faces[face].centroid) @ body.faces[face].normal
                assert abs(away) < SAME * body.radius
                np.testing.assert_allclose(contact.normal, body.faces[face].normal, atol=1e-12)


@pytest.mark.parametrize(
    "names",
    [OBJECTS[:2], pytest.param(OBJECTS[2:], marks=MORE)],
    ids=["some", "others"],
)
def test_an_object_planned_as_its_mirror_image_is_certified_and_proved_absent_as_it_is(names):
    seen, proved = set(), 0
    for name in names:
        for body in (scenes.example_object(name), mirror_image(scenes.example_object(name))):
            seen.add(standard(body).mirrored)
            grasps = gc.plan(body, 0.3, limit=20).grasps
            assert all(gc.force_closure(grasp, friction=0.3).verify() for grasp in grasps)
            every = None if len(body.faces) < 9 else 20
            absences = gc.plan(body, 0.3, families="free", limit=every).absences
            proved += len(absences)
            for faces, proofs in absences.items():
                for proof in proofs:
                    assert proof.verify()
                    assert tuple(sorted(piece.face for piece in proof.pieces)) == faces
                    for piece in proof.pieces:
                        np.testing.assert_allclose(piece.normal, body.faces[piece.face].normal,
                                                   atol=1e-12)  # fmt: skip
    assert seen == {True, False}
    assert proved >= 2


def test_standard_order_is_that_of_the_shape():
    """Areas and mutual angles of faces, in standard order, are those of any copy."""
    rng = np.random.default_rng(4)
    for name in (*OBJECTS, "hex-nut", "icosahedron", "random-40-1"):
        body = scenes.example_object(name)
        here = standard(body).body
        for kind in ("turned", "mirrored", "renumbered"):
            there = standard(moved(body, kind, rng)[0]).body
            for one, two in zip(here.faces, there.faces, strict=True):
                assert one.area == pytest.approx(two.area, rel=1e-9)
                assert len(one.pieces) == len(two.pieces)
                edges = [np.linalg.norm(np.diff(f.polygon[:2], axis=0)) for f in (one, two)]
                assert edges[0] == pytest.approx(edges[1], rel=1e-9)
            np.testing.assert_allclose(
                here.normals @ here.normals.T, there.normals @ there.normals.T, atol=1e-9
            )
