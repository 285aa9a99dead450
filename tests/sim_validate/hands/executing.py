"""Hands that stand in grasps of an object, with the scene in which they execute them."""

from functools import lru_cache

import grasp_core as gc
from scenes.mujoco.hand_scenes import held_hand_scene
from sim_validate.hands.execute import HandHolder, hand_execution_settings
from tests.grasp_core.hands.coupled_hand import coupled_hand, coupled_reaches
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled

COUPLED = ("coupled", "spreading")
OBJECT, RADIUS, MASS, TORQUE = "dodecahedron", 0.035, 0.07, 0.35


@lru_cache(maxsize=4)
def stood(name):
    """Return a pose of a hand with motors, and that hand, which may be a gripper with couplings."""
    if name in COUPLED:
        spreading = name == "spreading"
        return coupled_reaches(spreading)[0], coupled_hand(spreading)
    reach = next(each for each in reaches(name, OBJECT, RADIUS) if each.reached)
    return reach, gc.load_hand(name).with_torque_limits(TORQUE, "a test")


def held_object(name):
    """Return what a hand stands at."""
    return scaled("box" if name in COUPLED else OBJECT, RADIUS)


@lru_cache(maxsize=4)
def standing(name):
    """Return a pose of a hand, the hand, its scene with an object, and the squeeze."""
    reach, hand = stood(name)
    body, settings = held_object(name), hand_execution_settings(MASS)
    best = HandHolder(body, hand, reach, FRICTION).squeeze(settings)
    scene = held_hand_scene(hand, body, reach, best.grip, settings)
    return reach, hand, scene, best
