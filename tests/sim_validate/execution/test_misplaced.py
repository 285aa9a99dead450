"""Misplaced objects: fingertips stop where they touch, and where they first touch."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import grasp_core as gc
from grasp_core.execution.grips import unsqueezed
from scenes.mujoco.fingertips import fitting_radius
from scenes.mujoco.held_scene import held_layout
from scenes.mujoco.scene_text import TOUCH
from scenes.settings import HeldSettings
from sim_validate.engine.misplacement import drawn_errors
from sim_validate.execution.trials import MEETING_ROOM, closed_there, misplaced_poses, tips_met
from tests.sim_validate.execution.held_rigs import planned

OFF_M, OFF_RAD = 0.002, np.radians(3.0)


def layout_of(name):
    body, grasp = planned(name)
    radius = fitting_radius(body, grasp.positions, grasp.normals)
    grip = unsqueezed(body, grasp, 0.5, stiffness=2000.0, tip_radius_m=radius)
    return held_layout(body, grip, HeldSettings(mass_kg=0.3))


def turn_of(quaternion):
    return trimesh.transformations.quaternion_matrix(quaternion)[:3, :3]


def distances(layout, points):
    """From the mesh, by trimesh: the least over all triangles, (n,)."""
    corners = layout.vertices[layout.triangles]
    found = np.full(len(points), np.inf)
    for triangle in corners:
        nearest = trimesh.triangles.closest_point(np.tile(triangle, (len(points), 1, 1)), points)
        found = np.minimum(found, np.linalg.norm(nearest - points, axis=1))
    return found


def tip_paths(layout, pose, reached, count=200):
    """Centres of the fingertips on their ways to where they stop, in the object's frame."""
    room = MEETING_ROOM * (OFF_M + OFF_RAD * layout.radius_m)
    stop = layout.tip_centers + np.einsum("kij,kj->ki", layout.axes, reached)
    start = layout.tip_centers - room * layout.frames[:, :, 0]
    way = start + np.linspace(0.0, 1.0, count)[:, None, None] * (stop - start)
    return (way - pose.moved) @ turn_of(pose.quaternion)


def drawn(layout, count, seed):
    off = drawn_errors(count, seed, "exactly")
    return misplaced_poses(layout, OFF_M * off[:, 0], OFF_RAD * off[:, 1])


@pytest.fixture(scope="module", params=["box", "l-bracket"])
def misplaced(request):
    layout = layout_of(request.param)
    poses = drawn(layout, 12, 0)
    return layout, poses, tips_met(layout, poses, OFF_M, OFF_RAD)


def test_objects_are_off_by_what_is_stated():
    layout = layout_of("box")
    poses = drawn(layout, 200, 5)
    shifts = np.array([pose.moved for pose in poses])
    assert np.linalg.norm(shifts, axis=1) == pytest.approx(OFF_M, rel=1e-6)
    turns = np.array([turn_of(pose.quaternion) for pose in poses])
    angles = np.arccos(0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0))
    assert angles == pytest.approx(OFF_RAD, rel=1e-5)
    # uniform directions have the mean zero, to three standard errors
    assert np.abs(shifts.mean(axis=0)).max() < 3.0 * OFF_M / np.sqrt(3.0 * 200)


def test_fingertips_touch_where_they_stop_and_nowhere_before(misplaced):
    """The judge is trimesh: its distance from the mesh along the whole way, densely."""
    layout, poses, reached = misplaced
    radii = layout.tip_radius_m - TOUCH * layout.radius_m
    touched = 0
    for pose, own in zip(poses, reached, strict=True):
        ways = tip_paths(layout, pose, own)
        for finger, way in enumerate(ways.transpose(1, 0, 2)):
            gaps = distances(layout, way)
            assert gaps.min() >= radii[finger] - 1e-9
            assert gaps[-1] == pytest.approx(radii[finger], abs=1e-6 * layout.radius_m)
            touched += 1
    assert touched == 4 * 12


def test_a_finger_that_meets_nothing_stops_beyond_its_place():
    layout = layout_of("box")
    off = np.array([[10.0 * layout.radius_m, 0.0, 0.0]])
    (pose,) = misplaced_poses(layout, off, np.zeros((1, 3)))
    reached = tips_met(layout, (pose,), OFF_M, 0.0)
    moved = np.einsum("kij,pkj->pki", layout.axes, reached)[0]
    assert moved == pytest.approx(MEETING_ROOM * OFF_M * layout.frames[:, :, 0], abs=1e-12)
    assert closed_there(layout, pose, reached[0]) is False


def test_errors_have_the_stated_deviations():
    off = drawn_errors(2000, 1, "deviation")
    assert off.std(axis=0) == pytest.approx(1.0, abs=0.06)
    layout = layout_of("box")
    poses = misplaced_poses(layout, OFF_M * off[:20, 0], OFF_RAD * off[:20, 1])
    for pose, (way, turn) in zip(poses, off, strict=False):
        assert pose.moved == pytest.approx(OFF_M * way, abs=1e-9)
        exact = Rotation.from_rotvec(OFF_RAD * turn).as_matrix()
        assert turn_of(pose.quaternion) == pytest.approx(exact, abs=1e-7)


def test_starts_are_closed_where_fingers_meet_closed_contacts(misplaced):
    """Trimesh says what each fingertip touches, and the public test decides."""
    layout, poses, reached = misplaced
    corners = layout.vertices[layout.triangles]
    for pose, own in zip(poses, reached, strict=True):
        contacts = []
        for center in tip_paths(layout, pose, own)[-1]:
            near = trimesh.triangles.closest_point(corners, np.tile(center, (len(corners), 1)))
            point = near[np.linalg.norm(near - center, axis=1).argmin()]
            contacts.append(gc.Contact(point, (point - center) / np.linalg.norm(point - center)))
        closed = gc.force_closure(contacts, friction=0.5).closed
        assert closed_there(layout, pose, own) is closed
