"""Limits a mesh file's bytes, triangles, planar faces and bodies."""

from dataclasses import dataclass

from grasp_core.checked import whole


@dataclass(frozen=True, slots=True)
class MeshLimits:
    """Limits on a mesh file's size and content, which bound the time and memory of reading it."""

    max_bytes: int = 64 * 2**20
    max_triangles: int = 200_000
    max_faces: int = 5_000
    """Largest number of planar faces of the object."""
    max_parts: int = 64
    """Largest number of connected parts of the surface: separate bodies and inner cavities."""

    def __post_init__(self) -> None:
        for name in ("max_bytes", "max_triangles", "max_faces", "max_parts"):
            whole(getattr(self, name), name, least=1)
