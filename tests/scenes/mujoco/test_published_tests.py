"""Scenes of other tools' tests have the mass that is asked for, and commands that squeeze."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from scenes.mujoco.chains import Weld
from scenes.mujoco.published_tests import HandServos, TestedObject
from scenes.mujoco_options import PhysicsSettings
from scenes.settings import FingerSettings
from sim_validate.hands.dexgraspbench import hand_file
from sim_validate.protocols.published import protocol
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled
from tests.scenes.mujoco.compiled import compiled

BODY = scaled("dodecahedron", 0.05)
GRASP = gc.plan(BODY, FRICTION, limit=1).grasps[0]
PHYSICS = PhysicsSettings(torsion_m=0.02)


def test_the_object_has_its_mass_and_inertia_and_the_friction_asked_for():
    scene = TestedObject(BODY, 0.7, 0.2, PHYSICS).by_fingertips(GRASP, FingerSettings())
    model, _ = compiled(scene, 0)
    body = model.body("object")
    assert body.mass[0] == pytest.approx(0.2)
    moments = np.linalg.eigvalsh(BODY.inertia) * 0.2 / BODY.volume
    assert np.sort(body.inertia) == pytest.approx(np.sort(moments))
    touching = model.geom_contype + model.geom_conaffinity > 0
    assert (model.geom_friction[touching, :2] == [0.7, 0.02]).all()
    assert (model.geom_condim[touching] == 4).all()
    assert not model.opt.gravity.any()


@pytest.mark.parametrize("name", ["dodecahedron", "l-bracket"])
def test_open_fingertips_touch_nothing_and_closed_ones_push_as_told(name):
    """At rest the contact forces are the servos', and their normal parts add up to those told."""
    body = scaled(name, 0.05)
    grasp = gc.plan(body, FRICTION, limit=1).grasps[0]
    tested = TestedObject(body, FRICTION, 0.2, PhysicsSettings())
    scene = tested.by_fingertips(grasp, FingerSettings())
    model, data = compiled(scene, 0)
    assert data.ncon == 0
    steps = 200
    for share in np.linspace(0.0, 1.0, steps):
        data.ctrl = (1.0 - share) * scene.opened
        mujoco.mj_step(model, data)
    for share in np.linspace(0.0, 1.0, steps):
        data.ctrl = share * scene.squeezing
        mujoco.mj_step(model, data)
    mujoco.mj_step(model, data, nstep=steps)
    pushes = -data.qfrc_constraint[6:].reshape(4, 3)[:, 0]
    assert pushes.max() == pytest.approx(10.0, rel=0.03)
    assert np.linalg.norm(data.qpos[:3]) < 1e-3


def test_a_hand_starts_open_and_all_its_links_can_touch_the_object():
    body = scaled("dodecahedron", 0.035)
    reach = next(
        each for each in reaches("allegro", "dodecahedron", 0.035) if each.pregrasp is not None
    )
    hand = gc.load_hand("allegro").with_torque_limits(0.7, "a test")
    tested = TestedObject(body, 0.6, 0.1, PHYSICS)
    scene = tested.by_hand(hand, tested.postures(hand, reach, 5.0), HandServos(5.0))
    model, data = compiled(scene, 0)
    met = model.geom_bodyid[data.contact.geom]
    assert not (met == model.body("object").id).any()
    solid = model.geom("object").id
    touchable = [
        geom for geom in range(model.ngeom)
        if geom != solid and model.geom_conaffinity[geom] & model.geom_contype[solid]
    ]  # fmt: skip
    assert len(touchable) >= len(hand.links)
    assert (model.geom_condim[touchable] == 4).all()
    assert (model.geom_friction[touchable, :2] == [0.6, 0.02]).all()
    assert model.actuator_gainprm[:, 0] == pytest.approx(5.0)
    assert scene.opened == pytest.approx(reach.pregrasp, abs=1e-8)
    assert scene.shut == pytest.approx(reach.joints, abs=1e-3)


def welded(weld):
    """The Allegro hand on a weld at a dodecahedron, as its file has it."""
    body, hand = scaled("dodecahedron", 0.035), gc.load_hand("allegro")
    found = [each for each in reaches("allegro", "dodecahedron", 0.035) if each.reached]
    reach = max(found, key=lambda each: min(each.joints[1:12:4]))  # three fingers can open
    strong = hand.with_torque_limits(0.7, "a test")
    servos = replace(hand_file(hand), weld=weld)
    physics = replace(protocol("dexgraspbench").physics, timestep=5e-4)
    tested = TestedObject(body, 0.6, 0.1, physics)
    return tested.by_hand(strong, tested.postures(strong, reach, 5.0), servos)


def test_a_weld_gives_way_by_its_closed_form():
    """At rest MuJoCo's soft constraint carries a force F where it is displaced by r:
    F w (1 - d) / d = k d r, with k = 1 / (d t)^2 and the inverse mass w of a free body."""
    seconds, impedance = 0.02, 0.95
    scene = welded(Weld((seconds, 1.0), (impedance, impedance, 0.001, 0.5, 2.0)))
    model, data = compiled(scene, 0)
    root, force = model.body("root").id, 30.0
    data.xfrc_applied[root, 2] = force
    before = data.qpos[7:10].copy()
    mujoco.mj_step(model, data, nstep=4000)
    stiffness = 1.0 / (impedance * seconds) ** 2
    share = (1.0 - impedance) / impedance**2
    expected = force * model.body_invweight0[root, 0] * share / stiffness
    assert data.qpos[7:10] - before == pytest.approx([0.0, 0.0, expected], abs=1e-3 * expected)
    assert expected > 1e-3
