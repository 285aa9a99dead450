"""Defines the tables of a dataset: every column with its type, unit and meaning.

A dataset whose configuration asks for executions has one table and some columns more, and there are
groups of columns on request, which its manifest names. Names end in their unit. Geometry is in the
object's own frame, in float64, with normals into the object and torques about its centre of mass. A
value that could not be measured is null.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

Kind: TypeAlias = Literal["text", "bool", "int", "float"]
Name: TypeAlias = Literal["objects", "grasps", "trials", "executions"]
SplitName: TypeAlias = Literal["train", "validation", "test"]
SPLITS = (("test", 0.1), ("validation", 0.2), ("train", 1.0))
"""Upper ends of each split's share of hashes: an object is in the first split whose end is above
its hash."""
SHORT = 16
"""Number of digits of an object's hash in the names of its grasps."""


@dataclass(frozen=True, slots=True)
class Column:
    """Name, type, unit and meaning of one column of a table."""

    name: str
    kind: Kind
    meaning: str
    unit: str = ""
    shape: tuple[int, ...] = ()
    """Shape of each cell; () for a plain value."""


OBJECTS = (
    Column("object_id", "text", "SHA-256 hash of the object's mesh; identifies the object"),
    Column("source_name", "text", "file name, or name of the built-in object"),
    Column("source_sha256", "text", "SHA-256 hash of the mesh file or built-in mesh"),
    Column("split", "text", "part of the dataset: train, validation or test"),
    Column("vertices", "int", "number of vertices"),
    Column("triangles", "int", "number of triangles"),
    Column("faces", "int", "number of planar faces or patches"),
    Column("curved", "bool", "whether the faces are patches of a curved surface"),
    Column("volume_m3", "float", "volume", "m3"),
    Column(
        "volume_source",
        "text",
        "what volume and centre of mass are of: the surface, the "
        "capped surface (small holes were closed), or the convex hull (it is open)",
    ),
    Column("radius_m", "float", "largest distance of a vertex from the centre of mass", "m"),
    Column("center_of_mass_m", "float", "centre of mass", "m", (3,)),
)
GRASPS = (
    Column("grasp_id", "text", "identifies the row: made of object, friction and name"),
    Column("object_id", "text", "object of the grasp"),
    Column("split", "text", "part of the dataset that the object is in"),
    Column("name", "text", "the grasp's id in the planner's files: family and faces"),
    Column("label", "text", "grasp, given (from elsewhere), or the name of the negative control"),
    Column("control_of", "text", "the grasp that a negative control was made from"),
    Column("friction", "float", "Coulomb coefficient of the plan and of the trials", "1"),
    Column("family", "text", "family of the grasp, given by its lines of force; null for controls"),
    Column("faces", "int", "indices of the faces or patches; null for controls", shape=(4,)),
    Column("contacts", "int", "number of contacts: four, fewer for some controls"),
    Column("contact_points_m", "float", "contacts by finger; null after the last", "m", (4, 3)),
    Column("contact_normals", "float", "inward unit normals; null after the last", "1", (4, 3)),
    Column("moved_m", "float", "largest distance by which a given contact was moved", "m"),
    Column("force_closed", "bool", "whether it is proved to be in force closure"),
    Column("closure_margin", "float", "margin of the exact test of force closure", "1"),
    Column("critical_friction", "float", "smallest coefficient with force closure", "1"),
    Column("region_radius_m", "float", "radius of the smallest contact region; 0 for points", "m"),
    Column("region_kind", "text", "how contact regions were made: cone, disc, or point for none"),
    Column("region_radii_m", "float", "largest disc radius in each contact region", "m", (4,)),
    Column("ferrari_canny_lower_n", "float", "proved lower bound of Ferrari-Canny quality", "N"),
    Column("ferrari_canny_upper_n", "float", "proved upper bound of Ferrari-Canny quality", "N"),
    Column("held", "bool", "whether the grasp held in every trial"),
    Column("outcome", "text", "held, or how the first trial that did not hold ended"),
    Column("note", "text", "why a given grasp was not tried, else empty"),
    Column("trials", "int", "number of simulated trials"),
    Column("mismatches", "int", "number of contradictions between simulation and analysis"),
    Column("simulated_critical_friction", "float", "friction at which it slips in simulation", "1"),
)
TRIALS = (
    Column("grasp_id", "text", "grasp that is tried"),
    Column("trial", "int", "number of the trial, from 0 for each grasp"),
    Column("name", "text", "name of the wrench"),
    Column("wrench_n_nm", "float", "applied force, then torque", "N, N m", (6,)),
    Column("predicted_limit", "float", "largest multiple of the wrench resisted, by analysis", "1"),
    Column("required_friction", "float", "friction that the planned contact forces need", "1"),
    Column("outcome", "text", "held, or how the trial ended"),
    Column("reason", "text", "what happened; empty if the grasp held"),
    Column("displacement_m", "float", "largest motion of the object while holding", "m"),
    Column("rotation_rad", "float", "largest rotation of the object while holding", "rad"),
    Column("slip_m", "float", "largest slip of each fingertip; null after the last", "m", (4,)),
    Column("failed_after_s", "float", "time until a limit on motion was first crossed", "s"),
    Column("simulated_limit", "float", "multiple of the wrench that slips in simulation", "1"),
)
EXECUTED = (
    Column("executed", "bool", "whether its execution was simulated; false for controls"),
    Column("survived", "bool", "whether the object survived every trial; null if not known"),
    Column("execution_note", "text", "why it was not executed, or which trials are not possible"),
    Column("mass_kg", "float", "mass of the object in the execution", "kg"),
    Column("squeeze_n", "float", "contact forces on the object at rest, by finger", "N", (4, 3)),
    Column("load_multiple", "float", "multiple of the weight that the squeeze is proved for", "1"),
    Column("predicted_first_slip", "float", "least multiple of a trial's load that slips", "1"),
    Column("simulated_first_slip", "float", "the same from simulated contact forces", "1"),
    Column("executed_trials", "int", "number of trials of the execution"),
    Column("execution_mismatches", "int", "number of its controls that did not slip, but must"),
)
"""Columns of grasps that only a dataset with executions has."""
EXECUTIONS = (
    Column("grasp_id", "text", "grasp that is executed"),
    Column("trial", "int", "number of the trial, from 0 for each grasp"),
    Column("kind", "text", "weight, lift, shake, stop, knock or misplaced"),
    Column("name", "text", "the kind with its direction or number"),
    Column("survived", "bool", "whether the object was kept, and moved no farther than allowed"),
    Column("fate", "text", "stuck, slipped (at a contact, but kept), dropped, or diverged"),
    Column("slip_m", "float", "farthest that a point of contact slid on the object", "m"),
    Column("displacement_m", "float", "largest displacement of the object in the hand", "m"),
    Column("turn_rad", "float", "largest turn of the object in the hand", "rad"),
    Column("predicted_first_slip", "float", "multiple of the load that slips; null if none", "1"),
    Column("simulated_first_slip", "float", "the same from simulated contact forces", "1"),
)
KIND_COLUMNS = (
    Column("kind", "text", "planned, given, the name of a negative control, or how it is varied"),
    Column("made_from", "text", "the grasp that a varied one was made from; null for others"),
    Column("friction_ratio", "float", "friction over critical friction; null if not known", "1"),
    Column("displaced_m", "float", "distance of each contact from that of `made_from`", "m", (4,)),
    Column("region_exit_m", "float", "how far the region reached that way; null if unmoved", "m",
           (4,)),
    Column("mass_ratio", "float", "mass over that at which `made_from` is predicted to fail", "1"),
)  # fmt: skip
CLOSURE = (
    Column("span_angle_rad", "float", "half-angle below which cones positively span", "rad"),
    Column("smallest_singular_value", "float", "least singular value of the grasp map", "1"),
    Column("witness_forces_n", "float", "balanced forces on the object, normal parts sum to one",
           "N", (4, 3)),
)  # fmt: skip
MARGINS = (
    Column("predicted_loss", "float", "least multiple of a trial's load that loses it", "1"),
    Column("payload_kg", "float", "mass that the squeeze is proved to carry", "kg"),
    Column("tip_radius_m", "float", "radius of the fingertips of the execution", "m"),
)
LEAST_SQUEEZE = (
    Column("least_push_n", "float", "least largest push that carries the weight any way", "N"),
    Column("least_squeeze_n", "float", "contact forces at rest with that push", "N", (4, 3)),
)
TRIAL_MARGINS = (
    Column("predicted_loss", "float", "multiple of the load that loses it; null if none", "1"),
    Column("seed", "int", "seed that a misplaced trial was drawn by; null for others"),
)
SIZED = -1
"""Length that stands in a column's shape for the size of its group."""
HAND = (
    Column("hand_reached", "bool", "whether a pose of the hand was found; null if not closed"),
    Column("hand_reason", "text", "why no pose was found; empty where one was"),
    Column("hand_fingers", "int", "number of the hand's finger at each contact", shape=(4,)),
    Column("hand_joints_rad", "float", "joint angles, finger by finger from the palm", "rad",
           (SIZED,)),
    Column("T_object_palm_m", "float", "pose of the palm in the object's frame", "m", (4, 4)),
    Column("hand_points_m", "float", "contacts of the fingertips", "m", (4, 3)),
    Column("hand_normals", "float", "inward unit normals at these", "1", (4, 3)),
    Column("hand_open_joints_rad", "float", "joint angles with open fingers; null if none found",
           "rad", (SIZED,)),
    Column("hand_approach", "float", "direction of the palm's straight way in; null if none", "1",
           (3,)),
)  # fmt: skip
Group: TypeAlias = Mapping[Name, tuple[Column, ...]]
GROUPS: Mapping[str, Group] = {
    "kinds": {"grasps": KIND_COLUMNS},
    "closure": {"grasps": CLOSURE},
    "margins": {"grasps": MARGINS, "executions": TRIAL_MARGINS},
    "least_squeeze": {"grasps": LEAST_SQUEEZE},
    "hand": {"grasps": HAND},
}
"""Columns of each group, by the table that they belong to."""
Tables: TypeAlias = Mapping[Name, tuple[Column, ...]]
TABLES: dict[Name, tuple[Column, ...]] = {"objects": OBJECTS, "grasps": GRASPS, "trials": TRIALS}
"""Tables of a dataset without executions."""
KEYS: dict[Name, tuple[str, ...]] = {
    "objects": ("object_id",), "grasps": ("object_id", "grasp_id"), "trials": ("grasp_id", "trial"),
    "executions": ("grasp_id", "trial"),
}  # fmt: skip
"""Columns by which the rows of a table are sorted; no two rows have the same values in them."""
REFERENCES: dict[tuple[Name, str], tuple[Name, str]] = {
    ("grasps", "object_id"): ("objects", "object_id"),
    ("trials", "grasp_id"): ("grasps", "grasp_id"),
    ("executions", "grasp_id"): ("grasps", "grasp_id"),
}
"""Columns whose cells name a row of another table, with the column there that holds the name."""


def dataset_tables(*, executed: bool, groups: Mapping[str, int]) -> Tables:
    """Return the tables of a dataset with their columns; groups of columns have their sizes."""
    tables = dict(TABLES)
    if executed:
        tables |= {"grasps": (*GRASPS, *EXECUTED), "executions": EXECUTIONS}
    for group, size in ((group, groups[group]) for group in GROUPS if group in groups):
        for name, columns in GROUPS[group].items():
            tables[name] += tuple(
                replace(each, shape=tuple(size if n == SIZED else n for n in each.shape))
                for each in columns
            )
    return tables


def id_beginning(object_id: str, friction: float) -> str:
    """Return the first part of the names of all grasps of one object at one friction."""
    return f"{object_id[:SHORT]}-{friction}-"
