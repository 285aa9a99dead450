import itertools
import math

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.frames import kept_angle, plane_tangents, radians_of

FINGER = gc.Finger(0.003, 0.05)


@pytest.fixture(scope="module")
def body():
    return scenes.example_object("wedge")


def test_poses_at_contacts_are_right_handed_with_z_along_the_normal(body):
    for grasp in gc.plan(body, limit=12):
        poses = grasp.contact_frames()
        assert poses.shape == (4, 4, 4)
        for pose, contact in zip(poses, grasp.contacts, strict=True):
            turn = pose[:3, :3]
            assert np.allclose(turn.T @ turn, np.eye(3), atol=1e-12)
            assert np.linalg.det(turn) == pytest.approx(1.0)
            assert np.array_equal(pose[:3, 2], contact.normal)
            assert np.array_equal(pose[:3, 3], contact.position)
            assert np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0])


def test_fingers_that_go_along_z_from_their_poses_arrive_at_the_contacts(body):
    for planned, finger in (
        (gc.plan(body, limit=5), None),
        (gc.plan(body, limit=5, finger=FINGER), FINGER),
    ):
        assert len(planned) > 1
        for grasp in planned:
            poses = grasp.approach_poses(0.02)
            arrived = poses @ np.array([0.0, 0.0, 0.02, 1.0])
            assert np.allclose(arrived[:, :3], grasp.positions, atol=1e-12)
            ways = grasp.normals if finger is None else grasp.approach_directions
            assert np.allclose(poses[:, :3, 2], ways, atol=1e-12)
            assert np.array_equal(grasp.approach_poses()[:, :3, 3], grasp.positions)


def test_directions_with_equal_components_have_tangents_that_rounding_cannot_turn():
    """Normals of an octahedron, of a dodecahedron and along the axes, shaken by last digits."""
    rng, golden = np.random.default_rng(0), (1.0 + 5.0**0.5) / 2.0
    rows = [(1.0, 1.0, 1.0), (0.0, 1.0, golden), (1.0, golden, 0.0), (0.0, 0.0, 1.0)]
    tried = 0
    for row, signs in itertools.product(rows, itertools.product((-1.0, 1.0), repeat=3)):
        unit = np.array(row) * signs / np.linalg.norm(row)
        own = np.array(plane_tangents(*unit))
        for _ in range(20):
            shaken = unit + 1e-15 * rng.uniform(-1.0, 1.0, 3)
            assert np.abs(np.array(plane_tangents(*shaken)) - own).max() < 1e-14
            tried += 1
    assert tried == 640


def test_a_distance_below_zero_is_refused(body):
    with pytest.raises(gc.InputError, match="standoff_m"):
        gc.plan(body, limit=1)[0].approach_poses(-0.1)


ANGLES = [
    float(scale * share)
    for scale in (1e-12, 1e-3, 0.1, math.pi / 2)
    for share in np.random.default_rng(0).uniform(size=2000)
]


def test_an_angle_that_was_written_is_read_as_it_was():
    changed = 0
    for angle in ANGLES:
        kept = kept_angle(angle)
        assert math.degrees(kept) == math.degrees(angle)
        assert radians_of(math.degrees(kept)) == kept
        assert abs(kept - angle) <= math.ulp(angle)
        changed += math.radians(math.degrees(kept)) != kept
    assert changed > 100  # the plain conversion would miss so many
