"""Values of grasp_core and where they come from: a call of each, and what they must refuse."""

import numpy as np

import grasp_core as gc
from tests.judges import TETRA_CENTERS, TETRA_NORMALS
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
    COUNT,
    FACE_INDICES,
    NOT_NEGATIVE,
    NOT_NUMBERS,
    POSITIVE,
    SEVERAL,
    SWITCH,
    TEXT,
    VALUE,
    WORD,
    array,
    optional,
    spread,
    units,
    unless,
)
from tests.public_values.call import Call, body, fields_of, grasp, mesh_file

CENTER = np.zeros(3)


def mesh():
    return {"vertices": body().vertices, "triangles": body().triangles}


CALLS = [
    Call("gc.load_polyhedron", lambda: {"path": mesh_file()}, {
        "unit": WORD,
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
