import math
from itertools import pairwise

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.planning.request import METHODS
from scenes.example_objects import example_object
from tests.benchmarks.objects import sphere_hull
from tests.judges import pyramid_margin, random_rotation
from tests.marks import MORE

TEN_DEGREES = math.tan(math.radians(10.0))
RADIUS_ACCURACY = 1e-6
"""Radii are optima good to 1e-8 in object radii; two may differ by twice that."""
DISCS = ("concurrent", "pencil")
"""The families with independent discs."""
FAMILIES = (*DISCS, "regulus")


def remade(body, move, name="moved"):
    return gc.Polyhedron.from_mesh(move(body.vertices), body.triangles, name=name)


@pytest.mark.parametrize(
    ("name", "count"),
    [("tetrahedron", 1), ("octahedron", 2), ("dodecahedron", 30), ("icosahedron", 90)],
)
def test_platonic_solids_have_the_known_number_of_quadruples_at_ten_degrees(name, count):
    """Quadruples with theta* above ten degrees; all of them carry a concurrent grasp."""
    found = gc.plan(example_object(name), TEN_DEGREES, families=("concurrent",), cones="normal")
    wide = [grasp for grasp in found.grasps if grasp.span_angle > math.radians(10.0)]
    assert len(wide) == count
    assert found.counts.families["concurrent"].rejected == 0


def test_the_tetrahedron_is_held_at_its_face_centres():
    body = example_object("tetrahedron")
    found = gc.plan(body, TEN_DEGREES, families=("concurrent",))
    (grasp,) = found.grasps
    assert grasp.family == "concurrent"
    assert grasp.critical_friction == 0.0
    discs = [region.inscribed_radius for region in grasp.regions]
    np.testing.assert_allclose(discs, grasp.radius, rtol=1e-5)
    np.testing.assert_allclose(grasp.focus_points, [[0.0, 0, 0]], atol=1e-7 * body.radius)
    centers = [body.faces[face].centroid for face in grasp.faces]
    np.testing.assert_allclose(grasp.positions, centers, atol=1e-7 * body.radius)


TILTED = [(name, "tilted") for name in ("wedge", "chamfered-box", "random-10-1", "random-12-1")]
NORMAL = [(name, "normal") for name in ("icosahedron", "random-20-7", "random-30-2", "screwdriver")]


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "least"), [(8, 40), pytest.param(40, 150, marks=MORE)])
def test_no_returned_grasp_fails_an_independent_pyramid_of_64_sides(limit, least):
    """Inner pyramids accept each grasp, so outer ones must as well; critical friction agrees."""
    tested = 0
    for name, cones in TILTED + NORMAL:
        families = ("concurrent",) if name == "screwdriver" else FAMILIES
        body = example_object(name)
        for grasp in gc.plan(body, 0.5, limit=limit, families=families, cones=cones).grasps:
            for outer in (False, True):
                assert pyramid_margin(grasp.positions, grasp.normals, 0.5, 64, outer=outer) > 1e-9
            below = 0.99 * grasp.critical_friction
            if below > 1e-3:
                assert pyramid_margin(grasp.positions, grasp.normals, below, 64, outer=False) < 1e-9
            tested += 1
    assert tested >= least


def test_every_grasp_lies_on_its_faces_inside_its_regions():
    tested = 0
    for name, cones in TILTED + NORMAL:
        body = example_object(name)
        for grasp in gc.plan(body, 0.4, limit=20, families=DISCS, cones=cones).grasps:
            for face, contact, region in zip(
                grasp.faces, grasp.contacts, grasp.regions, strict=True
            ):
                plane = body.faces[face]
                off = (region.polygon - plane.centroid) @ plane.normal
                np.testing.assert_allclose(off, 0.0, atol=1e-9)
                assert region.inscribed_radius >= grasp.radius * (1 - RADIUS_ACCURACY)
                assert contact.normal @ plane.normal == pytest.approx(1.0)
                assert _inside(contact.position, region.polygon, plane.normal)
            tested += 1
    assert tested >= 90


@pytest.mark.parametrize(
    "name",
    [
        "wedge",
        "box",
        *(pytest.param(n, marks=MORE) for n in ("random-10-1", "octahedron")),
    ],
)
def test_moving_turning_and_scaling_the_object_moves_its_grasps(name):
    rng = np.random.default_rng(1)
    body = example_object(name)
    here = gc.plan(body, 0.3, families=DISCS, cones="tilted")
    R, scale = random_rotation(rng), float(rng.uniform(0.1, 3.0))
    there = gc.plan(
        remade(body, lambda v: scale * v @ R.T + 0.4), 0.3, families=DISCS, cones="tilted"
    )
    assert {g.id for g in here.grasps} == {g.id for g in there.grasps}
    radii = {g.id: g.radius for g in there.grasps}
    for grasp in here.grasps:
        expected = pytest.approx(radii[grasp.id] / scale, rel=RADIUS_ACCURACY)
        assert grasp.radius == expected
    assert len(here.grasps) >= 50


