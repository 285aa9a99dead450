"""How large a mesh file may be, and how much reading it may cost.

Nothing heavy is imported here, so that command-line flags can show the same values.
"""

from dataclasses import dataclass

from grasp_core.checked import positive, whole


@dataclass(frozen=True, slots=True)
class MeshLimits:
    """Largest size of a mesh file, and largest cost of reading it."""

    max_bytes: int = 64 * 2**20
    max_triangles: int = 200_000
    max_faces: int = 5_000
    """Most planar faces."""
    max_parts: int = 64
    """Most parts of the surface: bodies and cavities."""
    max_seconds: float = 30.0
    """Longest time for reading the file [s]; the numbers above bound what follows."""
    max_memory_mib: int = 2048

    def __post_init__(self) -> None:
        for name in ("max_bytes", "max_triangles", "max_faces", "max_parts", "max_memory_mib"):
            whole(getattr(self, name), name, least=1)
        positive(self.max_seconds, "max_seconds")
