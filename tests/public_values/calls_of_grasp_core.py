"""Functions and values of grasp_core: a call of each that succeeds, and what they must refuse."""

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
    TEXT,
    VALUE,
    WORD,
    array,
    each_of,
    optional,
    spread,
    units,
    unless,
)
from tests.public_values.call import (
    WRENCH,
    Call,
    body,
    fields_of,
    grasp,
    mesh_file,
    of_grasp,
    reading,
)

CENTER = np.zeros(3)
CENTERED = array(CENTER) | {"far away": [1e40, 0.0, 0.0]}
LEVERS = np.eye(2, 12)
FAMILIES = SEVERAL | {"unknown": "nonsense", "numbers": (1, 2), "empty": ()}
PLANNED = {
    "friction": optional(FRICTION),
    "families": optional(FAMILIES),
    "finger": optional(VALUE) | {"radius": 0.006},
    "settings": optional(VALUE)
    | {
        "wider than friction": gc.PlanSettings(theta_deg=80.0),
        "cut back too far": gc.PlanSettings(edge_clearance_m=1.0),
        "too far apart": gc.PlanSettings(share_faces_m=1.0),
    },
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


def mesh():
    return {"vertices": body().vertices, "triangles": body().triangles}


CALLS = [
    Call("gc.plan", lambda: {"body": body(), "limit": 1}, PLANNED | {
        "limit": optional(AT_LEAST_ONE), "rank_by": optional(WORD),
    }),
    Call("gc.PlanSettings", dict, {
        "families": FAMILIES,
        "theta_deg": optional(POSITIVE),
        "limit": optional(AT_LEAST_ONE),
        "complete": SWITCH,
        "edge_clearance_m": NOT_NEGATIVE,
        "share_faces_m": optional(NOT_NEGATIVE),
        "time_limit_s": optional(NOT_NEGATIVE),
    }),
    Call("gc.iter_grasps", lambda: {"body": body()}, PLANNED),
    Call("gc.save_grasps", lambda: {"path": "grasps.json", "plan": gc.plan(body(), limit=1)},
         succeeds_in="tests/grasp_core/planning/test_grasps_files.py"),
    reading("gc.load_grasps", "no/such/grasps.json",
            "tests/grasp_core/planning/test_grasps_files.py"),
    Call("gc.force_closure", two_arrays(friction=0.5), contacts() | {
        "friction": each_of(FRICTION, "zero", "tiny"),
    }),
    Call("gc.critical_friction", two_arrays(), contacts()),
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
    Call("gc.placement_probability", of_grasp(friction=0.5, max_cones=64, pose_sigma_m=1e-3), {
        "pose_sigma_m": NOT_NEGATIVE | {"two": [1e-3, 1e-3]},
        "pose_sigma_rad": NOT_NEGATIVE,
        "pose_covariance": optional(array(np.eye(6))) | {"negative": -np.eye(6)},
        "contact_sigma_m": NOT_NEGATIVE,
        "max_cones": COUNT | {"few": 63},
    }),
    Call("gc.Misplacement", lambda: {"covariance": np.eye(6), "contact_sigma": 0.0,
                                     "friction": 0.5, "friction_sigma": 0.0}, {
        "covariance": array(np.eye(6)) | {"negative": -np.eye(6)},
        "contact_sigma": NOT_NEGATIVE,
        "friction": POSITIVE,
        "friction_sigma": NOT_NEGATIVE,
    }),
    Call("gc.load_polyhedron", lambda: {"path": mesh_file()}, {
        "unit": unless(WORD, "none"),
        "scale": POSITIVE,
        "faces": WORD,
        "center_of_mass": unless(array(CENTER), "none") | {"far away": [1.0, 0.0, 0.0]},
        "limits": VALUE,
    }),
    Call("gc.MeshLimits", dict, {
        "max_mesh_bytes": AT_LEAST_ONE,
        "max_triangles": AT_LEAST_ONE,
        "max_faces": AT_LEAST_ONE,
        "max_parts": AT_LEAST_ONE,
    }),
    Call("gc.Polyhedron.from_mesh", mesh, {
        "vertices": spread(body().vertices) | {"of one place": np.zeros((4, 3))},
        "triangles": unless(array(body().triangles)) | {
            "fractions": body().triangles + 0.5, "negative": body().triangles - 1,
            "beyond": body().triangles + 1,
        },
        "faces": WORD,
        "center_of_mass": unless(array(CENTER), "none") | {"far away": [1.0, 0.0, 0.0]},
    }),
    Call("gc.Contact", lambda: {"position": CENTER, "normal": [0.0, 0.0, 1.0]}, {
        "position": array(CENTER), "normal": units([0.0, 0.0, 1.0]),
    }),
    Call("gc.ContactRegion", lambda: fields_of(gc.ContactRegion, grasp().regions[0]), {
        "kind": WORD, "polygon": array(np.eye(3)), "inscribed_radius": NOT_NEGATIVE,
    }),
    Call("gc.Face", lambda: fields_of(gc.Face, body().faces[0]), {
        "normal": units([0.0, 0.0, 1.0]),
        "centroid": array(CENTER),
        "area": unless(POSITIVE, "tiny", "huge"),
        "polygon": array(np.eye(3)),
        "holes": SEVERAL,
        "pieces": SEVERAL,
        "spread": NOT_NEGATIVE | {"right angle": 2.0},
        "depth": unless(NOT_NEGATIVE, "huge"),
        "facets": {"text": "a", "negative": [-1], "fraction": [0.5], "huge": [1e30], "none": None},
    }),
    Call("gc.Finger", lambda: {"radius_m": 0.01, "approach_m": 0.1}, {
        "radius_m": POSITIVE, "approach_m": POSITIVE,
    }),
    Call("gc.ForceCone", lambda: {"axis": [0.0, 0.0, 1.0], "half_angle": 0.1}, {
        "axis": units([0.0, 0.0, 1.0]), "half_angle": NOT_NEGATIVE | {"right angle": 2.0},
    }),
    Call("gc.Grasp", lambda: fields_of(gc.Grasp, grasp()), {
        "id": TEXT,
        "family": WORD,
        "faces": unless(FACE_INDICES, "beyond"),
        "contacts": SEVERAL,
        "focus_points": array(np.zeros((1, 3))),
        "force_cones": SEVERAL,
        "regions": SEVERAL,
        "radius": unless(NOT_NEGATIVE, "huge"),
        "span_angle": NOT_NEGATIVE,
        "critical_friction": unless(NOT_NEGATIVE, "infinite", "huge"),
        "closure_margin": unless(NOT_NUMBERS, "huge"),
        "ferrari_canny": SEVERAL | {"one": (1.0,), "turned": (2.0, 1.0)},
        "witness": VALUE,
        "approach_directions": optional(units(TETRA_NORMALS)),
    }),
    Call("gc.PatchLimits", dict, {
        "spread_deg": unless(POSITIVE, "tiny") | {"wide": 60.0},
        "depth": unless(POSITIVE, "tiny") | {"all": 1.0},
        "most": AT_LEAST_ONE | {"three": 3, "many": 201},
    }),
    Call("gc.Surface", dict, {
        "closed": SWITCH,
        "caps": SEVERAL | {"negative": [-1], "fraction": [0.5], "wide": [[1]]},
        "holes": COUNT,
        "largest_hole_m": NOT_NEGATIVE,
        "volume_error": NOT_NEGATIVE,
        "dropped": NOT_NEGATIVE | {"more than all": 1.5},
        "flatness_m": NOT_NEGATIVE,
        "center_given": SWITCH,
        "repairs": SEVERAL,
    }),
    Call("gc.Polyhedron", lambda: fields_of(gc.Polyhedron, body()), {
        "vertices": array(body().vertices),
        "triangles": array(body().triangles) | {"beyond": [[0, 1, 9]]},
        "faces": SEVERAL,
        "volume": unless(POSITIVE, "tiny", "huge"),
        "center_of_mass": array(CENTER),
        "inertia": array(np.eye(3)),
        "content_sha256": TEXT,
        "source_sha256": TEXT,
        "surface": VALUE,
        "notes": SEVERAL,
    }),
    Call("gc.Witness", lambda: {"points": TETRA_CENTERS, "forces": TETRA_NORMALS}, {
        "points": array(TETRA_CENTERS), "forces": array(TETRA_NORMALS),
    }),
]  # fmt: skip
