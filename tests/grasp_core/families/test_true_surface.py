import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.objects.on_faces import check_on_faces, face_under
from grasp_core.planning.grasps_json import grasps_from_json, plan_to_json
from tests.grasp_core.curved import curved_body, inside, met

FRICTION = 0.5


@pytest.fixture(scope="module")
def planned():
    body = curved_body(noise=0.002)
    return body, gc.plan(body, FRICTION, limit=12)


def test_contacts_are_on_triangles_of_the_mesh_with_their_normals(planned):
    body, plan = planned
    corners = body.vertices[body.triangles]
    inward = -body.to_trimesh().face_normals
    contacts = 0
    for grasp in plan.grasps:
        check_on_faces(body, grasp)
        for contact, face in zip(grasp.contacts, grasp.faces, strict=True):
            off = np.abs(np.einsum("ti,ti->t", inward, contact.position - corners[:, 0]))
            turned = np.abs(inward - contact.normal).max(axis=1)
            near = np.linalg.norm(corners.mean(axis=1) - contact.position, axis=1)
            on = (off < 1e-9) & (turned < 1e-9) & (near < 0.1 * body.radius)
            assert on.any()
            assert face_under(body, contact) is body.faces[face]
            contacts += 1
        assert gc.force_closure(grasp, friction=FRICTION).verify()
        assert gc.classify_lines(grasp.witness.points, grasp.witness.forces) == grasp.family
        np.testing.assert_array_equal(grasp.witness.points, grasp.positions)
    assert contacts >= 40
    assert all(counts.rejected == 0 for counts in plan.counts.families.values())


def test_any_surface_points_over_the_regions_are_in_force_closure(planned):
    """The regions are planes' polygons; what is claimed is about the true surface over them."""
    body, plan = planned
    rng, tested = np.random.default_rng(0), {"concurrent": 0, "pencil": 0}
    for grasp in plan.grasps:
        if grasp.radius == 0.0:
            continue
        for _ in range(12):
            points, normals = [], []
            for face, region in zip(grasp.faces, grasp.regions, strict=True):
                plane = body.faces[face]
                point = inside(region.polygon, rng, 1)[0]
                heights, inward = met(body, plane, point)
                points.append(point + heights[0] * plane.normal)
                normals.append(inward[0])
            assert gc.force_closure(np.array(points), np.array(normals), FRICTION).closed
            tested[grasp.family] += 1
    assert tested["concurrent"] >= 24
    assert tested["pencil"] >= 24


def test_a_contact_off_the_true_surface_is_refused(planned):
    body, plan = planned
    text = plan_to_json(body, plan)
    place = plan.grasps[0].contacts[0].position.tolist()
    moved = [value + 1e-4 * body.radius for value in place]
    assert text.count(f"{place[0]!r}") >= 1
    for value, other in zip(place, moved, strict=True):
        text = text.replace(repr(value), repr(other))
    with pytest.raises(gc.InputError, match="does not lie on face"):
        grasps_from_json(text)


def test_the_free_method_works_on_curved_surfaces_and_proves_nothing_there():
    plan = gc.plan(curved_body(subdivisions=3), FRICTION, families="free", limit=1)
    assert len(plan.grasps) == 1
    assert not plan.absences
    for grasp in plan.grasps:
        assert gc.force_closure(grasp, friction=FRICTION).verify()


def test_wide_patches_leave_no_friction_to_plan_with():
    vertices, triangles = curved_body().vertices, curved_body().triangles
    wide = gc.Polyhedron.from_mesh(vertices, triangles, patches=gc.PatchLimits(40.0, 0.1, 8))
    assert min(math.degrees(face.spread) for face in wide.faces[:4]) > 12.0
    assert not gc.plan(wide, 0.2, families=("concurrent", "pencil")).grasps
