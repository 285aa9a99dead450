"""Turned, mirrored and renumbered objects are planned alike."""

from itertools import permutations

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.standard_order import mirror_image, standard
from scenes.example_objects import example_object
from tests.judges import random_rotation

SAME = 1e-7
"""Object radii."""


def moved(body, kind, rng):
    """The object as another file might have it, and the isometry that took it there.

    Turned ones are elsewhere and larger, too.
    """
    vertices, triangles, A, size = body.vertices, body.triangles, np.eye(3), 1.0
    if kind == "mirrored":
        A, triangles = np.diag([1.0, -1.0, 1.0]), triangles[:, ::-1]
    if kind == "turned":
        A, size = random_rotation(rng), 2.3
    if kind == "renumbered":
        order = rng.permutation(len(vertices))
        vertices, triangles = vertices[order], np.argsort(order)[triangles]
        triangles = triangles[rng.permutation(len(triangles))]
        triangles = np.array([np.roll(corners, rng.integers(3)) for corners in triangles])
    return gc.Polyhedron.from_mesh(size * vertices @ A.T + size - 1.0, triangles), A


def isometries(one, two):
    """All rotations and reflections that take the corners of one object to those of another."""
    a, b = ((body.vertices - body.center_of_mass) / body.radius for body in (one, two))
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
    "name", ["wedge", pytest.param("hexagonal-pyramid", marks=pytest.mark.slow)]
)
def test_an_object_from_another_file_has_the_same_grasps_up_to_that_motion(name, kind):
    """And up to the object's symmetries, as it may have been taken for its image under one."""
    body = scenes.example_object(name)
    other, A = moved(body, kind, np.random.default_rng(len(name)))
    there = grasps_of(other, gc.plan(other, limit=40), np.eye(3))
    here = gc.plan(body, limit=40)
    motions = isometries(body, other)
    assert any(np.abs(A - motion).max() < SAME for motion in motions)
    assert len(there) >= 12
    assert any(same_grasps(grasps_of(body, here, motion), there) for motion in motions)


def test_fingers_are_listed_by_the_faces_of_the_object_as_it_was_given():
    """Ascending, in pencils and reguli within pairs and by the first of each."""
    for name in ("wedge", "hexagonal-pyramid"):
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


def test_an_object_planned_as_its_mirror_image_is_certified_and_proved_absent_as_it_is():
    seen, proved = set(), 0
    for name in ("wedge", "box"):
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


def test_fingers_on_one_face_hold_and_keep_their_distance():
    body = example_object("box")
    apart = 0.02
    plan = gc.plan(body, 0.5, settings=gc.PlanSettings(share_faces_m=apart))
    shared = [grasp for grasp in plan.grasps if len(set(grasp.faces)) < 4]
    assert len(shared) >= 20
    assert len({grasp.id for grasp in plan.grasps}) == len(plan.grasps)
    for grasp in shared:
        check_on_faces(body, grasp)
        assert gc.force_closure(grasp, friction=0.5).verify()
        gaps = np.linalg.norm(grasp.positions[:, None] - grasp.positions[None], axis=2)
        same = np.equal.outer(np.array(grasp.faces), np.array(grasp.faces))
        assert gaps[same & ~np.eye(4, dtype=bool)].min() >= apart * (1.0 - 1e-9)
    assert plan.outcomes.held + plan.outcomes.absent + plan.outcomes.open == 90
    assert plan.counts.quadruples == 90


@pytest.mark.slow
def test_absence_is_proved_for_whole_faces_not_for_their_halves():
    """Random contacts on the whole faces of quadruples that are called absent never close."""
    body, rng, tested = example_object("wedge"), np.random.default_rng(0), 0
    plan = gc.plan(body, 0.2, settings=gc.PlanSettings(share_faces_m=0.0))
    for faces, proofs in plan.absences.items():
        assert all(proof.verify() for proof in proofs)
        if len(set(faces)) == 4:
            continue
        for _ in range(5):
            points = np.array(
                [rng.dirichlet(np.ones(len(p))) @ p for p in (body.faces[f].polygon for f in faces)]
            )
            assert not gc.force_closure(points, body.normals[list(faces)], 0.2).closed
            tested += 1
    assert tested >= 60
    assert all(len(set(faces)) < 4 for faces in plan.undecided)


def from_edges(point, face):
    """Distance of a point from the borders of a face."""
    least = np.inf
    for loop in (face.polygon, *face.holes):
        along = np.roll(loop, -1, axis=0) - loop
        share = np.einsum("ki,ki->k", point - loop, along) / np.einsum("ki,ki->k", along, along)
        nearest = loop + np.clip(share, 0.0, 1.0)[:, None] * along
        least = min(least, np.linalg.norm(nearest - point, axis=1).min())
    return least


def test_planned_contacts_and_regions_keep_the_margin():
    body = example_object("l-bracket")
    margin, tested = 0.05 * body.radius, 0
    plan = gc.plan(
        body, 0.5, families="concurrent", settings=gc.PlanSettings(edge_clearance_m=margin)
    )
    for grasp in plan.grasps:
        for face, contact, region in zip(grasp.faces, grasp.contacts, grasp.regions, strict=True):
            for point in (contact.position, *region.polygon):
                assert from_edges(point, body.faces[face]) >= margin * (1.0 - 1e-6)
                tested += 1
    assert tested >= 200
    assert len(plan.grasps) >= 10


def test_a_margin_wider_than_all_faces_leaves_nothing():
    body = example_object("wedge")
    plan = gc.plan(body, 0.5, settings=gc.PlanSettings(edge_clearance_m=0.9 * body.radius))
    assert not plan.grasps
    assert plan.outcomes.absent == plan.counts.quadruples
    assert "m from their edges" in plan.absence
    structured = gc.plan(
        body,
        0.5,
        families="concurrent",
        settings=gc.PlanSettings(edge_clearance_m=0.9 * body.radius, cones="normal"),
    )
    assert structured.counts.spanning == 15
    assert "15 face quadruples span" in structured.absence
