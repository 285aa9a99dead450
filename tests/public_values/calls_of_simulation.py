"""Scenes, trials and reports: a call of each that succeeds, and what they must refuse."""

import numpy as np

import scenes
import sim_validate as sv
from tests.public_values.bad_values import (
    AT_LEAST_ONE,
    COUNT,
    NOT_NEGATIVE,
    PATH,
    POSITIVE,
    SEVERAL,
    SWITCH,
    TEXT,
    VALUE,
    WORD,
    array,
    optional,
    unless,
)
from tests.public_values.call import WRENCH, Call, body, grasp, of_grasp, plan, reading, scene

CENTER = np.zeros(3)
IN_HAND = {"hand": optional(VALUE), "reach": optional(VALUE)}
CALLS = [
    Call("scenes.build_scene", of_grasp(), {
        "grasp": VALUE | {"contacts of objects": [object()] * 4, "empty": (), "one": "grasp"},
        "fingers": optional(VALUE) | {"too large": scenes.FingerSettings(fingertip_radius_m=1.0)},
        "surface": optional(WORD),
        "squeeze": optional(array(np.ones((4, 3)))) | {"of no push": np.zeros((4, 3))},
    }),
    Call("scenes.write_scene", lambda: {"scene": scene(), "path": "no/such/folder/a.xml"},
         succeeds_in="tests/scenes/mujoco/test_closure_scene.py"),
    Call("scenes.export_grasps", lambda: {"plan": plan(), "path": "no/such/a.glb", "to": "gltf"}, {
        "path": PATH | {"unknown ending": "a.obj", "no ending": "a"},
        "to": WORD,
        "fingertip_radius_m": optional(POSITIVE),
    }, succeeds_in="tests/scenes/test_exports.py"),
    Call("scenes.example_names", dict),
    Call("scenes.example_object", lambda: {"name": "box"}, {
        "name": TEXT | {
            "unknown": "bx", "empty": "", "long": "a" * 10**5, "few faces": "random-3-1",
            "other digits": "random-\u0662\u0660-7", "no seed": "random-20",
        },
    }),
    Call("scenes.grasp_figure", of_grasp(friction=0.5), {"legend": SWITCH, **IN_HAND}),
    Call("scenes.show", of_grasp(), IN_HAND),
    Call("scenes.write_picture", of_grasp(path="a.png"), {
        "path": PATH | {"unknown ending": "a.gif", "no ending": "a"},
        **IN_HAND,
    }, succeeds_in="tests/scenes/drawing/test_pictures.py"),
    Call("scenes.FingerSettings", dict, {
        "fingertip_radius_m": optional(POSITIVE),
        "fingertip_mass_kg": optional(POSITIVE) | {"a picogram": 1e-12, "a mountain": 1e12},
        "stiffness_n_per_m": optional(POSITIVE),
        "approach": optional(array([0.0, 0.0, 1.0])) | {"zero": (0.0, 0.0, 0.0)},
        "drive": WORD,
        "indentation": NOT_NEGATIVE | {"all": 1.0},
    }),
    Call("scenes.PhysicsSettings", dict, {
        "timestep": POSITIVE | {"a second": 1.0, "a microsecond": 1e-6},
        **dict.fromkeys(("integrator", "cone", "solver", "jacobian"), WORD),
        "impratio": POSITIVE,
        **{f"{kind}tolerance": NOT_NEGATIVE for kind in ("", "ls_", "noslip_", "ccd_", "sleep_")},
        **{f"{kind}iterations": AT_LEAST_ONE for kind in ("", "ls_", "ccd_", "sdf_")},
        "noslip_iterations": COUNT,
        "sdf_initpoints": AT_LEAST_ONE,
        **dict.fromkeys(("gravity", "wind", "magnetic"), array(CENTER)),
        **dict.fromkeys(("density", "viscosity", "margin", "gap"), NOT_NEGATIVE),
        "solref": array([0.004, 1.0]),
        "solimp": array([0.99, 0.99, 0.001, 0.5, 2.0]),
        "condim": AT_LEAST_ONE | {"two": 2, "seven": 7},
        "torsion_m": NOT_NEGATIVE | {"less than MuJoCo's least friction": 1e-6, "two metres": 2.0},
        "autoreset": SWITCH,
        "diagexact": SWITCH, "multiccd": SWITCH,
    }),
    Call("sv.judge_records", lambda: {
        "paths": ["no/such/file.npy"], "hand": "allegro", "objects": "no/such/folder",
    }, {
        "paths": SEVERAL, "hand": optional(PATH), "objects": PATH, "settings": optional(VALUE),
        "format": optional(WORD),
    }, succeeds_in="tests/sim_validate/judge/test_sets.py"),
    Call("sv.JudgeSettings", dict, {
        "touch_m": NOT_NEGATIVE, "push_n": POSITIVE, "mass_kg": POSITIVE, "trial": SWITCH,
        "tests": SEVERAL | {"unknown": ("nonsense",), "twice": ("dexonomy", "dexonomy")},
    }),
    Call("sv.load_dataset", lambda: {"folder": "no/such/folder"}, {
        "folder": PATH | {"nowhere": "no/such/folder"}, "split": optional(WORD),
    }, succeeds_in="tests/sim_validate/datasets/test_loading.py"),
    Call("sv.load_dataset_hand", lambda: {"folder": "no/such/folder"}, {
        "folder": PATH | {"nowhere": "no/such/folder"},
    }, succeeds_in="tests/sim_validate/datasets/test_hands.py"),
    reading("sv.load_regions", "no/such/file.npz", "tests/sim_validate/planning/test_regions.py"),
    reading("sv.load_executions", "no/such/executions.json",
            "tests/sim_validate/execution/test_executions.py"),
    reading("sv.load_verdicts", "no/such/verdicts.json",
            "tests/sim_validate/closure/test_verdict.py"),
    Call("sv.margin_figure", of_grasp(friction=0.5), {
    }, slow=True),
    Call("sv.wrench_figure", of_grasp(friction=0.5)),
    Call("sv.write_report", lambda: {"folder": "no/such/folder"}, {
        "folder": PATH | {"nowhere": "no/such/folder"},
        "out": optional(PATH),
        "jobs": optional(AT_LEAST_ONE),
        "limit": optional(AT_LEAST_ONE),
        "clips": COUNT,
        "progress": {"none": None, "number": 3, "text": "a"},
        "ready": {"none": None, "number": 3, "text": "a"},
    }, succeeds_in="tests/sim_validate/report/test_report.py"),
    Call("sv.validate", of_grasp(agenda=sv.Agenda(critical_friction=False, controls=False)),
         {
        "setup": optional(VALUE) | {"of another class": scenes.PhysicsSettings()},
    }, slow=True),
    Call("sv.validate_all", lambda: {
        "body": body(), "grasps": plan(),
        "agenda": sv.Agenda(critical_friction=False, controls=False),
    }, {
        "grasps": SEVERAL | {"a grasp": grasp(), "several plans": [plan()]},
        "setup": optional(VALUE) | {"of another class": scenes.PhysicsSettings()},
    }, slow=True),
    Call("sv.simulated_critical_friction", of_grasp(),
         slow=True),
    Call("sv.Agenda", dict, {
        "random_wrenches": COUNT,
        "wrenches": SEVERAL,
        **dict.fromkeys(("critical_friction", "controls", "keep_traces"), SWITCH),
        "limits": WORD,
        "repeats": COUNT,
        "noise": VALUE,
    }),
    Call("sv.HoldProtocol", dict, {
        **{f"{phase}_s": POSITIVE | {"a day": 86400.0}
           for phase in ("squeeze", "load", "settle", "hold")},
        **{f"{kind}_threshold": POSITIVE for kind in ("hold", "total", "gap")},
        "settling_friction": POSITIVE | {"less": 0.5},
        "load_share": POSITIVE | {"all": 1.0},
        "control_load": POSITIVE,
        "least_normal_share": POSITIVE | {"all": 1.0},
        "least_excess": POSITIVE,
    }),
    Call("sv.NamedWrench", lambda: {"name": "pull", "wrench": WRENCH}, {
        "name": TEXT | {"empty": "", "long": "a" * 101, "markup": "<b>"},
        "wrench": array(WRENCH) | {"zero": np.zeros(6), "tiny": 1e-300 * WRENCH},
    }),
    Call("sv.Noise", dict, dict.fromkeys(
        ("shift", "turn_deg", "normal_deg", "friction", "mass"), NOT_NEGATIVE,
    )),
    Call("sv.Setup", dict, {
        **dict.fromkeys(("fingers", "physics", "hold", "limit", "friction"), VALUE),
        "surface": optional(WORD),
        "timeout_s": unless(POSITIVE, "infinite", "tiny", "huge"),
    }),
]  # fmt: skip
