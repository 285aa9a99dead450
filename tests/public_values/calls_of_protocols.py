"""Functions about published tests and other tools' files: a call of each, what they must refuse."""

import numpy as np

import grasp_core as gc
import sim_validate as sv
from sim_validate.hands.trials import cube, hinged_hand, stance
from tests.public_values.bad_values import (
    NOT_NEGATIVE,
    PATH,
    POSITIVE,
    SEVERAL,
    VALUE,
    WORD,
    array,
    optional,
    unless,
)
from tests.public_values.call import Call, body, grasp, reading

ROOT = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
NAME = unless(WORD, "list") | {"list": ["dexgraspbench"]}
POSE = array(np.eye(4)) | {"scaled": 2.0 * np.eye(4), "mirrored": np.diag([-1.0, 1.0, 1.0, 1.0])}
QPOS = array([*ROOT, 0.1]) | {"no turn": np.zeros(8)}


def record():
    return sv.dex_record(hinged_hand(), stance(0.5), "object")


def recorded():
    qpos = [*ROOT, 0.1]
    return {"object_path": "object", "object_scale": 1.0, "object_pose": ROOT, "pregrasp": qpos,
            "grasp": qpos, "squeeze": qpos}  # fmt: skip


CALLS = [
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
        "push_n": POSITIVE,
        "servo_n_m_per_rad": optional(POSITIVE), "gap_m": optional(POSITIVE),
    }),
    Call("sv.reach_of_record", lambda: {
        "record": record(), "hand": hinged_hand(), "body": cube(), "friction": 0.5,
    }, {
        "hand": VALUE | {"another": gc.load_hand("leap")},
        "touch_m": NOT_NEGATIVE,
    }),
    reading("sv.load_dex_record", "no/such/0.npy",
            "tests/sim_validate/hands/test_dexgraspbench.py"),
    Call("sv.write_dex_record", lambda: {"record": record(), "path": "no/such/0.npy"},
         succeeds_in="tests/sim_validate/hands/test_dexgraspbench.py"),
    Call("sv.write_dex_object", lambda: {"body": body(), "folder": "no/such"}, {
        "folder": PATH,
    }, succeeds_in="tests/sim_validate/hands/test_dexgraspbench.py"),
]  # fmt: skip
