"""Functions of grasp_core: a call of each that succeeds, and what they must refuse."""

import numpy as np

import grasp_core as gc
from tests.judges import TETRA_CENTERS, TETRA_NORMALS
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
    COUNT,
    FACE_INDICES,
    FRICTION,
    NOT_NEGATIVE,
    NOT_NUMBERS,
    POSITIVE,
    SEVERAL,
    SWITCH,
    VALUE,
    array,
    each_of,
    optional,
    spread,
    units,
)
from tests.public_values.call import Call, body, grasp, of_grasp, reading

WRENCH = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
CENTER = np.zeros(3)
CENTERED = array(CENTER) | {"far away": [1e40, 0.0, 0.0]}
TORSION = each_of(NOT_NUMBERS, "tiny") | {"negative": -0.01, "ten million km": 1e10}
MOTORS = optional(VALUE) | {"of three contacts": gc.Motors.of(np.eye(2, 9), 1.0)}
LEVERS = np.eye(2, 12)
PLANNED = {
    "families": SEVERAL | {"unknown": "nonsense", "numbers": (1, 2), "empty": ()},
    "theta_deg": optional(POSITIVE) | {"wider than friction": 80.0},
    "finger": optional(VALUE) | {"radius": 0.006},
    "edge_clearance_m": NOT_NEGATIVE | {"larger than the object": 1.0},
    "share_faces_m": optional(NOT_NEGATIVE) | {"larger than the object": 1.0},
}


def contacts(*, many=False):
    """What is refused of positions and normals."""
    points, normals = many_arrays().values() if many else (TETRA_CENTERS, TETRA_NORMALS)
    single = {"one contact": points[..., :1, :]}
    return {"positions": spread(points) | single, "normals": units(normals)}


def two_arrays(**more):
    return lambda: {"positions": TETRA_CENTERS, "normals": TETRA_NORMALS, **more}


def many_arrays():
    return {"positions": TETRA_CENTERS[None], "normals": TETRA_NORMALS[None]}


