"""The scene of a hand is the hand: its places, limits and masses, and nothing touches but tips."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from tests.grasp_core.hands.gripping import FRICTION, scaled
from tests.scenes.mujoco.compiled import compiled
from tests.sim_validate.hands.executing import OBJECT, RADIUS
from tests.sim_validate.hands.executing import stood as standing_hand

WRITTEN = 2e-8
"""Scenes have nine digits of each number; a chain adds up their roundings."""
HEAVY = 1e-7
"""A hand's weight of some newtons, moved by as much."""
DOWN = (0.0, 0.6, -0.8)


def stood(hand, down=None):
    """A scene, its compiled model, and the pose it was made from."""
    body, (reach, held) = scaled(OBJECT, RADIUS), standing_hand(hand)
    scene = scenes.build_hand_scene(held, body, reach, FRICTION, down=down)
    return held, body, reach, scene, *compiled(scene)


@pytest.mark.parametrize("hand", ["allegro", "leap"])
def test_links_and_tips_are_where_the_hand_has_them(hand):
    held, body, reach, scene, _, data = stood(hand)
    at = places(held, scene.hand.angles, reach.palm_pose)
    for k, link in enumerate(held.links):
        body_at = data.body(link.name)
        expected = at.link_positions[0, k] - body.center_of_mass
        assert body_at.xpos == pytest.approx(expected, abs=WRITTEN)
        assert body_at.xmat.reshape(3, 3) == pytest.approx(at.link_rotations[0, k], abs=WRITTEN)
    for contact, finger in enumerate(reach.fingers):
        name = held.fingers[finger].name
        tip = data.geom(f"tip_{name}").xpos
        assert tip == pytest.approx(scene.layout.holder.tip_centers[contact], abs=WRITTEN)
        there = reach.contacts[contact]
        touched = tip + held.fingers[finger].tip.radius * there.normal
        assert touched == pytest.approx(there.position - body.center_of_mass, abs=2e-5)
    # the pose is only moved as far as fingertips were off their faces
    assert np.abs(scene.hand.angles - reach.joints).max() < 1e-3


@pytest.mark.parametrize("hand", ["allegro", "leap"])
def test_only_fingertips_touch_and_they_touch_the_object(hand):
    *_, model, data = stood(hand)
    met = [frozenset(model.geom(int(g)).name for g in c.geom) for c in data.contact]
    assert len(met) == 4
    tips = {name for pair in met for name in pair if name.startswith("tip_")}
    assert len(tips) == 4
    assert all(pair - tips == {"object"} for pair in met)
    depths = [-c.dist for c in data.contact]
    assert min(depths) > 0.0
    assert max(depths) < 1e-6


@pytest.mark.parametrize("hand", ["allegro", "leap"])
def test_commands_turn_into_joint_torques_and_limits_hold(hand):
    *_, scene, model, data = stood(hand)
    holder = scene.layout.holder
    forces = np.random.default_rng(0).normal(size=(1, 4, 3))
    data.ctrl[:] = holder.efforts(forces)[0] / holder.servo
    mujoco.mj_forward(model, data)
    torques = scene.hand.motors.levers @ forces.ravel()
    assert torques == pytest.approx(data.qfrc_actuator[6:], abs=1e-8)
    data.ctrl[:] = holder.efforts(1e3 * forces)[0] / holder.servo
    mujoco.mj_forward(model, data)
    large = np.abs(1e3 * torques) > 0.35
    assert large.sum() > 8
    assert np.abs(data.qfrc_actuator[6:])[large] == pytest.approx(0.35)


def test_gravity_pulls_at_links_as_the_motors_say_and_not_at_the_object():
    *_, scene, model, data = stood("leap", DOWN)
    mujoco.mj_forward(model, data)
    assert np.linalg.norm(model.opt.gravity) == pytest.approx(9.80665, abs=1e-6)
    # what holds a body still is the bias force less what compensates gravity
    held = data.qfrc_bias - data.qfrc_gravcomp
    assert held[:6] == pytest.approx(np.zeros(6), abs=1e-12)
    assert held[6:] == pytest.approx(scene.hand.motors.gravity, abs=HEAVY)
    assert np.abs(held[6:]).max() > 1e-3


def test_another_hand_than_that_of_the_pose_is_refused():
    _, body, reach, *_ = stood("allegro")
    other = gc.load_hand("leap").with_torque_limits(0.35, "a test")
    with pytest.raises(InputError, match="hand must be the one of the pose"):
        scenes.build_hand_scene(other, body, reach, FRICTION)


def test_a_link_without_a_mass_is_next_to_none_where_links_weigh():
    """MuJoCo compiles no link of no mass."""
    reach, hand = standing_hand("leap")
    first, *others = hand.fingers
    frame = replace(first.links[0], mass_kg=0.0, center_of_mass=np.zeros(3))
    light = replace(hand, fingers=(replace(first, links=(frame, *first.links[1:])), *others))
    scene = scenes.build_hand_scene(light, scaled(OBJECT, RADIUS), reach, FRICTION, down=DOWN)
    assert 0.0 < compiled(scene)[0].body(frame.name).mass[0] < 1e-5
