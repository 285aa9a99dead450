from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize
from scipy.spatial import cKDTree

import grasp_core as gc
from grasp_core.planning.reach import Finger, reach, segment_distances
from scenes.example_objects import example_object
from tests.grasp_core.curved import curved_body


def nearest(start, end, triangle, rng):
    """Distance by minimising over the segment and the triangle, from several starts."""

    def gap(x):
        on = triangle[0] + x[1] * (triangle[1] - triangle[0]) + x[2] * (triangle[2] - triangle[0])
        return float(((start + x[0] * (end - start) - on) ** 2).sum())

    rim = {"type": "ineq", "fun": lambda x: 1.0 - x[1] - x[2]}
    found = [
        minimize(gap, rng.random(3) / 2.0, bounds=[(0.0, 1.0)] * 3, constraints=rim, tol=1e-14).fun
        for _ in range(6)
    ]
    return np.sqrt(max(min(found), 0.0))


def test_distances_of_segments_from_triangles_are_the_least():
    rng, crossing = np.random.default_rng(0), 0
    for case in range(25):
        start, end, triangle = rng.normal(size=3), rng.normal(size=3), rng.normal(size=(3, 3))
        if case % 5 == 0:
            end = start  # the ball before it moves
        if case % 7 == 0:
            triangle[2] = 0.5 * (triangle[0] + triangle[1])  # a sliver
        found = segment_distances(start, end, triangle[None])[0]
        assert found == pytest.approx(nearest(start, end, triangle, rng), abs=2e-6)
        crossing += found == 0.0
    assert crossing >= 1


STEPS = 48
"""Along a rod."""


def least_gap(body, grasp, finger, directions):
    """Least room left between rods and what they may meet, sampled, without the faces touched.

    Beside it how far it may be above the true one.
    """
    tips = grasp.positions - finger.radius_m * grasp.normals
    shares = np.linspace(0.0, finger.approach_m, STEPS)[:, None]
    rods = [tip + shares * way for tip, way in zip(tips, directions, strict=True)]
    corners, gap = body.vertices[body.triangles], np.inf
    for i, (rod, position, normal) in enumerate(
        zip(rods, grasp.positions, grasp.normals, strict=True)
    ):
        away = np.abs((corners - position) @ normal).max(axis=1) > 1e-9
        others = trimesh.Trimesh(body.vertices, body.triangles[away], process=False)
        room = trimesh.proximity.closest_point_naive(others, rod)[1].min()
        gap = min(gap, room - finger.radius_m)
        for other in rods[:i]:
            gap = min(gap, cKDTree(other).query(rod)[0].min() - 2.0 * finger.radius_m)
    return gap, finger.approach_m / (STEPS - 1)


def test_reached_contacts_have_free_rods_and_others_say_why():
    body = example_object("l-bracket")
    finger = Finger(0.06 * body.radius, 0.8 * body.radius)
    reached, reasons = 0, set()
    plan = gc.plan(body, 0.5, limit=40, families="concurrent")
    for grasp in plan.grasps[:40]:
        found = reach(body, grasp.faces, grasp.positions, grasp.normals, finger)
        if isinstance(found, str):
            reasons.add(found)
            gap, accuracy = least_gap(body, grasp, finger, -grasp.normals)
            assert gap < accuracy
        else:
            np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
            assert (np.einsum("ki,ki->k", found, grasp.normals) < 0.0).all()
            gap, _ = least_gap(body, grasp, finger, found)
            assert gap >= -2e-6 * body.radius
            reached += 1
    assert reached >= 5
    assert reasons


def test_nothing_too_large_gets_into_a_bore():
    """The nut's bore: a ball wider than it never, one that fits only from a slanting line."""
    body = example_object("hex-nut")
    inner = [
        index for index, face in enumerate(body.faces)
        if face.normal @ (face.centroid - body.center_of_mass) > 0.0
    ]  # fmt: skip
    assert len(inner) >= 6
    face = body.faces[inner[0]]
    bore = float(np.linalg.norm((face.centroid - body.center_of_mass)[:2]))
    contact = face.centroid[None], face.normal[None]
    wide = reach(body, (inner[0],), *contact, Finger(1.01 * bore, body.radius))
    assert "meets the object" in wide
    straight = reach(body, (inner[0],), *contact, Finger(0.3 * bore, 3.0 * bore))
    assert straight[0] @ -face.normal < 0.99


def test_a_plan_for_fingers_holds_only_grasps_that_they_reach():
    body = example_object("l-bracket")
    every = gc.plan(body, 0.5)
    finger = Finger(0.1 * body.radius, body.radius)
    some = gc.plan(body, 0.5, finger=finger)
    assert 0 < len(some.grasps) < len(every.grasps)
    assert some.finger == finger
    for grasp in some.grasps[::8]:
        gap, _ = least_gap(body, grasp, finger, -grasp.approach_directions)
        assert gap >= -2e-6 * body.radius
    assert all(grasp.approach_directions is None for grasp in every.grasps)
    assert sum(counts.unreachable for counts in some.counts.families.values()) > 0
    assert some.outcomes.out_of_reach == len(
        set(some.unreached) - {tuple(sorted(grasp.faces)) for grasp in some.grasps}
    )
    known = some.outcomes
    assert known.held + known.absent + known.open + known.out_of_reach == some.counts.quadruples
    slim = example_object("random-5-2")
    wide = Finger(slim.radius, slim.radius)
    nothing = gc.plan(slim, 0.5, families="concurrent", finger=wide)
    assert not nothing.grasps
    assert "fingers reach" in nothing.absence


@pytest.mark.slow
def test_the_patch_that_is_touched_is_not_in_the_way_but_the_rest_is():
    """A noisy surface: its neighbours on the patch stand out, so without the patch all is free."""
    body = curved_body(noise=0.003)
    finger = Finger(0.6 * body.radius, body.radius)
    plan = gc.plan(body, 0.5, limit=6, finger=finger)
    assert len(plan.grasps) == 6
    bare = replace(body, faces=tuple(replace(face, facets=[]) for face in body.faces))
    blocked = [
        isinstance(reach(bare, grasp.faces, grasp.positions, grasp.normals, finger), str)
        for grasp in plan.grasps
    ]
    assert sum(blocked) >= 3


def test_corners_that_rounding_lifts_are_not_in_the_way_of_fingers():
    """Coordinates of six decimals move faces of one plane by more than a millionth."""
    large = example_object("random-8-3")
    points, triangles = 0.2 * large.vertices, large.triangles
    exact = gc.Polyhedron.from_mesh(points, triangles)
    rounded = gc.Polyhedron.from_mesh(points.round(6), triangles, flatness_m=4e-6)
    finger = Finger(radius_m=0.001, approach_m=0.01)
    counts = [
        len(gc.plan(body, 0.5, families="concurrent", finger=finger)) for body in (exact, rounded)
    ]
    assert counts[0] == counts[1] > 20
