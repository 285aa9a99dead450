"""Depth images are what rays say that are cut with the triangles, from cameras where they say."""

import math

import numpy as np
import pytest

from grasp_core.errors import InputError
from scenes.drawing.clips import GraphicsError
from scenes.drawing.depth.cameras import HIGHEST, LOWEST, Lens, above, around
from scenes.drawing.depth.depth_images import Views, depth_images
from scenes.example_objects import example_object
from tests.scenes.drawing.depth.ray_depths import ray_depths

LENS = Lens(48, 32, math.radians(50.0))
OUTLINE = 1e-3
"""Barycentric coordinate up to which the ray of a pixel touches the edge of a triangle."""


def drawn(*asked):
    try:
        return depth_images(asked)
    except GraphicsError as error:
        pytest.skip(str(error))


def seen_around(name, count):
    body = example_object(name)
    distance = LENS.distance(body.radius)
    cameras = around(body.center_of_mass, distance, count, np.random.default_rng(3))
    return Views(body, cameras, LENS)


def test_depths_are_those_of_rays_and_the_object_is_where_they_meet_it():
    asked = [seen_around(name, 3) for name in ("wedge", "cross")]
    pixels = outlines = 0
    for views, images in zip(asked, drawn(*asked), strict=True):
        for number, pose in enumerate(views.cameras):
            depth, near_edge = ray_depths(views.body, pose, LENS.matrix, (32, 48))
            image, seen = images.depth_m[number], images.on_object[number]
            differs = (depth > 0.0) != seen
            assert (near_edge[differs] <= OUTLINE).all()
            both = seen & ~differs & (near_edge > OUTLINE)
            np.testing.assert_allclose(image[both], depth[both], rtol=5e-6, atol=0.0)
            assert (image[~seen] == 0.0).all()
            pixels, outlines = pixels + both.sum(), outlines + differs.sum()
    assert pixels > 1500
    assert outlines < 0.01 * pixels


def test_the_table_is_the_plane_under_the_object():
    """Where the table is seen, each pixel's point lies in its plane; each camera has its own."""
    body = example_object("wedge")
    tables = np.array([np.eye(4)] * 2)
    for table, face in zip(tables, body.faces, strict=False):
        table[:3, :3] = np.linalg.qr(np.column_stack([face.normal, np.eye(3)]))[0][:, [1, 2, 0]]
        table[:3, 2] = face.normal
        table[:3, 0] = np.cross(table[:3, 1], table[:3, 2])
        table[:3, 3] = face.centroid
    distance = LENS.distance(body.radius)
    cameras = above(body.center_of_mass, distance, tables[:, :3, 2], np.random.default_rng(1))
    (images,) = drawn(Views(body, cameras, LENS, tables))
    rows, columns = np.indices((32, 48)) + 0.5
    for pose, table, depth, seen in zip(
        cameras, tables, images.depth_m, images.on_object, strict=True
    ):
        rays = np.linalg.inv(LENS.matrix) @ np.stack([columns, rows, np.ones_like(rows)]).reshape(
            3, -1
        )
        points = (pose[:3, :3] @ (rays * depth.ravel())).T + pose[:3, 3]
        heights = (points - table[:3, 3]) @ table[:3, 2]
        on_table = ~seen.ravel() & (depth.ravel() > 0.0)
        assert on_table.sum() > 300
        assert np.abs(heights[on_table]).max() <= 1e-4 * body.radius * depth.max() / distance
        assert heights[seen.ravel()].min() >= -1e-4 * body.radius
        assert seen.sum() > 100


@pytest.mark.parametrize(("width", "height"), [(64, 64), (90, 30), (30, 90)])
def test_the_sphere_around_the_object_fits_every_image(width, height):
    lens, radius = Lens(width, height, math.radians(35.0)), 0.07
    distance = lens.distance(radius)
    rng = np.random.default_rng(0)
    points = rng.normal(size=(2000, 3))
    points *= radius / np.linalg.norm(points, axis=1)[:, None]
    center = np.array([0.1, 0.2, 0.3])
    for pose in around(center, distance, 5, rng):
        assert pose[:3, :3].T @ pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(pose[:3, :3]) > 0.0
        local = (points + center - pose[:3, 3]) @ pose[:3, :3]
        u, v, w = lens.matrix @ local.T
        assert (w > 0.0).all()
        assert (u / w >= 0.0).all()
        assert (u / w <= width).all()
        assert (v / w >= 0.0).all()
        assert (v / w <= height).all()
        assert np.ptp(u / w) > 0.85 * min(width, height)


def test_cameras_are_spread_around_and_stay_above_a_table():
    ways = around(np.zeros(3), 1.0, 200, np.random.default_rng(2))[:, :3, 3]
    assert np.linalg.norm(ways, axis=1) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(ways.mean(axis=0)) < 0.02
    gaps = np.linalg.norm(ways[:, None] - ways[None], axis=2) + 9.0 * np.eye(len(ways))
    assert gaps.min() > 0.15
    up = np.array([0.6, 0.0, 0.8])
    poses = above(np.zeros(3), 1.0, np.array([up] * 300), np.random.default_rng(2))
    heights = poses[:, :3, 3] @ up
    assert math.sin(LOWEST) <= heights.min() <= heights.max() <= math.sin(HIGHEST)
    assert np.ptp(heights) > 0.5
    assert (poses[:, :3, 1] @ up < 0.0).all()  # y points down in the image


@pytest.mark.parametrize(
    "numbers", [{"width": 0}, {"height": 5000}, {"field_rad": 0.0}, {"field_rad": math.pi}]
)
def test_lenses_that_draw_nothing_are_refused(numbers):
    with pytest.raises(InputError, match=next(iter(numbers))):
        Lens(**numbers)
