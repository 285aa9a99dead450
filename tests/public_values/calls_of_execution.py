"""Functions about grasps as they are executed: a call of each, and what they must refuse."""

from functools import cache

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.forces.contact_forces import even_forces
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
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
from tests.public_values.call import Call, body, fields_of, grasp

WRENCH = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
GRAVITY = np.array([0.0, 0.0, -9.8])


def squeeze():
    return even_forces(grasp().positions, grasp().normals, 0.4)


@cache
def gripped():
    return gc.grip(body(), grasp(), 0.5, squeeze())


@cache
def held_scene():
    return scenes.build_held_scene(body(), gripped(), scenes.HeldSettings(mass_kg=0.1))


def tilted():
    return scenes.PhysicsSettings(gravity=(1.0, 0.0, 0.0))


def held(**more):
    return lambda: {"body": body(), "contacts": grasp(), "friction": 0.5, **more}


ARGUMENTS = {
    "contacts": SEVERAL | {"one": grasp().contacts[:1]},
    "friction": each_of(FRICTION, "zero"),
    "stiffness": each_of(POSITIVE) | {"not symmetric": np.triu(np.ones((4, 3, 3)))},
    "tip_radius_m": each_of(NOT_NEGATIVE),
}
MOTORS = optional(VALUE) | {"of three contacts": gc.Motors.of(np.eye(2, 9), 1.0)}
CARRYING = gc.Motors.of(np.eye(2, 12), 1.0, 0.5)
ONE_TRIAL = sv.ExecutionSettings(0.1, trials=("weight",))
HELD = {
    "mass_kg": optional(POSITIVE),
    "density_kg_m3": optional(POSITIVE),
    "tip_mass_kg": POSITIVE,
    "damping_ratio": POSITIVE | {"a hundred": 100.0},
    "down": array(GRAVITY) | {"zero": (0.0, 0.0, 0.0), "minute": (1e-300, 0.0, 0.0)},
}

CALLS = [
    Call("gc.grip", lambda: held(squeeze=squeeze())(), ARGUMENTS | {
        "squeeze": array(np.zeros((4, 3))) | {"unbalanced": np.ones((4, 3))},
    }),
    Call("gc.first_slip", lambda: {"grip": gripped(), "wrench": WRENCH}, {
        "wrench": array(WRENCH) | {"zero": 0.0 * WRENCH, "tiny": 1e-300 * WRENCH},
        "model": WORD,
        "max_push_n": unless(POSITIVE, "infinite", "huge") | {"less than at rest": 0.5},
        "motors": MOTORS | {"too weak at rest": gc.Motors.of(squeeze().reshape(1, -1), 1e-6)},
    }),
    Call("gc.best_squeeze", held(loads=gc.any_direction(0.1)), ARGUMENTS | {
        "loads": VALUE,
        "max_push_n": optional(POSITIVE),
        "motors": MOTORS,
    }),
    Call("gc.payload", held(max_push_n=10.0), ARGUMENTS | {
        "max_push_n": POSITIVE,
        "motors": MOTORS | {"that carry links": CARRYING},
    }),
    Call("gc.any_direction", lambda: {"mass_kg": 1.0, "acceleration_m_per_s2": 1.0}, {
        "acceleration_m_per_s2": NOT_NEGATIVE,
        "gravity": optional(array(GRAVITY)),
    }),
    Call("gc.LoadSet", lambda: {"offset": WRENCH, "axes": np.eye(6)}, {
        "offset": array(WRENCH),
        "axes": array(np.eye(6)) | {"zero": np.zeros((6, 6)), "seven": np.ones((6, 7))},
    }),
    Call("scenes.HeldSettings", dict, HELD),
    Call("scenes.build_held_scene", lambda: {"body": body(), "grip": gripped(),
        "settings": scenes.HeldSettings(mass_kg=0.1),
    }, {
        "settings": VALUE,
        "physics": optional(VALUE) | {"other gravity": tilted()},
        "reach_m": optional(POSITIVE),
    }),
    Call("sv.ExecutionSettings", lambda: fields_of(sv.ExecutionSettings, ONE_TRIAL), HELD | {
        "push_n": POSITIVE,
        "tip_stiffness_n_per_m": POSITIVE,
        "tip_radius_m": optional(POSITIVE),
        "trials": SEVERAL | {"none of them": (), "unknown": ("lift", "throw"), "one": "lift"},
        "lift_m": POSITIVE,
        "lift_s": POSITIVE | {"a millisecond": 1e-3, "an hour": 3600.0},
        "shake_g": NOT_NEGATIVE,
        "shake_hz": POSITIVE | {"a minute's cycle": 1.0 / 60.0, "two samples": 100.0},
        "stop_m_per_s2": POSITIVE | {"for ages": 1e-6},
        "stop_from_m_per_s": POSITIVE | {"for ages": 1e6},
        "knock_n_s": optional(NOT_NEGATIVE),
        "off_mm": NOT_NEGATIVE,
        "off_deg": NOT_NEGATIVE | {"a whole turn": 360.0},
        "misplacements": AT_LEAST_ONE,
        "max_mm": POSITIVE,
        "max_deg": POSITIVE,
    }),
    Call("sv.execute", lambda: {
        "body": body(), "grasp": grasp(), "friction": 0.5, "settings": ONE_TRIAL,
    }, {
        "grasp": SEVERAL | {"one": grasp().contacts[:1]},
        "friction": each_of(FRICTION, "zero"),
        "settings": VALUE,
        "mass_kg": optional(POSITIVE),
        "physics": optional(VALUE) | {"other gravity": tilted()},
    }),
]  # fmt: skip
