"""What is read off motions that are made by hand: rolled, slid, carried, dropped."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.mujoco.held_scene import hinged
from scenes.mujoco.mjcf_text import rotations
from sim_validate.engine.stepping import Health
from sim_validate.execution.paths import TablePlane, idle
from sim_validate.execution.simulate import (
    SLIPPED_BY,
    TOUCH_SLIDE,
    HeldMotion,
    _first_slip,
    outcome,
    sticking_multiple,
)
from tests.sim_validate.execution.held_rigs import box_scene

COUNT = 400
FRICTION = np.full(4, 0.5)


def motion_of(moved=None, turned=None, palm=None, centers=None, forces=None):
    """A motion with these parts, all else at rest; centres of tips are (n, k, 3) in the palm."""
    layout = box_scene().layout
    rest = np.broadcast_to(layout.tip_centers, (COUNT, 4, 3))
    centers = rest if centers is None else centers
    tips = np.einsum("kij,nki->nkj", layout.axes, centers - rest)
    if forces is None:
        forces = np.broadcast_to(layout.pushes, (COUNT, 4, 3))
    turned = np.tile([1.0, 0, 0, 0], (COUNT, 1)) if turned is None else turned
    palm = np.zeros((COUNT, 6)) if palm is None else palm
    moved = np.zeros((COUNT, 3)) if moved is None else moved
    return HeldMotion(
        layout=layout,
        joints=np.hstack([moved, turned, palm, tips.reshape(COUNT, -1)]),
        pressed=hinged(palm[:, 3:]).transpose(0, 2, 1) @ rotations(turned),
        tips=tips,
        tip_turns=np.tile(np.eye(3), (COUNT, 1, 1, 1)),
        forces=forces,
        table=np.zeros((COUNT, 3)),
        states=np.zeros((COUNT, 0)),
        health=Health(),
    )


def loaded():
    return replace(idle(COUNT), shares=np.linspace(0.0, 1.0, COUNT))


def judged(motion, drive=None):
    return outcome(motion, drive or loaded(), FRICTION)


def test_a_palm_that_carries_everything_along_shows_no_motion():
    """Along a path and about each of its hinges, in whose order the palm turns."""
    layout = box_scene().layout
    u = np.linspace(0.0, 1.0, COUNT)
    angles = u[:, None] * [0.3, -0.5, 0.7]
    path = u[:, None] * [0.1, 0.2, -0.3]
    turned = Rotation.from_euler("XYZ", angles).as_quat(scalar_first=True)
    motion = motion_of(moved=path, turned=turned, palm=np.hstack([path, angles]))
    assert motion.shifts == pytest.approx(np.zeros((COUNT, 3)), abs=1e-15)
    assert motion.centers - layout.tip_centers == pytest.approx(np.zeros((COUNT, 4, 3)), abs=1e-15)
    assert motion.slides().max() == pytest.approx(0.0, abs=1e-12)
    assert judged(motion).turn_rad == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("axis", [[0, 1, 0], [0, 0, 1], [0, 1, -2], [1, 0, 0], [1, 2, 3]])
def test_rolling_without_sliding_is_no_slip(axis):
    """An object turns under a fingertip that does not: the tip's centre, seen from the object,
    advances by rho dt x n for the turn dt in the object's frame. Summed exactly, by a fine
    integration of the no-slip condition."""
    layout = box_scene().layout
    angles = np.linspace(0.0, 0.3, COUNT)
    unit = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    n, rho = layout.frames[:, :, 0], layout.tip_radius_m[:, None]
    own = layout.tip_centers + angles[:, None, None] * rho * np.cross(unit, n)  # object's frame
    turns = Rotation.from_rotvec(angles[:, None] * unit)
    centers = np.einsum("nij,nkj->nki", turns.as_matrix(), own)
    # the velocity of the touching point of the tip, which does not spin, is that of the object's
    step = (centers[1] - centers[0]) / (angles[1] - angles[0])
    touching = layout.contacts
    across = step - np.cross(unit, touching)
    across -= np.einsum("ki,ki->k", across, n)[:, None] * n
    if abs(unit @ [1, 0, 0]) < 1e-12:  # otherwise the point of contact twists, which is no slip
        assert np.abs(across).max() < 1e-3 * layout.radius_m
    motion = motion_of(turned=turns.as_quat(scalar_first=True), centers=centers)
    assert motion.slides().max() < 1e-3 * SLIPPED_BY * layout.radius_m
    found = judged(motion)
    assert found.turn_rad == pytest.approx(0.3, rel=1e-9)
    assert not found.slipped


@pytest.mark.parametrize("along", [[0, 1, 0], [0, 0, -1], [0, 0.6, 0.8]])
def test_a_fingertip_that_slides_by_a_millimetre_has_slipped_by_it(along):
    layout = box_scene().layout
    centers = np.tile(layout.tip_centers, (COUNT, 1, 1))
    centers[:, 2] += 1e-3 * np.linspace(0.0, 1.0, COUNT)[:, None] * np.array(along)
    found = judged(motion_of(centers=centers))
    assert found.slip_m == pytest.approx(1e-3, rel=1e-9)
    assert found.slipped
    assert found.first_slip <= 1.0


def test_what_happened_before_the_trial_began_does_not_count():
    moved = np.zeros((COUNT, 3))
    moved[:100, 1] = np.linspace(3e-3, 0.0, 100)
    motion = motion_of(moved=moved)
    late = outcome(motion, loaded(), FRICTION, begun=100)
    assert (late.slip_m, late.displacement_m) == (0.0, 0.0)
    assert judged(motion).displacement_m == pytest.approx(3e-3)


def test_an_object_that_no_finger_touches_is_dropped():
    forces = np.tile(box_scene().layout.pushes, (COUNT, 1, 1))
    forces[-1, 1:] = 0.0
    assert not judged(motion_of(forces=forces)).dropped
    forces[-1] = 0.0
    found = judged(motion_of(forces=forces))
    assert found.dropped
    assert found.slipped


def tangential(largest):
    """Forces that grow with the load: tangential ones of this share of friction times normal."""
    layout = box_scene().layout
    forces = np.tile(layout.pushes, (COUNT, 1, 1))
    world = np.einsum("kij,nkj->nki", layout.axes, forces)
    world[:, 0, 2] += largest * 0.5 * 5.0 * np.linspace(0.0, 1.0, COUNT)
    return np.einsum("kij,nki->nkj", layout.axes, world)


@pytest.mark.parametrize("largest", [0.2, 0.5, 0.9, 1.25, 2.0, 8.0])
def test_the_first_slip_is_where_forces_reach_the_cone_or_would_reach_it(largest):
    found = judged(motion_of(forces=tangential(largest)))
    assert found.slipped == (largest > 1.0)
    near = {"abs": 1.0 / COUNT} if found.slipped else {"rel": 1e-9}
    assert found.first_slip == pytest.approx(1.0 / largest, **near)


def taken_off(samples, by):
    """A lift in which a contact is on its cone in these samples, and slides by so many object radii
    in the first of them."""
    layout = box_scene().layout
    forces = np.tile(layout.pushes, (COUNT, 1, 1))
    world = np.einsum("kij,nkj->nki", layout.axes, forces)
    world[1:, 0, 2] += 0.1 * 0.5 * 5.0
    world[samples, 0, 2] = 0.5 * 5.0
    centers = np.tile(layout.tip_centers, (COUNT, 1, 1))
    centers[samples[0] :, 0, 1] += by * layout.radius_m
    table = TablePlane(np.array([0, 0, -0.03]), np.array([0, 0, 1.0]))
    shares = np.minimum(np.linspace(0.0, 4.0, COUNT), 1.0)
    drive = replace(idle(COUNT), shares=shares, table=table)
    return motion_of(centers=centers, forces=np.einsum("kij,nki->nkj", layout.axes, world)), drive


@pytest.mark.parametrize("samples", [[40], [40, 41, 42]])
def test_a_contact_that_touches_its_cone_at_a_take_off_and_holds_has_not_slipped(samples):
    found = judged(*taken_off(samples, 0.5 * TOUCH_SLIDE))
    assert not found.slipped
    assert found.first_slip == pytest.approx(10.0, rel=1e-6)


def test_a_contact_that_slides_on_its_cone_at_a_take_off_has_slipped():
    found = judged(*taken_off([40, 41], 2.0 * TOUCH_SLIDE))
    assert found.slip_m < SLIPPED_BY * box_scene().layout.radius_m
    assert found.slipped
    assert 0.38 < found.first_slip <= 40 * 4 / 399


def test_a_contact_that_is_on_its_cone_when_the_full_load_has_come_has_slipped():
    """However little it slides, and whether it came to its cone before or after."""
    for samples in ([*range(60, 110)], [150]):
        found = judged(*taken_off(samples, 0.5 * TOUCH_SLIDE))
        assert found.slipped
        assert found.first_slip == pytest.approx(min(samples[0] * 4 / 399, 1.0), abs=0.02)


def test_only_a_take_off_may_touch_a_cone():
    motion, drive = taken_off([40], 0.5 * TOUCH_SLIDE)
    assert judged(motion, replace(drive, table=None)).slipped


def test_a_slip_in_the_first_sample_of_a_load_has_a_multiple():
    """Before it nothing has changed and no load is there: nothing can be extrapolated from that."""
    forces = np.array([[[1.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], [[1.0, 0.6, 0.0]]])
    shares = np.array([0.0, 0.0, 0.3])
    assert _first_slip(forces, shares, FRICTION[:1], 0) == 0.3


def test_contacts_that_push_at_nothing_hold_no_multiple_of_the_load():
    motion = motion_of(forces=np.zeros((COUNT, 4, 3)))
    assert sticking_multiple(motion, idle(COUNT), FRICTION, 0) == 0.0
