"""A hand that holds an object of true mass stands for springs that its servos really are."""

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from grasp_core.quality.motors import Motors
from scenes.mujoco.hand_scenes import finger_springs, has_pads
from sim_validate.execution.paths import closing
from sim_validate.execution.simulate import HeldBench
from tests.scenes.mujoco.compiled import compiled
from tests.sim_validate.hands.executing import standing

WRITTEN = 2e-8
"""Scenes have nine digits of each number; a chain adds up their roundings."""
HANDS = ("allegro", "leap")
SEEN_HANDS = (*HANDS, "coupled")


@pytest.mark.parametrize("hand", HANDS)
def test_springs_are_those_of_the_servos_by_the_simulators_own_jacobians(hand):
    """K = k_q (J J')^-1 with the Jacobian of the point of contact that MuJoCo computes."""
    _, _, scene, _ = standing(hand)
    layout, (model, data) = scene.layout, compiled(scene)
    for contact, name in enumerate(layout.holder.tip_names):
        J = np.zeros((3, model.nv))
        link = int(model.geom(name).bodyid[0])
        mujoco.mj_jac(model, data, J, None, layout.contacts[contact], link)
        own = J[:, 12:]  # after the object's and the palm's joints
        springs = layout.axes[contact] * layout.stiffness[contact] @ layout.axes[contact].T
        wanted = layout.holder.servo_n_m_per_rad * np.linalg.inv(own @ own.T)
        assert springs == pytest.approx(wanted, rel=1e-3, abs=1e-3 * np.abs(wanted).max())
        alike = layout.tip_masses[contact] / layout.stiffness[contact]
        assert alike == pytest.approx(
            layout.holder.armature_kg_m2 / layout.holder.servo_n_m_per_rad
        )


@pytest.mark.parametrize("hand", SEEN_HANDS)
def test_forces_seen_are_those_of_the_simulators_contacts(hand):
    """Forces come from joints or pads; MuJoCo's own contact forces are read beside them."""
    _, _, scene, _ = standing(hand)
    bench = HeldBench(scene)
    motion, state = bench.settled(closing())
    data = mujoco.MjData(bench.model)
    mujoco.mj_setState(bench.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION.value)
    mujoco.mj_forward(bench.model, data)
    names = {bench.model.geom(name).id: k for k, name in enumerate(scene.layout.holder.tip_names)}
    seen = np.einsum("kij,kj->ki", scene.layout.axes, motion.forces[-1])
    found = np.zeros_like(seen)
    for number in range(data.ncon):
        contact, wrench = data.contact[number], np.zeros(6)
        mujoco.mj_contactForce(bench.model, data, number, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]
        first, second = contact.geom1, contact.geom2
        tip = names[first if first in names else second]
        found[tip] += force if first in names else -force  # on the object
    assert np.abs(found).max() > 0.1
    assert seen == pytest.approx(found, abs=1e-3 * np.abs(found).max())


@pytest.mark.parametrize("hand", ["allegro", "coupled"])
def test_reached_places_are_met_by_joints_or_pads(hand):
    """A fingertip that is told to stand elsewhere stands there, by MuJoCo's kinematics."""
    _, _, scene, _ = standing(hand)
    layout, (model, data) = scene.layout, compiled(scene)
    count = len(layout.contacts)
    reached = np.random.default_rng(0).uniform(-1e-3, 1e-3, size=(count, 3))
    joints = layout.holder.joints(reached)
    tips, _, _ = layout.holder.seen(joints[None], np.zeros((1, len(joints))), np.eye(3)[None])
    assert tips[0] == pytest.approx(reached, abs=1e-7)
    data.qpos[13:] = joints  # after the object's and the palm's
    mujoco.mj_kinematics(model, data)
    placed = np.array([data.geom(name).xpos for name in layout.holder.tip_names])
    wanted = layout.tip_centers + np.einsum("kij,kj->ki", layout.axes, reached)
    assert placed == pytest.approx(wanted, abs=1e-7)
    rest = np.zeros((1, len(joints)))
    _, _, still = layout.holder.seen(rest, rest, np.eye(3)[None])
    assert still == pytest.approx(np.tile(np.eye(3), (1, count, 1, 1)), abs=WRITTEN)


def test_a_finger_that_is_rigid_in_some_direction_has_a_pad_that_gives_there():
    levers = np.zeros((4, 6))
    levers[:2, :3], levers[2:, 3:] = np.eye(3)[:2], np.eye(3)[1:]
    motors = Motors.of(levers, 1.0)
    assert has_pads(gc.load_hand("leap"), motors)
    # levers of one metre, so that servos and pads are springs of 2,000 N/m in series
    one, other = finger_springs(motors, 2000.0, pads=True)
    assert one == pytest.approx(np.diag([1000.0, 1000.0, 2000.0]))
    assert other == pytest.approx(np.diag([2000.0, 1000.0, 1000.0]))


@pytest.mark.parametrize("hand", SEEN_HANDS)
def test_balls_above_a_table_bound_the_hand(hand):
    """Support points of all geoms of the compiled hand are no lower than the balls say."""
    _, _, scene, _ = standing(hand)
    model, data = compiled(scene)
    middles, radii = scene.layout.holder.above_table
    known = {"object", "table"}
    geoms = [g for g in range(model.ngeom) if model.geom(g).name not in known
             and not model.geom(g).name.startswith("surface")]  # fmt: skip
    assert len(geoms) >= 10
    for way in np.random.default_rng(1).normal(size=(20, 3)):
        unit = way / np.linalg.norm(way)
        far = (middles @ unit + radii).max()
        lowest = max(_support(model, data, g, unit) for g in geoms)
        assert lowest <= far + WRITTEN


def _support(model, data, geom, way):
    """Return how far a ball, capsule or box reaches along a direction."""
    size, place = model.geom_size[geom], data.geom_xpos[geom] @ way
    along = data.geom_xmat[geom].reshape(3, 3).T @ way
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return place + size[0]
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return place + size[0] + size[1] * abs(along[2])
    assert kind == mujoco.mjtGeom.mjGEOM_BOX
    return place + np.abs(along) @ size
