import numpy as np
import pytest

import grasp_core as gc
from grasp_core.objects.booleans import hull
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.standard_order import shared_quadruples, with_halves
from grasp_core.planning.quadruples import FIRST_FACES
from grasp_core.records.grasps_json import grasps_from_json, plan_to_json
from scenes.example_objects import example_object
from tests.judges import random_rotation


@pytest.mark.parametrize("name", ["box", "l-bracket", "hex-nut", "random-10-1"])
def test_halves_are_parts_of_their_face_and_stay_apart(name):
    body = example_object(name)
    apart = 0.1 * body.radius
    halved, owners = with_halves(body, apart)
    rng, tested = np.random.default_rng(0), 0
    assert owners[: len(body.faces)] == tuple(range(len(body.faces)))
    pairs = {}
    for index in range(len(body.faces), len(owners)):
        pairs.setdefault(owners[index], []).append(halved.faces[index])
    for owner, halves in pairs.items():
        points = [
            np.vstack([rng.dirichlet(np.full(len(p), 0.2), 40) @ p for p in half.pieces])
            for half in halves
        ]
        gaps = np.linalg.norm(points[0][:, None] - points[1][None], axis=2)
        assert gaps.min() >= apart * (1.0 - 1e-9)
        for point in np.vstack(points):
            whole = body.faces[owner]
            assert any(_holds(piece, point, whole.normal) for piece in whole.pieces)
        tested += 1
    assert tested >= 6


def _holds(polygon, point, normal):
    edges = np.roll(polygon, -1, axis=0) - polygon
    return (np.cross(edges, point - polygon) @ normal >= -1e-12).all()


def test_quadruples_have_both_halves_of_a_face_or_of_two_and_no_face_beside_its_halves():
    found = shared_quadruples((0, 1, 2, 3, 0, 0, 2, 2))
    assert {tuple(faces) for faces in found.tolist()} == {
        (1, 2, 4, 5), (1, 3, 4, 5), (2, 3, 4, 5),
        (0, 1, 6, 7), (0, 3, 6, 7), (1, 3, 6, 7), (4, 5, 6, 7),
    }  # fmt: skip


def test_fingers_on_one_face_hold_and_keep_their_distance():
    body = example_object("box")
    apart = 0.02
    plan = gc.plan(body, 0.5, share_faces=apart)
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


@pytest.mark.parametrize("name", ["prism", "box"])
def test_grasps_with_both_halves_have_ids_of_their_own_and_survive_a_file(name):
    body = example_object(name)
    plan = gc.plan(body, 0.5, families="pencil", share_faces=0.005)
    assert len({grasp.id for grasp in plan.grasps}) == len(plan.grasps) >= 20
    saved = grasps_from_json(plan_to_json(body, plan))
    assert [grasp.id for grasp in saved.grasps] == [grasp.id for grasp in plan.grasps]


def test_shared_faces_are_tried_after_blocks_that_are_too_small():
    """A box with many narrow faces: the first grasps of two fingers on a wide one are larger."""
    body = bevelled(example_object("box"))
    assert len(body.faces) > FIRST_FACES  # a second block comes before the shared faces
    plan = gc.plan(body, 0.5, families="concurrent", limit=25, share_faces=0.004)
    assert any(len(set(grasp.faces)) < 4 for grasp in plan.grasps)


def bevelled(body, radius=0.004):
    """A box with edges rounded by two strips each, and corners by small triangles."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    centers = signs * (0.5 * np.ptp(body.vertices, axis=0) - radius)
    ways = np.vstack([np.eye(3), (1.0 - np.eye(3)) / np.sqrt(2.0), np.full((1, 3), 3.0**-0.5)])
    solid = hull((centers[:, None] + radius * signs[:, None] * ways).reshape(-1, 3))
    return gc.Polyhedron.from_mesh(solid.vertices, solid.triangles, name="bevelled")


def test_absence_is_proved_for_whole_faces_not_for_their_halves():
    """Random contacts on the whole faces of quadruples that are called absent never close."""
    body, rng, tested = example_object("wedge"), np.random.default_rng(0), 0
    plan = gc.plan(body, 0.2, share_faces=0.0)
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


def test_halves_turn_with_the_object():
    body = example_object("hex-nut")
    R = random_rotation(np.random.default_rng(2))
    there, _ = with_halves(gc.Polyhedron.from_mesh(body.vertices @ R.T, body.triangles), 0.001)
    here, _ = with_halves(body, 0.001)
    for one, two in zip(here.faces, there.faces, strict=True):
        a, b = (np.vstack(face.pieces) for face in (one, two))
        np.testing.assert_allclose(
            sorted(np.linalg.norm(a - a.mean(axis=0), axis=1)),
            sorted(np.linalg.norm(b - b.mean(axis=0), axis=1)), atol=1e-9,
        )  # fmt: skip
