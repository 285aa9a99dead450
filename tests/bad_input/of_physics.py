"""Group 6: numbers of physics that nothing in the world has, as flags and in files."""

from grasp_core.allowed_values import LARGEST_FRICTION, MOST_EDGES, MOST_SEED
from tests.bad_input.cases import Case, refused
from tests.bad_input.good_files import changed, good

NUMBERS = ("nan", "inf", "-1", "wide")
FLAGS = {
    "plan box --friction": (*NUMBERS, "0", "1e9", "1e-300", f"{LARGEST_FRICTION + 1.0}"),
    "execute no.json --mass-kg": ("-1", "1e300"),
    "execute no.json --misplacements": ("1001",),
    "analyze no.json --edges": (f"{MOST_EDGES + 1}",),
    "export no.json --to gltf -o a.glb --limit": ("0",),
    "plan box --theta-deg": (*NUMBERS, "0"),
    "plan box --limit": ("0", "-1", "1.5", "many", "99999999999"),
    "plan box --seed": ("-1", f"{MOST_SEED + 1}", "0.5"),
    "plan box --patches.depth": (*NUMBERS, "0", "2"),
    "run box --fingertip-mass-kg": (*NUMBERS, "0", "1e-12", "1e12"),
    "run box --repeats 2 --noise.friction": (*NUMBERS, "9"),
    "run box --jobs": ("0", "-1", "1.5"),
}
"""Each value is to be refused, and the flag named; that every number of every command has bounds is
asked by `tests/public_values/test_flags.py`."""
VECTORS = {
    "run box --approach 0 0 0": "--approach|zero",
    "run box --approach nan 0 0": "--approach",
    "run box --weight-n 1 --weight-down 0 0 0": "--weight-down",
    "run box --weight-down 0 0 1": "--weight-n",
    "run box --center-of-mass-m 0 0 0": "built-in",
    "analyze contacts.json --wrench 0 0 0 0 0 0": "--wrench|zero",
    "analyze contacts.json --wrench nan 0 0 0 0 0": "--wrench",
    "analyze contacts.json --wrench 1e14 0 0 0 0 0": "--wrench",
    "analyze contacts.json --wrench 1 0 0": "--wrench",
    "analyze contacts.json --edges 2": "--edges",
    "run box --noise.mass 0.1": "--repeats",
    "plan box --families spiral": "--families|concurrent",
    "plan box --unit furlong": "--unit|mm",
    "plan box --frictoin 0.5": "friction",
    "fly box": "plan|validate",
    "plan": "object",
}
SETUP = {
    "[physics]\ntimestep_s = 0.0": "timestep_s",
    "[physics]\ntimestep_s = nan": "timestep_s",
    "[physics]\ntimestep_s = 1.0": "timestep_s",
    "[physics]\ntimestep_s = -1e-3": "timestep_s",
    "[physics]\ngravity = nan": "gravity",
    "[fingers]\nfingertip_radius_m = 0.0": "radius_m",
    "[fingers]\nfingertip_mass_kg = 1e-300": "mass_kg",
    "[hold]\nhold_s = 0.0": "hold_s",
    "[hold]\nhold_s = 86400.0": "hold_s",
    "[hold]\nhold_s = inf": "hold_s",
    "[hold]\nload_share = 2.0": "load_share",
    "[hold]\nload_share = -1.0": "load_share",
}
WRENCHES = {
    "nan": ('{"wrenches": [{"name": "a", "force_n": [NaN, 0, 0]}]}', "force_n"),
    "1e999": ('{"wrenches": [{"name": "a", "force_n": [1e999, 0, 0]}]}', "force_n"),
    "1e14": ('{"wrenches": [{"name": "a", "force_n": [1e14, 0, 0]}]}', "a"),
    "nothing": ('{"wrenches": [{"name": "a", "force_n": [0, 0, 0]}]}', "a"),
    "two numbers": ('{"wrenches": [{"name": "a", "force_n": [0, 0]}]}', "force_n"),
    "no name": ('{"wrenches": [{"force_n": [0, 0, 1]}]}', "name"),
    "no wrenches": ('{"wrenches": []}', "wrenches"),
    "a name twice": (
        '{"wrenches": [{"name": "a", "force_n": [0, 0, 1]}, {"name": "a", "force_n": [1, 0, 0]}]}',
        "a"),
}  # fmt: skip
CONTACT = "grasps.0.contacts.0."
GRASPS = {
    "friction 0": ("friction", 0, "friction"),
    "friction -1": ("friction", -1, "friction"),
    "friction 1e9": ("friction", 1e9, "friction"),
    "friction null": ("friction", None, "friction"),
    "friction in words": ("friction", "0.5", "friction"),
    "seed -1": ("seed", -1, "seed"),
    "seed 2^64": ("seed", 2**64, "seed"),
    "a contact off its face": (CONTACT + "position_m", [0.0, 0.0, 0.0], "contact"),
    "a contact far away": (CONTACT + "position_m", [9.0, 0.0, 0.0], "contact"),
    "a contact at 1e300": (CONTACT + "position_m", [1e300, 0.0, 0.0], "grasps[0]|position"),
    "a contact of two numbers": (CONTACT + "position_m", [0.0, 0.0], "position_m"),
    "a normal of no length": (CONTACT + "normal", [0.0, 0.0, 0.0], "normal"),
    "a normal of length 2": (CONTACT + "normal", [0.0, 0.0, 2.0], "normal"),
    "a normal that looks away": (CONTACT + "normal", [0.0, 0.0, -1.0], "normal"),
    "a face that is not there": ("grasps.0.faces", [0, 1, 2, 99], "face"),
    "a face twice": ("grasps.0.faces", [0, 0, 1, 2], "face"),
    "three faces": ("grasps.0.faces", [0, 1, 2], "faces"),
    "forces that do not balance": ("grasps.0.witness.forces.0", [9.0, 9.0, 9.0], "witness"),
    "a radius of -1": ("grasps.0.radius_m", -1.0, "grasps[0]|radius"),
    "a mesh of one point": ("object.mesh.vertices_m", [[0, 0, 0]], "mesh"),
    "a mesh with another corner": ("object.mesh.vertices_m.0", [0.05, 0.03, 0.06], "object"),
    "a hash of another object": ("object.content_sha256", "0" * 64, "content_sha256"),
    "a family that is none": ("grasps.0.family", "spiral", "family"),
    "a finger of no size": ("finger", {"radius_m": 0, "approach_m": 0.1}, "radius_m"),
}
CASES = [
    Case(f"{line} {value}", f"{line} {value}", line.split()[-1], 2)
    for line, values in FLAGS.items()
    for value in values
]
CASES += [Case(line, line, says, 4 if "built-in" in says else 2) for line, says in VECTORS.items()]
CASES += [
    refused(f"setup: {text!r}", "setup.toml", text, says, "validate good.json --setup")
    for text, says in SETUP.items()
]
CASES += [
    refused(f"wrenches: {name}", "task.json", text, says, "validate good.json --wrenches")
    for name, (text, says) in WRENCHES.items()
]
CASES += [
    refused(f"grasps: {name}", "grasps.json", changed(good("grasps.json"), path, value), says,
            "validate")
    for name, (path, value, says) in GRASPS.items()
]  # fmt: skip
