import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.objects.booleans import hull
from grasp_core.objects.planar_faces import coplanar_groups, planar_slack
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Mesh
from scenes.example_objects import example_object


def cube():
    return trimesh.creation.box(extents=(0.1, 0.2, 0.3))


def test_extra_triangles_and_border_points_do_not_change_the_faces():
    mesh = cube().subdivide().subdivide()
    body = Polyhedron.from_mesh(mesh.vertices, mesh.faces)
    assert len(body.triangles) == 192
    assert sorted(len(face.polygon) for face in body.faces) == [4] * 6
    for face in body.faces:
        assert len(face.pieces) == 1
        assert face.normal @ (face.centroid - body.center_of_mass) < 0
    assert sum(face.area for face in body.faces) == pytest.approx(mesh.area, rel=1e-12)


def test_a_fine_sphere_keeps_its_facets():
    """5,120 triangles with 1.2 degrees between neighbours: none may merge."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    surface, slack = Mesh(mesh.vertices, mesh.faces), planar_slack(0.1, 0.0)
    groups = coplanar_groups(surface, slack)
    assert len(groups) == len(mesh.faces) == 5120
    assert len(coplanar_groups(surface, slack, most=200)) == 201


@pytest.mark.parametrize(
    ("limits", "roof_faces"),
    [
        ({"angle": 1e-3, "distance": 1e-3}, 1),
        ({"angle": 1e-5, "distance": 1e-3}, 2),
        ({"angle": 1e-3, "distance": 1e-6}, 2),
        ({"angle": 1e-5, "distance": 1e-3, "blur": 1e-4}, 1),
    ],
)
def test_a_shallow_roof_is_one_face_only_within_both_limits(limits, roof_faces):
    """Two slopes that meet at 2e-4 rad and rise 5e-5 of the extent, on five walls."""
    ridge = [[0.0, 0.5, 5e-5], [1.0, 0.5, 5e-5]]
    corners = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (-0.3, 0.0)]
    solid = hull([*corners, *ridge])
    assert len(coplanar_groups(solid, **limits)) == 5 + roof_faces


def test_a_thin_triangle_that_rounding_tilts_parts_no_face():
    """It is 2e-6 of the extent high, and its corner is 1e-8 above the top of a box."""
    corners = [[x, y, z] for z in (0.0, 0.1) for x, y in ((0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1))]
    thin = [[0.02, 0.05, 0.1], [0.08, 0.05, 0.1], [0.05, 0.05 + 2e-7, 0.1 + 1e-9]]
    walls = [[0, 2, 1], [0, 3, 2]]
    for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
        walls += [[i, j, 4 + j], [i, 4 + j, 4 + i]]
    top = [[4, 5, 9], [4, 9, 8], [4, 8, 7], [5, 6, 9], [7, 8, 10], [7, 10, 6], [10, 9, 6]]
    body = gc.Polyhedron.from_mesh([*corners, *thin], [*walls, *top, [8, 9, 10]])
    assert len(body.faces) == 6


def test_a_face_with_a_hole_is_tiled_by_convex_pieces():
    body = example_object("hex-nut")
    rings = [face for face in body.faces if face.holes]
    assert len(rings) == 2
    for face in rings:
        assert len(face.pieces) > 1
        assert sum(_area(piece, face.normal) for piece in face.pieces) == pytest.approx(face.area)


def _area(polygon, normal):
    following = np.roll(polygon, -1, axis=0)
    return 0.5 * float(normal @ np.cross(polygon, following).sum(axis=0))
