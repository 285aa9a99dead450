"""Scenes of execution as the simulator compiles them, against their layouts."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.quality.contact_forces import even_forces
from scenes.mujoco.held_scene import gravity_of, held_physics
from scenes.mujoco.scene_text import FINGERTIP_BIT, TABLE_BIT
from tests.scenes.mujoco.compiled import compiled, state_of

OBJECTS = ("dodecahedron", "l-bracket")
MASS = 0.4
HELD = scenes.HeldSettings(mass_kg=MASS)
FRICTION = (0.3, 0.5, 0.7, 0.9)


@cache
def held(name):
    body = scenes.example_object(name)
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    squeeze = 8.0 * even_forces(grasp.positions, grasp.normals, 0.3)
    stiffness = np.array([np.diag([1000.0, 2000.0, 4000.0])] * 3 + [3000.0 * np.eye(3)])
    grip = gc.grip(body, grasp, FRICTION, squeeze, stiffness=stiffness, tip_radius_m=0.004)
    scene = scenes.build_held_scene(
        body, grip, scenes.HeldSettings(mass_kg=MASS, tip_mass_kg=0.02, damping_ratio=0.7)
    )
    return body, grip, scene, compiled(scene)[0]


@pytest.fixture(params=OBJECTS, scope="module")
def built(request):
    return held(request.param)


def test_the_object_has_its_true_mass_and_inertia(built):
    body, _, _, model = built
    place = model.body("object").id
    assert model.body_mass[place] == pytest.approx(MASS, rel=1e-12)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[place])
    R = turn.reshape(3, 3)
    inertia = R @ np.diag(model.body_inertia[place]) @ R.T
    expected = MASS / body.volume * body.inertia
    assert inertia == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    assert model.body_ipos[place] == pytest.approx(np.zeros(3))


def test_what_touches_what(built):
    """Fingertips touch the surface and the table the hull; nothing else touches."""
    _, grip, scene, model = built
    pairs, met = set(), "object" if scene.layout.solids is None else "surface"
    for one in range(model.ngeom):
        for other in range(one + 1, model.ngeom):
            if (model.geom_contype[one] & model.geom_conaffinity[other]) or (
                model.geom_contype[other] & model.geom_conaffinity[one]
            ):
                kinds = (model.geom(one).name, model.geom(other).name)
                pairs.add(tuple(sorted(kind.rstrip("0123456789") for kind in kinds)))
    assert pairs == {("finger", met), ("object", "table")}
    assert FINGERTIP_BIT & TABLE_BIT == 0
    for finger, friction in enumerate(grip.friction):
        assert model.geom(f"finger{finger}").friction[0] == friction
    assert model.geom("object").friction[0] == 0.0


def test_fingertips_start_on_their_contacts(built):
    body, grip, _, model = built
    data = state_of(model, 0)
    for finger in range(4):
        center = data.geom(f"finger{finger}").xpos
        assert center + 0.004 * grip.normals[finger] == pytest.approx(
            grip.arms[finger], abs=3e-6 * body.radius
        )
    touched = {c.geom1 for c in data.contact} | {c.geom2 for c in data.contact}
    assert {model.geom(f"finger{finger}").id for finger in range(4)} <= touched


def test_springs_are_those_of_the_grip(built):
    """The force that moves a tip back, over its displacement along the world's axes."""
    _, grip, _, model = built
    for finger in range(4):
        measured = np.zeros((3, 3))
        data = state_of(model, 0)
        data.ctrl[:] = 0.0
        mujoco.mj_forward(model, data)
        turn = data.body(f"finger{finger}").xmat.reshape(3, 3)
        place = 13 + 3 * finger
        for axis in range(3):
            data.qpos[place : place + 3] = turn.T @ (1e-3 * np.eye(3)[axis])
            mujoco.mj_forward(model, data)
            force = data.qfrc_actuator[12 + 3 * finger : 15 + 3 * finger]
            measured[:, axis] = -(turn @ force) / 1e-3
        assert measured == pytest.approx(grip.stiffness[finger], abs=1e-5 * 4000.0)


def test_gravity_pulls_the_object_alone(built):
    """Fingers and palm are carried: their joints feel no weight at rest."""
    _, _, scene, model = built
    data = state_of(model, 0)
    assert scene.layout.gravity == pytest.approx([0, 0, -9.80665])
    weights = data.qfrc_bias - data.qfrc_gravcomp
    assert weights[:3] == pytest.approx(-MASS * scene.layout.gravity)
    assert weights[6:] == pytest.approx(np.zeros(len(weights) - 6), abs=1e-9)


def test_gravity_has_its_size_in_any_direction():
    hand = scenes.HeldSettings(mass_kg=MASS, down=(3.0, 0.0, 4.0))
    assert gravity_of(hand) == pytest.approx([0.6 * 9.80665, 0.0, 0.8 * 9.80665])
    body, grip, _, _ = held("dodecahedron")
    tilted = scenes.build_held_scene(body, grip, hand)
    assert tilted.physics.gravity == tuple(gravity_of(hand))
    with pytest.raises(gc.InputError, match=r"physics\.gravity"):
        scenes.build_held_scene(body, grip, HELD, physics=tilted.physics)
    own = replace(held_physics(tilted.layout), timestep=0.001)
    assert scenes.build_held_scene(body, grip, hand, physics=own).physics is own
