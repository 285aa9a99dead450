"""How much a mesh file may be, and may cost to read.

Nothing heavy is imported here, so that flags have the same values.
"""

from dataclasses import dataclass

from grasp_core.checked import positive, whole


@dataclass(frozen=True, slots=True)
class MeshLimits:
    """How much a mesh file may be, and may cost to read."""

    max_bytes: int = 64 * 2**20
    max_triangles: int = 200_000
    max_faces: int = 5_000
    """Planar faces."""
    max_parts: int = 64
    """Of the surface: bodies and cavities."""
    max_seconds: float = 30.0
    """For reading the file; what follows is bounded by the numbers above."""
    max_memory_mib: int = 2048

    def __post_init__(self) -> None:
        for name in ("max_bytes", "max_triangles", "max_faces", "max_parts", "max_memory_mib"):
            whole(getattr(self, name), name, least=1)
        positive(self.max_seconds, "max_seconds")