FEW, MANY = (0.1, 0.5), (0.05, 0.1, 0.2, 0.35, 0.7)


@pytest.mark.parametrize(
    ("name", "frictions", "least"),
    [
        ("wedge", FEW, 50),
        pytest.param("wedge", MANY, 200, marks=MORE),
        pytest.param("random-10-1", MANY, 500, marks=MORE),
        pytest.param("random-12-1", MANY, 1000, marks=MORE),
    ],
)
def test_more_friction_never_loses_a_grasp(name, frictions, least):
    body, tested = example_object(name), 0
    plans = [gc.plan(body, friction, families=DISCS, cones="normal") for friction in frictions]
    for less, greater in pairwise(plans):
        radii = {grasp.id: grasp.radius for grasp in greater.grasps}
        for grasp in less.grasps:
            assert radii[grasp.id] >= grasp.radius * (1 - RADIUS_ACCURACY)
            tested += 1
    assert tested >= least


def test_a_smaller_theta_is_allowed_and_gives_smaller_discs():
    body = example_object("icosahedron")
    wide, narrow = (
        gc.plan(body, 0.5, theta_deg=theta_deg, limit=5, cones="normal")
        for theta_deg in (None, 5.0)
    )
    assert narrow.grasps[0].radius < wide.grasps[0].radius
    assert narrow.grasps[0].force_cones[0].half_angle <= math.radians(5.0)


def test_progress_is_reported_as_quadruples_are_tried():
    seen = []
    gc.plan(example_object("wedge"), progress=lambda *numbers: seen.append(numbers))
    done = [each for each, _, _ in seen]
    assert done == sorted(done)
    assert seen[-1][0] == seen[-1][1] == len(METHODS) * 70
    assert len(seen) >= 13


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"friction": 0.0}, "friction must be a number from 1e-09"),
        ({"friction": math.nan}, "friction must be a number from 1e-09"),
        ({"theta_deg": 30.0}, "theta_deg must be a number from 1e-09"),
        ({"theta_deg": -1.0}, "theta_deg must be a number from 1e-09"),
        ({"limit": 0}, "limit must be a whole number from 1"),
        ({"families": ["spiral"]}, "families must be among"),
        ({"families": []}, "families must be among"),
    ],
)
def test_bad_requests_are_refused(arguments, message):
    with pytest.raises(gc.InputError, match=message):
        gc.plan(example_object("tetrahedron"), **arguments)


def test_an_object_with_too_many_faces_is_refused_at_once():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    with pytest.raises(gc.InputError, match="over the limit of 1000"):
        gc.plan(gc.Polyhedron.from_mesh(ball.vertices, ball.faces, faces="planar"), limit=4)


def test_of_more_than_200_faces_only_the_largest_grasps_of_the_paper_s_families_are_planned():
    body = sphere_hull(240)
    for options in ({}, {"limit": 4}, {"families": FAMILIES}):
        with pytest.raises(gc.InputError, match="with more than 200 need simpler plans"):
            gc.plan(body, 0.2, **options)
    every = gc.plan(body, 0.2, families=FAMILIES, limit=9).grasps
    assert {grasp.family for grasp in every} == set(FAMILIES)
    assert all(gc.force_closure(grasp, friction=0.2).verify() for grasp in every)


def test_regions_are_larger_than_discs_but_smaller_than_faces():
    tested = 0
    body = example_object("icosahedron")
    for grasp in gc.plan(body, 0.2, limit=20, families=DISCS).grasps:
        assert grasp.radius > LEAST_RADIUS * body.radius
        for face, region in zip(grasp.faces, grasp.regions, strict=True):
            disc = math.pi * region.inscribed_radius**2
            listed = 1.0 - 2e-3 * (region.kind == "disc")  # 64 points of a circle
            assert listed * disc <= _area(region.polygon) <= body.faces[face].area * (1 + 1e-9)
            tested += 1
    assert tested >= 80


def _area(polygon):
    fan = np.cross(polygon[1:-1] - polygon[0], polygon[2:] - polygon[0])
    return 0.5 * np.linalg.norm(fan.sum(axis=0))


def _inside(point, polygon, normal):
    edges = np.roll(polygon, -1, axis=0) - polygon
    return (np.cross(edges, point - polygon) @ normal >= -1e-12).all()


def test_grasps_are_streamed_as_they_are_found():
    body = example_object("box")
    streamed = gc.iter_grasps(body, 0.4)
    first = next(streamed)
    everything = {first.id} | {grasp.id for grasp in streamed}
    assert everything == {grasp.id for grasp in gc.plan(body, 0.4).grasps}
