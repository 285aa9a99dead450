"""Settings of how a mesh is taken: lengths, faces, and limits on what is read."""

from dataclasses import field
from typing import Annotated, Literal, TypeAlias

from annotated_types import Interval

from grasp_core.allowed_values import Count, Quantity
from grasp_core.declared import declared
from grasp_core.settings import Settings

FaceKind: TypeAlias = Literal["auto", "planar", "patches"]
MESH_FORMATS = ("obj", "stl", "ply", "off", "glb", "3mf")
LengthUnit: TypeAlias = Literal["m", "cm", "mm", "um", "in", "ft"]


@declared
class MeshLimits(Settings):
    """Limits on a mesh file's size and content, which bound the time and memory of reading it."""

    max_mesh_bytes: Count = 64 * 2**20
    """Largest size of a mesh file that is read [bytes]."""
    max_triangles: Count = 200_000
    """Largest number of triangles of a mesh."""
    max_faces: Count = 5_000
    """Largest number of planar faces of an object."""
    max_parts: Count = 64
    """Largest number of separate parts of a surface: separate bodies and inner cavities."""


@declared
class PatchLimits(Settings):
    """How flat a patch of a curved surface must be, and how many patches are kept.

    Raises:
        InputError: A limit is out of range.
    """

    spread_deg: Annotated[float, Interval(gt=0.0, le=45.0)] = 10.0
    """Largest angle between the surface and a patch's plane [deg]; the friction angle to plan with
    shrinks by as much."""
    depth: Annotated[float, Interval(gt=0.0, le=0.1)] = 0.01
    """Largest distance of the surface from a patch's plane, relative to the object's extent."""
    most: Annotated[int, Interval(ge=4, le=200)] = 20
    """Keep at most this many patches, those with the largest inscribed discs."""


@declared
class FileLengths(Settings):
    """What lengths the numbers of a mesh file mean."""

    unit: LengthUnit | None = None
    """Unit of length in a mesh file. If not given, it is the one that a 3MF file states, and the
    metre in other files."""
    scale: Quantity = 1.0
    """Factor on the coordinates of a mesh file, besides its unit."""


@declared
class MeshChoices(MeshLimits):
    """How a mesh is taken."""

    faces: FaceKind = "auto"
    """Faces to plan on: exact planar faces, or nearly flat patches of a curved or scanned surface,
    which may have holes; auto takes patches where there are more than 200 planar faces."""
    patches: PatchLimits = field(default_factory=PatchLimits)
    flatness_m: Annotated[float, Interval(ge=0.0, le=20.0)] | None = None
    """Distance within which corners count as in one plane [m]. If not given, it is a millionth of
    the extent, or what the rounding of the file's coordinates explains."""
    largest_part: bool = False
    """Use the largest part of the mesh alone; otherwise at most 1 % of its surface is left out."""
