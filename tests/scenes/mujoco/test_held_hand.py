"""A hand that holds an object of true mass stands for springs that its servos really are."""

import mujoco
import numpy as np
import pytest

from grasp_core.errors import InputError
from grasp_core.quality.motors import Motors
from scenes.mujoco.hand_scenes import finger_springs
from sim_validate.execution.paths import closing
from sim_validate.execution.simulate import HeldBench
from tests.scenes.mujoco.compiled import compiled
from tests.sim_validate.hands.executing import standing

WRITTEN = 2e-8
"""Scenes have nine digits of each number; a chain adds up their roundings."""
HANDS = ("allegro", "leap")


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
        wanted = layout.holder.servo * np.linalg.inv(own @ own.T)
        assert springs == pytest.approx(wanted, rel=1e-3, abs=1e-3 * np.abs(wanted).max())
        alike = layout.tip_masses[contact] / layout.stiffness[contact]
        assert alike == pytest.approx(layout.holder.armature_kg_m2 / layout.holder.servo)


@pytest.mark.parametrize("hand", HANDS)
def test_forces_seen_are_those_of_the_simulators_contacts(hand):
    """Forces come from joint torques; MuJoCo's own contact forces are read beside them."""
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


def test_reached_places_are_met_by_joints():
    """A fingertip that is told to stand elsewhere stands there, by the hand's own kinematics."""
    _, _, scene, _ = standing("allegro")
    layout = scene.layout
    reached = np.random.default_rng(0).uniform(-1e-3, 1e-3, size=(4, 3))
    joints = layout.holder.joints(reached)
    tips, _, _ = layout.holder.seen(joints[None], np.zeros((1, len(joints))), np.eye(3)[None])
    assert tips[0] == pytest.approx(reached, abs=1e-7)
    _, _, still = layout.holder.seen(np.zeros((1, 16)), np.zeros((1, 16)), np.eye(3)[None])
    assert still == pytest.approx(np.tile(np.eye(3), (1, 4, 1, 1)), abs=WRITTEN)


def test_a_finger_that_is_rigid_in_some_direction_is_no_spring():
    levers = np.zeros((4, 6))
    levers[:2, :3], levers[2:, 3:] = np.eye(3)[:2], np.eye(3)[1:]
    with pytest.raises(InputError, match="contact 0 is stretched, or has fewer than three"):
        finger_springs(Motors.of(levers, 1.0), 2000.0)


@pytest.mark.parametrize("hand", HANDS)
def test_balls_above_a_table_bound_the_hand(hand):
    """Support points of all geoms of the compiled hand are no lower than the balls say."""
    _, _, scene, _ = standing(hand)
    model, data = compiled(scene)
    middles, radii = scene.layout.holder.above_table
    known = {"object", "table"}
    geoms = [g for g in range(model.ngeom) if model.geom(g).name not in known
             and not model.geom(g).name.startswith("surface")]  # fmt: skip
    assert len(geoms) > 12
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
