"""Sentences in the README.md of a dataset: what its rows are, how they were made, their limits."""

from collections.abc import Mapping

from sim_validate.datasets.columns import Name
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.rows import SPLITS

KEYWORDS = (
    "robotics", "grasping", "force-closure", "multi-finger grasps", "contact mechanics",
    "simulation", "mujoco", "synthetic", "negative examples",
)  # fmt: skip
ROWS: Mapping[Name, str] = {
    "objects": "an object; its mesh, in metres, is `meshes/OBJECT_ID.obj`",
    "grasps": "four contacts on an object at one friction, or a negative control made from them",
    "trials": "a grasp or control under one wrench, in simulation",
}
"""Meaning of one row of each table."""
LABELS: Mapping[str, str] = {
    "grasp": "a planned grasp, proved to be in force closure",
    "given": "contacts from elsewhere, put on the object and judged",
    "low_friction": "the same contacts, friction below the critical one",
    "fingers_removed": "three or two of the contacts",
    "normal_flipped": "a finger that pulls where it should push",
    "contacts_moved": "contacts moved on their faces",
    "uncorrected": "what the paper's construction as printed takes for a grasp on these faces",
}
"""Meanings of the values of the column `label`."""
PLANNED = (
    "Each object is planned at each friction, each family of grasps by itself. Every grasp has "
    "a certificate of force closure."
)
JUDGED = (
    "Contacts from elsewhere, in `contacts.json`, are put on the nearest faces of their object, "
    "`moved_m` says how far. Each set is proved to be in force closure or proved not to be; those "
    "on no face are `not_tried`, their `note` says why."
)
TRIED = (
    "Then it is simulated in MuJoCo: four spherical fingertips squeeze the object, which is "
    "loaded with the wrenches in `trials`. Negative controls and all contact sets proved not to "
    "be in force closure are loaded with what they cannot oppose."
)
CONVENTIONS = (
    "SI units, which end the names of columns. Positions, normals and wrenches are in the "
    "object's own frame, that of its mesh. Normals have length one and point into the object. A "
    "wrench is force, then torque about the centre of mass, applied to the object. Friction is "
    "the Coulomb coefficient. Numbers are float64. What could not be measured is null; contact "
    "sets of fewer than four fingers end in nulls."
)
LIMITS = (
    "Objects and fingertips are rigid, loads quasi-static; nothing was tried on a real robot.",
    "Friction is Coulomb's, the same at all contacts; fingertips are hard spheres without "
    "torsional friction.",
    "No hand is there: whether fingers can reach the contacts was not asked.",
    "Masses in simulation are not the objects', but chosen so that similar grasps behave alike.",
    "Curved objects are planned on nearly flat patches; what lies between these is not searched.",
)
SOURCES = (
    "Objects are made from meshes whose own licences hold for `meshes/` and all that is derived "
    "from them; this dataset does not know them. Whoever publishes it has to state them."
)


def summary(config: DatasetConfig, manifest: Manifest) -> str:
    """Say in a few sentences what the dataset holds, without a user's words."""
    rows = manifest.rows()
    frictions = ", ".join(f"{friction:g}" for friction in config.frictions)
    return (
        f"Four-finger grasps of {rows['objects']} objects at friction {frictions}: "
        f"{rows['grasps']} contact sets, which are grasps proved to be in force closure and "
        f"negative controls proved not to be, and {rows['trials']} trials of them in simulation."
    )


def made(config: DatasetConfig) -> str:
    """Say how the grasps of the dataset were made."""
    return f"{JUDGED if config.contacts else PLANNED} {TRIED}"


def choice(config: DatasetConfig, manifest: Manifest) -> str:
    """Say which objects and grasps were chosen, so that readers know how the sample is biased."""
    left_out = (
        f"Of {manifest.units} units of work {manifest.quarantined} were left out, for the reasons "
        "in `quarantine.jsonl`."
    )
    if config.contacts:
        return f"The grasps are all that were given. {left_out}"
    return (
        "Of each object, friction and family the grasps with the largest regions are kept, "
        f"{config.limit} at most: no fair sample of all grasps. Objects are those that were given. "
        f"{left_out}"
    )


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
