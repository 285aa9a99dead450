"""Functions about grasps as they are executed: a call of each, and what they must refuse."""

from functools import cache

import numpy as np

import grasp_core as gc
from grasp_core.forces.even_forces import even_forces
from tests.public_values.bad_values import (
    FRICTION,
    NOT_NEGATIVE,
    POSITIVE,
    SEVERAL,
    VALUE,
    WORD,
    array,
    each_of,
    optional,
    unless,
)
from tests.public_values.call import Call, body, grasp

WRENCH = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
GRAVITY = np.array([0.0, 0.0, -9.8])


def squeeze():
    return even_forces(grasp().positions, grasp().normals, 0.4)


@cache
def gripped():
    return gc.grip(body(), grasp(), 0.5, squeeze())


def held(**more):
    return lambda: {"body": body(), "contacts": grasp(), "friction": 0.5, **more}


ARGUMENTS = {
    "body": VALUE,
    "contacts": SEVERAL | {"one": grasp().contacts[:1]},
    "friction": each_of(FRICTION, "zero"),
    "stiffness": each_of(POSITIVE) | {"not symmetric": np.triu(np.ones((4, 3, 3)))},
    "tip_radius_m": each_of(NOT_NEGATIVE),
}

CALLS = [
    Call("gc.grip", lambda: held(squeeze=squeeze())(), ARGUMENTS | {
        "squeeze": array(np.zeros((4, 3))) | {"unbalanced": np.ones((4, 3))},
    }),
    Call("gc.first_slip", lambda: {"grip": gripped(), "wrench": WRENCH}, {
        "grip": VALUE,
        "wrench": array(WRENCH) | {"zero": 0.0 * WRENCH, "tiny": 1e-300 * WRENCH},
        "model": WORD,
        "max_push_n": unless(POSITIVE, "infinite", "huge") | {"less than at rest": 0.5},
    }),
    Call("gc.best_squeeze", held(loads=gc.any_direction(0.1)), ARGUMENTS | {
        "loads": VALUE,
        "max_push_n": optional(POSITIVE),
    }),
    Call("gc.payload", held(max_push_n=10.0), ARGUMENTS | {"max_push_n": POSITIVE}),
    Call("gc.any_direction", lambda: {"mass_kg": 1.0, "acceleration_m_per_s2": 1.0}, {
        "mass_kg": POSITIVE,
        "acceleration_m_per_s2": NOT_NEGATIVE,
        "gravity": optional(array(GRAVITY)),
    }),
    Call("gc.LoadSet", lambda: {"offset": WRENCH, "axes": np.eye(6)}, {
        "offset": array(WRENCH),
        "axes": array(np.eye(6)) | {"zero": np.zeros((6, 6)), "seven": np.ones((6, 7))},
    }),
]  # fmt: skip
