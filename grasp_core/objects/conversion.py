"""Takes triangles out of meshes of the library trimesh, and makes such meshes of triangles."""

import importlib
from typing import Any

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError


def triangles_of(mesh: Any) -> tuple[Any, Any]:
    """Return the vertices and the triangles of a `trimesh.Trimesh`, unchecked."""
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
        raise InputError(
            f"mesh must be a trimesh.Trimesh, got {type(mesh).__name__}; for a trimesh.Scene, "
            "pass scene.to_mesh()"
        )
    return mesh.vertices, mesh.faces


def mesh_of(vertices: Array, triangles: Indices, name: str) -> Any:
    """Return a `trimesh.Trimesh` with given vertices (n, 3) [m] and triangles (t, 3)."""
    module: Any = importlib.import_module("trimesh")
    return module.Trimesh(
        vertices=vertices, faces=triangles, metadata={"name": name}, process=False
    )