CALLS = [
    Call("gc.plan", lambda: {"body": body(), "limit": 1}, PLANNED | {
        "limit": optional(AT_LEAST_ONE),
        "complete": SWITCH,
    }),
    Call("gc.iter_grasps", lambda: {"body": body()}, PLANNED),
    Call("gc.save_grasps", lambda: {"path": "grasps.json", "plan": gc.plan(body(), limit=1)},
         succeeds_in="tests/grasp_core/records/test_grasps_files.py"),
    reading("gc.load_grasps", "no/such/grasps.json",
            "tests/grasp_core/records/test_grasps_files.py"),
    Call("gc.force_closure", two_arrays(friction=0.5), contacts() | {
        "friction": each_of(FRICTION, "zero", "tiny"), "torsion_m": TORSION,
    }),
    Call("gc.critical_friction", two_arrays(), contacts() | {"torsion_m": TORSION}),
    Call("gc.critical_friction_interval", two_arrays(), contacts()),
    Call("gc.critical_frictions", many_arrays, contacts(many=True)),
    Call("gc.contact_forces", two_arrays(friction=0.5, wrench=WRENCH), contacts() | {
        "friction": each_of(FRICTION, "zero"),
        "wrench": array(WRENCH),
        "normal_force": SEVERAL | {
            "one": (1.0,), "three": (0.0, 1.0, 2.0), "turned": (2.0, 1.0), "equal": (1.0, 1.0),
            "negative": (-1.0, 1.0), "not a number": (float("nan"), 1.0), "text": ("a", 1.0),
            "tiny": (0.0, 1e-300), "huge": (1e300, float("inf")), "zero": (0.0, 0.0),
        },
        "center": array(CENTER),
    }),
    Call("gc.classify_lines", lambda: {"points": TETRA_CENTERS, "directions": TETRA_NORMALS}, {
        "points": spread(TETRA_CENTERS),
        "directions": spread(TETRA_NORMALS) | {"zero": np.zeros((4, 3))},
    }),
    Call("gc.hull_volume", two_arrays(friction=0.5, torque_scale=1.0), contacts() | {
        "friction": each_of(FRICTION, "zero"), "center": CENTERED,
        "edges": COUNT | {"two": 2, "a million": 10**6},
    }),
    Call("gc.min_weight", two_arrays(friction=0.5), contacts() | {
        "friction": each_of(FRICTION, "zero"), "edges": COUNT | {"two": 2, "a million": 10**6},
    }),
    Call("gc.smallest_singular_value", lambda: {"positions": TETRA_CENTERS, "torque_scale": 1.0}, {
        "positions": spread(TETRA_CENTERS), "center": CENTERED,
    }),
    Call("gc.ferrari_canny", two_arrays(friction=0.5, torque_scale=1.0), contacts() | {
        "friction": each_of(FRICTION, "zero"), "center": CENTERED,
        "gap": POSITIVE | {"one": 1.0, "too fine": 1e-9},
        "torsion_m": TORSION,
    }),
    Call("gc.best_grasp", lambda: {"body": body(), "gap": 0.5, "time_limit_s": 0.0}, {
        "gap": POSITIVE | {"one": 1.0},
        "time_limit_s": optional(NOT_NEGATIVE),
        "wrenches": optional(array([WRENCH])) | {"without a task": [WRENCH]},
        "clearance": optional(NOT_NEGATIVE) | {"larger than the object": 1.0},
    }),
    Call("gc.quality_ceiling", lambda: {"body": body(), "faces": (0, 1, 2, 3), "parts": 3}, {
        "faces": FACE_INDICES,
        "known": NOT_NEGATIVE,
        "finger_radius": optional(each_of(NOT_NEGATIVE)) | {"larger than the object": 1.0},
        "gap": POSITIVE | {"one": 1.0},
        "parts": AT_LEAST_ONE,
    }),
    Call("gc.wrench_limits", two_arrays(friction=0.5, wrenches=WRENCH[None], max_normal_force=1.0),
         contacts() | {
        "friction": each_of(FRICTION, "zero"),
        "wrenches": array(WRENCH[None]) | {"zero": np.zeros((1, 6)), "tiny": 1e-300 * WRENCH[None]},
        "center": array(CENTER),
        "motors": MOTORS,
        "torsion_m": TORSION,
    }),
    Call("gc.Motors", lambda: {"levers": LEVERS, "limits": np.ones(2), "gravity": np.zeros(2)}, {
        "levers": array(LEVERS),
        "limits": array(np.ones(2)) | {"zero": np.zeros(2), "negative": -np.ones(2)},
        "gravity": array(np.zeros(2)) | {"more than the motors": np.array([0.0, 1.0])},
    }),
    Call("gc.Motors.in_any_orientation", lambda: {
        "levers": LEVERS, "limits": np.ones(2), "weights": 0.1 * np.ones((2, 3)),
    }, {
        "levers": array(LEVERS),
        "limits": each_of(POSITIVE),
        "weights": array(np.ones((2, 3))) | {"more than the motors": np.ones((2, 3))},
    }),
    Call("gc.cones_positively_span", lambda: {"axes": TETRA_NORMALS, "half_angles": [0.1] * 4}, {
        "axes": units(TETRA_NORMALS),
        "half_angles": array([0.1] * 4) | {"negative": [-0.1] * 4, "right angles": [2.0] * 4},
    }),
    Call("gc.span_angle", lambda: {"normals": TETRA_NORMALS}, {"normals": units(TETRA_NORMALS)}),
    Call("gc.optimize_contacts", of_grasp(), {
        "finger_radius": optional(POSITIVE) | {"larger than the object": 1.0},
    }),
    Call("gc.transfer", lambda: {"old": body(), "new": body(), "grasps": (grasp(),)}, {
        "old": VALUE,
        "new": VALUE,
        "grasps": SEVERAL,
        "distance": optional(NOT_NEGATIVE) | {"larger than the object": 1.0},
        "angle_deg": NOT_NEGATIVE | {"too wide": 46.0},
        "finger": optional(VALUE) | {"radius": 0.006},
    }),
    Call("gc.certify_regions", of_grasp(friction=0.5, max_cones=64), {
        "reserve": NOT_NEGATIVE | {"all": 1.0},
        "recenter": SWITCH,
        "clearance": NOT_NEGATIVE | {"larger than the object": 1.0},
        "max_cones": COUNT | {"few": 63},
    }),
]  # fmt: skip
