"""Grasps as they are executed, hands and published tests: a call of each, what they must refuse."""

from dataclasses import replace
from functools import cache

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.quality.contact_forces import even_forces
from sim_validate.hands.known_hand import cube, hinged_hand, stance
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
    FRICTION,
    MOTORS,
    NOT_NEGATIVE,
    PATH,
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
from tests.public_values.call import WRENCH, Call, body, fields_of, grasp

GRAVITY = np.array([0.0, 0.0, -9.8])


def squeeze():
    return even_forces(grasp().positions, grasp().normals, 0.4)


@cache
def gripped():
    return gc.grip(body(), grasp(), 0.5, squeeze())


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
CARRYING = gc.Motors.of(np.eye(2, 12), 1.0, 0.5)
ONE_TRIAL = sv.ExecutionSettings(0.1, trials=("weight",))
HELD = {
    "mass_kg": optional(POSITIVE),
    "density_kg_m3": optional(POSITIVE),
    "tip_mass_kg": POSITIVE,
    "damping_ratio": POSITIVE | {"a hundred": 100.0},
    "down": array(GRAVITY) | {"zero": (0.0, 0.0, 0.0), "minute": (1e-300, 0.0, 0.0)},
    "keep_defaults": SWITCH,
}


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


ROOT = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
NAME = unless(WORD, "list") | {"list": ["dexgraspbench"]}
QPOS = array([*ROOT, 0.1]) | {"no turn": np.zeros(8)}


def record():
    return sv.dex_record(hinged_hand(), stance(0.5), "object")


def recorded():
    qpos = [*ROOT, 0.1]
    return {"object_path": "object", "object_scale": 1.0, "object_pose": ROOT, "pregrasp": qpos,
            "grasp": qpos, "squeeze": qpos}  # fmt: skip


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
        "off_by": WORD,
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
        "settings": optional(VALUE),
        "physics": optional(VALUE) | {"other gravity": tilted()},
    }),
    Call("gc.hand_motors", lambda: {"hand": hinged_hand(), "reach": stance(0.5)}, {
        "any_orientation": SWITCH,
    }),
    Call("gc.hand_payload", lambda: {
        "hand": weighing(), "body": cube(), "reach": stance(0.5), "friction": 0.5,
        "max_push_n": 10.0,
    }, {
        "friction": each_of(FRICTION, "zero"),
        "max_push_n": POSITIVE, "gap": POSITIVE | {"one": 1.0, "too fine": 1e-5},
    }),
    Call("scenes.build_hand_scene", standing),
    Call("sv.hand_setup", dict),
    Call("sv.validate_hand", standing),
    Call("sv.execute_hand", standing, {"settings": optional(VALUE)},
         succeeds_in="tests/sim_validate/hands/test_execute.py"),
    Call("sv.hand_execution_settings", dict, {
        "mass_kg": optional(POSITIVE), "density_kg_m3": optional(POSITIVE),
    }),
    Call("gc.load_hand", lambda: {"name": "leap"}, {"name": WORD}),
    Call("gc.reach_with", reaching, {
        "settings": optional(VALUE),
    }, slow=True),
    Call("gc.ReachSettings", dict, {
        "regions": SWITCH,
        "table_down": optional(array([0.0, 0.0, -1.0])) | {"zero": [0.0, 0.0, 0.0]},
        "clearance_m": NOT_NEGATIVE | {"large": 0.5},
        "starts": AT_LEAST_ONE | {"many": 10**6},
    }),
    Call("scenes.hand_from_file", lambda: {"path": "no/such.xml", "fingertips": ("a", "b", "c")}, {
        "path": PATH, "fingertips": unless(SEVERAL, "text"),
    }, succeeds_in="tests/scenes/hand_files/test_building.py"),
    Call("sv.protocol_names", dict),
    Call("sv.protocol", lambda: {"name": "dexonomy"}, {"name": NAME}),
    Call("sv.judge_by", lambda: {
        "protocol": "dexonomy", "body": body(), "grasp": grasp(), "friction": 0.5,
    }, {"protocol": NAME, "grasp": SEVERAL}),
    Call("sv.judge_hand_by", lambda: {
        "protocol": "dexonomy", "hand": hinged_hand(), "body": cube(), "reach": stance(0.5),
        "friction": 0.5,
    }, {"protocol": NAME}),
    Call("sv.DexRecord", recorded, {
        "object_scale": POSITIVE,
        "object_pose": array(ROOT) | {"no turn": np.zeros(7)},
        **dict.fromkeys(("pregrasp", "grasp", "squeeze"), QPOS),
    }),
    Call("sv.dex_record", lambda: {
        "hand": hinged_hand(), "reach": stance(0.5), "object_path": "object",
    }, {
        "servo_n_m_per_rad": optional(POSITIVE), "gap_m": optional(POSITIVE),
    }),
    Call("sv.write_dex_record", lambda: {"record": record(), "path": "no/such/0.npy"},
         succeeds_in="tests/sim_validate/hands/test_dexgraspbench.py"),
    Call("sv.write_dex_object", lambda: {"body": body(), "folder": "no/such"}, {
        "folder": PATH,
    }, succeeds_in="tests/sim_validate/hands/test_dexgraspbench.py"),
]  # fmt: skip
