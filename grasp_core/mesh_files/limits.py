"""Limits a mesh file's bytes, triangles, planar faces and bodies."""

from dataclasses import dataclass

from grasp_core.kinds import Count
from grasp_core.settings import Settings


@dataclass(frozen=True, slots=True)
class MeshLimits(Settings):
    """Limits on a mesh file's size and content, which bound the time and memory of reading it."""

    max_bytes: Count = 64 * 2**20
    max_triangles: Count = 200_000
    max_faces: Count = 5_000
    """Largest number of planar faces of the object."""
    max_parts: Count = 64
    """Largest number of connected parts of the surface: separate bodies and inner cavities."""
