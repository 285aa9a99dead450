"""Functions about hands: a call of each, and what they must refuse."""

import grasp_core as gc
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
    FRICTION,
    NOT_NEGATIVE,
    SEED,
    SEVERAL,
    SWITCH,
    VALUE,
    WORD,
    array,
    optional,
    unless,
)
from tests.public_values.call import Call, body, grasp


def reaching():
    return {
        "hand": gc.load_hand("allegro"), "body": body(), "grasp": grasp(), "friction": 0.5,
        "starts": 1,
    }  # fmt: skip


CALLS = [
    Call("gc.load_hand", lambda: {"name": "leap"}, {"name": WORD}),
    Call("gc.reach_with", reaching, {
        "hand": VALUE,
        "body": VALUE,
        "grasp": VALUE,
        "friction": FRICTION,
        "seed": SEED,
        "regions": SWITCH,
        "table_down": optional(array([0.0, 0.0, -1.0])) | {"zero": [0.0, 0.0, 0.0]},
        "clearance_m": NOT_NEGATIVE | {"large": 0.5},
        "starts": AT_LEAST_ONE | {"many": 10**6},
    }, slow=True),
    Call("scenes.load_hand", lambda: {"hand": "allegro"}, {
        "hand": WORD, "fingertips": unless(SEVERAL, "text") | {"for a built-in hand": ["tip"]},
    }),
]  # fmt: skip
