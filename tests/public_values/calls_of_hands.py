"""Functions about hands: a call of each, and what they must refuse."""

from dataclasses import replace

import numpy as np

import grasp_core as gc
from sim_validate.hands.trials import cube, hinged_hand, stance
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
    FRICTION,
    NOT_NEGATIVE,
    POSITIVE,
    SEVERAL,
    SWITCH,
    VALUE,
    WORD,
    array,
    each_of,
    optional,
    unless,
)
from tests.public_values.call import Call, body, grasp


def reaching():
    return {
        "hand": gc.load_hand("allegro"), "body": body(), "grasp": grasp(), "friction": 0.5,
        "starts": 1,
    }  # fmt: skip


def standing():
    return {"hand": hinged_hand(), "body": cube(), "reach": stance(0.5), "friction": 0.5}


def weighing():
    """The hand with links of ten grams."""
    hand = hinged_hand()
    fingers = tuple(
        replace(finger, links=tuple(
            replace(link, mass_kg=0.01, center_of_mass=np.zeros(3)) for link in finger.links
        ))
        for finger in hand.fingers
    )  # fmt: skip
    return replace(hand, fingers=fingers)


DOWN = optional(array([0.0, 0.0, -1.0])) | {"zero": [0.0, 0.0, 0.0]}


CALLS = [
    Call("gc.hand_motors", lambda: {"hand": hinged_hand(), "reach": stance(0.5)}, {
        "down": DOWN, "any_orientation": SWITCH,
    }),
    Call("gc.hand_payload", lambda: {
        "hand": weighing(), "body": cube(), "reach": stance(0.5), "friction": 0.5,
        "max_push_n": 10.0,
    }, {
        "friction": each_of(FRICTION, "zero"),
        "max_push_n": POSITIVE, "gap": POSITIVE | {"one": 1.0, "too fine": 1e-5},
    }),
    Call("scenes.build_hand_scene", standing, {"down": DOWN}),
    Call("sv.hand_setup", dict),
    Call("sv.validate_hand", standing, {"down": DOWN}),
    Call("sv.execute_hand", lambda: standing() | {"mass_kg": 0.1}, {
        "settings": optional(VALUE),
    }, succeeds_in="tests/sim_validate/hands/test_execute_hand.py"),
    Call("gc.load_hand", lambda: {"name": "leap"}, {"name": WORD}),
    Call("gc.reach_with", reaching, {
        "regions": SWITCH,
        "table_down": optional(array([0.0, 0.0, -1.0])) | {"zero": [0.0, 0.0, 0.0]},
        "clearance_m": NOT_NEGATIVE | {"large": 0.5},
        "starts": AT_LEAST_ONE | {"many": 10**6},
    }, slow=True),
    Call("scenes.load_hand", lambda: {"hand": "allegro"}, {
        "hand": WORD, "fingertips": unless(SEVERAL, "text") | {"for a built-in hand": ["tip"]},
    }),
]  # fmt: skip
