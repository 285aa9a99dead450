"""How objects rest on a table, against what resting means, and against trimesh's hull."""

import numpy as np
import pytest
import trimesh

import scenes
from sim_validate.execution.trials import TABLE_GAP, resting, rests

OBJECTS = ("tetrahedron", "wedge", "screwdriver", "l-bracket")


@pytest.fixture(scope="module", params=OBJECTS)
def rested(request):
    body = scenes.example_object(request.param)
    return body, rests(body)


def test_every_point_is_above_the_table_and_three_touch_it(rested):
    body, found = rested
    points = body.vertices - body.center_of_mass
    assert found
    for rest in found:
        assert np.linalg.norm(rest.down) == pytest.approx(1.0)
        heights = rest.height - points @ rest.down
        assert heights.min() == pytest.approx(0.0, abs=1e-9)
        assert np.sum(heights < 1e-6 * body.radius) >= 3


def tips_over(points, down):
    """Whether a tilt by a hundredth of a degree, to any side, lowers the middle."""
    height = (points @ down).max()
    around = np.linalg.svd(down[None])[2][1:]
    for turn in np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False):
        tilted = down + 2e-4 * (np.cos(turn) * around[0] + np.sin(turn) * around[1])
        if (points @ tilted).max() / np.linalg.norm(tilted) <= height:
            return True
    return False


def test_the_rests_are_the_faces_of_the_hull_on_which_the_object_does_not_tip(rested):
    body, found = rested
    points = body.vertices - body.center_of_mass
    downs = np.array([rest.down for rest in found])
    kept = 0
    for normal in trimesh.Trimesh(points, body.triangles).convex_hull.face_normals:
        rest = (downs @ normal).max() > 1.0 - 1e-8
        assert tips_over(points, normal) != rest
        kept += rest
    assert kept >= len(found)


def test_likelihoods_are_shares_of_random_directions(rested):
    """A direction from the centre of mass hits the face with the least distance along it."""
    body, found = rested
    mesh = trimesh.Trimesh(body.vertices - body.center_of_mass, body.triangles).convex_hull
    normals, offsets = (
        mesh.face_normals,
        np.einsum("ti,ti->t", mesh.face_normals, mesh.triangles[:, 0]),
    )
    ways = np.random.default_rng(1).normal(size=(20000, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    with np.errstate(divide="ignore"):
        reach = np.where(ways @ normals.T > 0.0, offsets / (ways @ normals.T), np.inf)
    hit = normals[reach.argmin(axis=1)]
    for rest in found:
        share = np.mean(hit @ rest.down > 1.0 - 1e-6)
        assert rest.likelihood == pytest.approx(share, abs=4.0 * np.sqrt(0.25 / len(ways)))


def test_fingertips_are_clear_of_the_table_on_the_likeliest_rest_that_lets_them():
    body = scenes.example_object("box")
    found = rests(body)
    radius = 0.005
    for blocked in range(1, len(found)):
        # a fingertip below the middle of each of the likelier sides
        tips = np.array([(rest.height + radius) * rest.down for rest in found[:blocked]])
        rest = resting(body, tips.reshape(-1, 3), np.full(len(tips), radius))
        assert rest is not None
        np.testing.assert_array_equal(rest.down, found[blocked].down)
        assert (tips @ rest.down + radius).max() <= rest.height - TABLE_GAP * body.radius
    everywhere = np.array([(rest.height + radius) * rest.down for rest in found])
    assert resting(body, everywhere, np.full(len(found), radius)) is None
