"""Defines the tables of a dataset: every column with its type, unit and meaning.

Names end in their unit. Geometry is in the object's own frame, in float64, with normals into the
object and torques about its centre of mass. A value that could not be measured is null.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

Kind: TypeAlias = Literal["text", "bool", "int", "float"]
Name: TypeAlias = Literal["objects", "grasps", "trials"]
SplitName: TypeAlias = Literal["train", "validation", "test"]
ExportFormat: TypeAlias = Literal["csv", "jsonl", "npz", "hdf5", "isaac", "mjcf"]
"""Names of the formats that `datasets.exports` writes."""


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
    Column("object_id", "text", "sha256 of the canonical mesh"),
    Column("source_name", "text", "file name, or name of the built-in object"),
    Column("source_sha256", "text", "of the file's bytes, or of the built-in object's mesh"),
    Column("split", "text", "train, validation or test"),
    Column("vertices", "int", "number of vertices"),
    Column("triangles", "int", "number of triangles"),
    Column("faces", "int", "number of planar faces or patches"),
    Column("curved", "bool", "whether the faces are patches of a curved surface"),
    Column("volume_m3", "float", "volume", "m3"),
    Column("radius_m", "float", "largest distance of a vertex from the centre of mass", "m"),
    Column("center_of_mass_m", "float", "centre of mass", "m", (3,)),
)
GRASPS = (
    Column("grasp_id", "text", "object, friction and grasp"),
    Column("object_id", "text", "of `objects`"),
    Column("split", "text", "that of the object"),
    Column("name", "text", "family and faces, as in the planner's files"),
    Column("label", "text", "grasp, given (from elsewhere), or the name of the negative control"),
    Column("control_of", "text", "the grasp that a negative control was made from"),
    Column("friction", "float", "Coulomb coefficient planned for and tried at", "1"),
    Column("family", "text", "class of the four lines of force; null for controls"),
    Column("faces", "int", "indices of the faces or patches; null for controls", shape=(4,)),
    Column("contacts", "int", "number of contacts: four but for some controls"),
    Column("contact_points_m", "float", "contacts in finger order, then nulls", "m", (4, 3)),
    Column("contact_normals", "float", "unit vectors into the object, then nulls", "1", (4, 3)),
    Column("moved_m", "float", "largest way of a given contact onto the surface", "m"),
    Column("force_closed", "bool", "proved: true for grasps, false for controls"),
    Column("closure_margin", "float", "margin of the exact closure test", "1"),
    Column("critical_friction", "float", "smallest coefficient that suffices", "1"),
    Column("region_radius_m", "float", "radius of the smallest independent disc, 0 without", "m"),
    Column("region_kind", "text", "what certifies the regions: cone, disc; point claims none"),
    Column("region_radii_m", "float", "radius of the largest disc in each region", "m", (4,)),
    Column("ferrari_canny_lower_n", "float", "proved lower bound of the quality", "N"),
    Column("ferrari_canny_upper_n", "float", "proved upper bound of the quality", "N"),
    Column("held", "bool", "whether every trial held"),
    Column("outcome", "text", "held, or how the first trial that did not hold ended"),
    Column("note", "text", "why a given grasp was not tried, else empty"),
    Column("trials", "int", "number of trials"),
    Column("mismatches", "int", "in how many ways simulation contradicts the analysis"),
    Column("simulated_critical_friction", "float", "where the object slips in simulation", "1"),
)
TRIALS = (
    Column("grasp_id", "text", "of `grasps`"),
    Column("trial", "int", "number within the grasp"),
    Column("name", "text", "of the wrench"),
    Column("wrench_n_nm", "float", "applied force and torque", "N, N m", (6,)),
    Column("predicted_limit", "float", "largest multiple resisted, by analysis", "1"),
    Column("required_friction", "float", "what the planned forces need", "1"),
    Column("outcome", "text", "held, or how it ended"),
    Column("reason", "text", "what happened, empty if it held"),
    Column("displacement_m", "float", "largest motion of the object while holding", "m"),
    Column("rotation_rad", "float", "largest rotation of the object while holding", "rad"),
    Column("slip_m", "float", "largest tangential motion of each fingertip, then nulls", "m", (4,)),
    Column("failed_after_s", "float", "when a threshold was first crossed", "s"),
    Column("simulated_limit", "float", "multiple at which it lets go in simulation", "1"),
)
TABLES: dict[Name, tuple[Column, ...]] = {"objects": OBJECTS, "grasps": GRASPS, "trials": TRIALS}
KEYS: dict[Name, tuple[str, ...]] = {
    "objects": ("object_id",), "grasps": ("object_id", "grasp_id"), "trials": ("grasp_id", "trial"),
}  # fmt: skip
"""Columns by which the rows of a table are sorted; no two rows have the same values in them."""
REFERENCES: dict[tuple[Name, str], tuple[Name, str]] = {
    ("grasps", "object_id"): ("objects", "object_id"),
    ("trials", "grasp_id"): ("grasps", "grasp_id"),
}
"""Columns whose cells name a row of another table, with the column there that holds the name."""
