"""Sentences in the README.md of a dataset: what its rows are, how they were made, their limits."""

from collections.abc import Mapping

from sim_validate.datasets.columns import Name
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.object_rows import SPLITS

KEYWORDS = (
    "robotics", "grasping", "force-closure", "multi-finger grasps", "contact mechanics",
    "simulation", "mujoco", "synthetic", "negative examples",
)  # fmt: skip
ROWS: Mapping[Name, str] = {
    "objects": "an object; its mesh, in metres, is `meshes/OBJECT_ID.obj`",
    "grasps": "four contacts on an object at one friction, or a negative control made from them",
    "trials": "a grasp or control under one wrench, in simulation",
    "executions": "a grasp in one trial of its execution, in simulation",
}
"""Meaning of one row of each table."""
LABELS: Mapping[str, str] = {
    "grasp": "a planned grasp, proved to be in force closure",
    "given": "contacts from another source, moved onto the object and judged",
    "varied": "a grasp at another friction or mass, or with contacts moved; it may hold or not",
    "low_friction": "the contacts of a grasp, tried at a friction below its critical friction",
    "fingers_removed": "only three or two of a grasp's contacts",
    "normal_flipped": "a grasp with one finger that pulls where it should push",
    "contacts_moved": "contacts moved on their faces out of force closure",
    "uncorrected": "contacts that the paper's construction as printed wrongly gives on these faces",
}
"""Meanings of the values of the column `label`."""
PLANNED = (
    "Grasps are planned for each object at each friction, for each family of grasps by itself. "
    "Every grasp has a certificate of force closure."
)
JUDGED = (
    "The contacts come from another source, in `contacts.json`. They are moved to the nearest "
    "faces of their object; `moved_m` says how far. Each set is proved to be in force closure or "
    "proved not to be. Sets with a contact near no face are `not_tried`; their `note` says why."
)
TRIED = (
    "Then each grasp is simulated in MuJoCo: four spherical fingertips squeeze the object, which "
    "is loaded with the wrenches in `trials`. Negative controls and all contact sets proved not "
    "to be in force closure are loaded with a wrench that they cannot resist."
)
EXECUTED = (
    "Grasps are also executed, again in MuJoCo: fingertips on springs hold the object, which has "
    "its mass {mass}, with one squeeze that is chosen beforehand and never replanned, through the "
    "trials {trials}. A grasp whose `survived` is false is a natural negative: it is proved to be "
    "in force closure, but loses the object when it is executed, or no squeeze within the "
    "fingers' strength carries the weight (then `executed` is false, too). `load_multiple` and "
    "`predicted_first_slip` are what the analysis said before."
)
CONVENTIONS = (
    "Units are SI, and names of columns end in them. Positions, normals and wrenches are in the "
    "object's own frame, the frame of its mesh. Normals have length one and point into the "
    "object. A wrench is force, then torque about the centre of mass, applied to the object. "
    "Friction is the Coulomb coefficient. Numbers are float64. A value that could not be measured "
    "is null, and so are the last contacts of a set of fewer than four."
)
RIGID = "Objects and fingertips are rigid, loads quasi-static; nothing was tried on a real robot."
MASSES = (
    "Masses in simulation are not the objects', but chosen so that similar grasps behave alike."
)
LIMITS = (
    RIGID,
    "Friction is Coulomb's, the same at all contacts; fingertips are hard spheres without "
    "torsional friction.",
    "There is no hand: it was not checked whether fingers can reach the contacts.",
    MASSES,
    "Grasps on curved objects are searched on nearly flat patches only, not between them.",
)
WITH_EXECUTIONS = {
    RIGID: "Objects and fingertips are rigid, and loads in `trials` are quasi-static; nothing was "
    "tried on a real robot.",
    MASSES: "Masses in `trials` are not the objects', but chosen so that similar grasps behave "
    "alike; those in `executions` are in `mass_kg`.",
}
"""Statements on limits that read otherwise where grasps are executed."""
SOURCES = (
    "Objects are made from meshes whose own licences hold for `meshes/` and all that is derived "
    "from them; they are not recorded here, so whoever publishes the dataset has to state them."
)


def summary(config: DatasetConfig, manifest: Manifest) -> str:
    """Say in a few sentences what the dataset holds, without a user's words."""
    rows = manifest.rows()
    executed = (
        f" Grasps were executed in {rows['executions']} further trials." if config.execution else ""
    )
    frictions = ", ".join(f"{friction:g}" for friction in config.frictions)
    return (
        f"Four-finger grasps of {rows['objects']} objects at friction {frictions}: "
        f"{rows['grasps']} contact sets, which are grasps proved to be in force closure and "
        f"negative controls proved not to be, and {rows['trials']} trials of them in simulation."
        f"{executed}"
    )


def made(config: DatasetConfig) -> str:
    """Say how the grasps of the dataset were made."""
    made = f"{JUDGED if config.contacts else PLANNED} {TRIED}"
    asked = config.execution
    if asked is None:
        return made
    density, mass_kg = asked.density_kg_m3, asked.settings.mass_kg
    mass = f"of {mass_kg:g} kg" if density is None else f"at {density:g} kg/m3"
    return f"{made} {EXECUTED.format(mass=mass, trials=', '.join(asked.settings.trials))}"


def choice(config: DatasetConfig, manifest: Manifest) -> str:
    """Say which objects and grasps were chosen, so that readers know how the sample is biased."""
    left_out = (
        f"Of {manifest.units} units of work, {manifest.quarantined} were left out, for the reasons "
        "in `quarantine.jsonl`."
    )
    if config.contacts:
        return f"The dataset has all contact sets that were given. {left_out}"
    return (
        "For each object, friction and family the grasps with the largest regions are kept, "
        f"{config.limit} at most, so they are not a random sample of all grasps. The objects were "
        "chosen by the maker of the dataset. "
        f"{left_out}"
    )


def limits(config: DatasetConfig) -> tuple[str, ...]:
    """Say what the dataset does not show."""
    other = {} if config.execution is None else WITH_EXECUTIONS
    return tuple(other.get(line, line) for line in LIMITS)


def splitting() -> str:
    """Say how objects are assigned to splits."""
    shares, before = list[str](), 0.0
    for name, upto in SPLITS:
        shares.append(f"{name} {upto - before:.0%}")
        before = upto
    listed = ", ".join(reversed(shares))
    return (
        "Objects are split by the hash of their mesh and the seed, and all grasps, controls and "
        f"trials of an object are where the object is. Chances are {listed}."
    )


def makers(manifest: Manifest) -> tuple[str, ...]:
    """List the programs that made the dataset, with versions."""
    named = (("graspproof", "graspproof"), ("MuJoCo", "mujoco"), ("Python", "python"))
    return tuple(f"{name} {manifest.versions.get(key, 'unknown')}" for name, key in named)
