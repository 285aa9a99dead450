"""Ceilings bound all contacts on four faces, are proved, and come near to what is attained."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.optimizing.support_cuts import write_proof
from scenes.example_objects import example_object
from tests.grasp_core.bodies import from_edges


@pytest.fixture(
    scope="module", params=["tetrahedron", pytest.param("wedge", marks=pytest.mark.slow)]
)
def bounded(request):
    """A body, four of its faces, a moved grasp on them and a ceiling."""
    body = example_object(request.param)
    (grasp,) = gc.plan(body, 0.5, limit=1).grasps
    found = gc.optimize_contacts(body, grasp, 0.5)
    known = found.after.lower
    ceiling = gc.quality_ceiling(
        body, grasp.faces, 0.5, known=known, gap=0.2, finger_radius=found.clearances
    )
    return body, found, ceiling


def test_no_contacts_are_better_than_the_ceiling(bounded):
    """Random contacts on the faces, clear of the edges, and the best that a search has found."""
    _, found, ceiling = bounded
    assert ceiling.upper >= found.after.lower
    rng, closed = np.random.default_rng(0), 0
    grounds, owners = ceiling.proof.grounds, ceiling.proof.owners
    polygons = grounds.polygons()
    for _ in range(150):
        on = [rng.choice(np.flatnonzero(owners == finger)) for finger in range(4)]
        weights = [rng.dirichlet(np.ones(len(polygons[p]))) for p in on]
        points = [
            grounds.places(p, (w @ polygons[p])[None])[0] for p, w in zip(on, weights, strict=True)
        ]
        normals = grounds.normals[on]
        here = gc.ferrari_canny(np.array(points), normals, 0.5, torque_scale=1.0, gap=0.05)
        assert here.lower <= ceiling.upper
        closed += here.lower > 0.0
    assert closed >= 10


def test_each_finger_has_its_own_face(bounded):
    """The polygons lie on the faces of the grasp, each finger's clear of the edges."""
    body, found, ceiling = bounded
    grounds, owners = ceiling.proof.grounds, ceiling.proof.owners
    assert set(owners.tolist()) == {0, 1, 2, 3}
    for p, polygon in enumerate(grounds.polygons()):
        finger = int(owners[p])
        face = body.faces[found.grasp.faces[finger]]
        assert grounds.faces[p] == found.grasp.faces[finger]
        points = grounds.places(p, polygon) * body.radius + body.center_of_mass
        assert np.abs((points - face.polygon[0]) @ face.normal).max() <= 1e-9 * body.radius
        for point in points:
            inner = from_edges(face.polygon, face.normal, point).min()
            assert inner == pytest.approx(found.clearances[finger], rel=1e-6)


def test_the_bound_can_be_checked_again_and_does_not_survive_tampering(bounded):
    _, found, ceiling = bounded
    proof = ceiling.proof
    assert ceiling.verify()

    def spoiled(**fields):
        return replace(ceiling, proof=replace(proof, **fields))

    assert not spoiled(threshold=0.99 * found.after.lower).verify()
    assert not spoiled(deeds=proof.deeds[:-1], asked=proof.asked[:-1]).verify()
    assert not spoiled(twists=-proof.twists).verify()
    assert not spoiled(owners=None).verify()
    assert not spoiled(owners=proof.owners + 1).verify()
    assert not spoiled(owners=proof.owners[1:]).verify()
    # a finger without a piece would refute everything
    alone = {"owners": np.zeros_like(proof.owners), "deeds": np.zeros(1, int)}
    assert not spoiled(**alone, asked=np.zeros(1, int), threshold=1e-6).verify()


def test_a_proof_about_four_faces_has_no_file(bounded, tmp_path):
    with pytest.raises(gc.InputError, match="about four faces, which has no file"):
        write_proof(tmp_path / "proof.npz", bounded[2].proof)


@pytest.mark.slow
def test_grasps_that_start_near_edges_do_not_end_above_the_ceiling():
    """Bounded without knowing what the search has found."""
    body = example_object("double-wedge-bar")
    grasps = gc.plan(body, 0.5, families="free", limit=4).grasps
    assert len(grasps) == 4
    for grasp in grasps:
        found = gc.optimize_contacts(body, grasp, 0.5)
        ceiling = gc.quality_ceiling(
            body, grasp.faces, 0.5, parts=3000, finger_radius=found.clearances
        )
        assert ceiling.verify()
        assert found.after.lower <= ceiling.upper


@pytest.mark.slow
def test_a_search_whose_twists_are_many_goes_on():
    """With a full pool of twists, none of them used yet, two new ones took each other's place."""
    body = example_object("tetrahedron")
    assert gc.quality_ceiling(body, (0, 1, 2, 3), 0.5, gap=0.15, parts=20_000).verify()


def test_faces_that_hold_nothing_have_a_small_ceiling_that_is_proved():
    body = example_object("tetrahedron")
    for known in (0.0, 1e-7):
        ceiling = gc.quality_ceiling(body, (0, 0, 0, 0), 0.1, known=known, parts=50)
        assert 0.0 < ceiling.upper <= 1.1e-6
        assert ceiling.verify()
    assert gc.quality_ceiling(body, (0, 1, 2, 3), 0.5, known=1e-7, parts=2000).verify()


def test_curved_objects_are_refused():
    plane = example_object("icosahedron")
    body = gc.Polyhedron.from_mesh(plane.vertices, plane.triangles, faces="patches")
    assert body.patches is not None
    with pytest.raises(gc.InputError, match="planar faces"):
        gc.quality_ceiling(body, (0, 1, 2, 3))
