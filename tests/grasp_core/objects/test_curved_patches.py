import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.geometry.polygons import edge_rows, is_convex, signed_area
from grasp_core.objects.booleans import hull
from grasp_core.objects.planar_faces import clearest_point, clearing, flat_patches
from grasp_core.objects.surface import Mesh
from tests.grasp_core.bodies import from_edges
from tests.grasp_core.curved import bumpy_ellipsoid, check_patches, curved_body
from tests.grasp_core.exact_judges import exactly

ROUNDING = 1e-9
"""Relative to the object, of heights and of lines through the edges between triangles."""


@pytest.mark.parametrize("noise", [0.002, pytest.param(0.0, marks=pytest.mark.slow)])
def test_over_each_point_of_a_patch_is_one_point_of_the_surface_as_near_as_it_says(noise):
    rng = np.random.default_rng(3)
    body = curved_body(noise=noise)
    assert len(body.faces) >= 10
    check_patches(body, rng, 60)


def test_patches_keep_the_limits_and_come_largest_first():
    vertices, triangles = bumpy_ellipsoid(noise=0.001, subdivisions=3)
    extent = np.ptp(vertices, axis=0).max()
    for limits in (gc.PatchLimits(8.0, 0.02, 12), gc.PatchLimits(25.0, 0.004, 8)):
        found = flat_patches(Mesh(vertices, triangles), limits)
        assert 4 <= len(found) <= limits.most
        assert max(face.spread for face in found) <= math.radians(limits.spread_deg) + ROUNDING
        assert max(face.depth for face in found) <= limits.depth * extent
        rooms = [from_edges(face.polygon, face.normal, face.centroid).min() for face in found]
        assert rooms == sorted(rooms, reverse=True)
        used = np.concatenate([face.facets for face in found])
        assert len(np.unique(used)) == len(used)


def test_a_patch_of_one_large_triangle_keeps_the_limits_too():
    """Roofs of four triangles that lean by 4 degrees, whose average normals are upright."""
    square = itertools.product((-0.05, 0.05), (-0.05, 0.05), (0.0, 0.03))
    rise = 0.05 * math.tan(math.radians(4.0))
    solid = hull([*square, (0.0, 0.0, -rise), (0.0, 0.0, 0.03 + rise)])
    limits = gc.PatchLimits()
    found = flat_patches(solid, limits)
    assert len(found) == 12
    assert max(face.depth for face in found) <= limits.depth * 0.1


def test_fine_meshes_get_patches_and_coarse_ones_planar_faces_unless_told_otherwise():
    vertices, triangles = bumpy_ellipsoid(subdivisions=2)
    coarse = gc.Polyhedron.from_mesh(*bumpy_ellipsoid(subdivisions=1))
    assert coarse.patches is None
    assert {len(coarse.faces), len(coarse.triangles)} == {80}
    assert gc.Polyhedron.from_mesh(vertices, triangles).patches == gc.PatchLimits()
    exact = gc.Polyhedron.from_mesh(vertices, triangles, faces="planar")
    assert exact.patches is None
    assert len(exact.faces) == 320
    assert {face.spread for face in exact.faces} == {0.0}


@pytest.mark.slow
def test_a_coarse_torus_whose_triangles_meet_regions_in_their_corners_is_planned():
    ring = trimesh.creation.torus(0.04, 0.012, 24, 12)
    limits = gc.PatchLimits(20.0, 0.02, 10)
    body = gc.Polyhedron.from_mesh(ring.vertices, ring.faces, patches=limits)
    plan = gc.plan(body, 0.8, limit=4)
    assert len(plan.grasps) == 4
    for grasp in plan.grasps:
        assert gc.force_closure(grasp, friction=0.8).verify()


def test_a_surface_without_flat_parts_is_refused_with_advice():
    ball = trimesh.creation.icosphere(subdivisions=2)
    rough = gc.PatchLimits(spread_deg=0.5, depth=1e-5)
    body = gc.Polyhedron.from_mesh(0.05 * ball.vertices, ball.faces, patches=rough)
    assert len(body.faces) >= 4  # single triangles
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = 0.05 * np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])
    lens = trimesh.convex.convex_hull(np.vstack([ring, [[0, 0, 0.004], [0, 0, -0.004]]]))
    with pytest.raises(gc.MeshError, match=r"only 2 patches.*patches.spread-deg") as refused:
        gc.Polyhedron.from_mesh(
            lens.vertices, lens.faces, faces="patches", patches=gc.PatchLimits(45.0, 0.1)
        )
    assert refused.value.reason is MeshRefusal.NOT_FLAT


GAP = 1e-6


def fence(rng, corners=40, stretch=1.0):
    """A closed border of segments around zero, with teeth, and some loose segments inside."""
    turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    away = rng.uniform(0.5, 1.0, corners)
    points = away[:, None] * np.column_stack([stretch * np.cos(turns), np.sin(turns)])
    border = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    ends = rng.uniform(-1.0, 1.0, (6, 1, 2))
    return np.concatenate([border, ends + rng.uniform(-0.1, 0.1, (6, 2, 2))])


def enters(polygon, segment):
    """Whether a segment has a point strictly inside a convex polygon, in rational arithmetic."""
    ends, corners = exactly(segment), exactly(polygon)
    low, high = Fraction(0), Fraction(1)
    for (x, y), (u, v) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        here, there = ((u - x) * (q - y) - (v - y) * (p - x) for p, q in ends)
        if max(here, there) <= 0:
            return False
        if here < 0:
            low = max(low, here / (here - there))
        if there < 0:
            high = min(high, here / (here - there))
    return low < high


@pytest.mark.timeout(120)  # it never ended once
@pytest.mark.parametrize("stretch", [1.0, 6.0, 1e2, 1e4])
def test_no_segment_enters_a_clearing_however_far_apart_its_teeth(stretch):
    rng = np.random.default_rng(1)
    for _ in range(10):
        segments = fence(rng, stretch=stretch)
        start, room = clearest_point(rng.uniform(-0.3, 0.3, (50, 2)), segments)
        polygon = clearing(start, segments, GAP)
        assert is_convex(polygon)
        assert not any(enters(polygon, segment) for segment in segments)
        if stretch < 10.0:
            E, b = edge_rows(polygon)
            assert (E @ start < b).all()
            assert signed_area(polygon) > 0.9 * np.pi * room**2
