"""Converts meshes of the library trimesh to polyhedra and back."""

import importlib
from typing import Any

from grasp_core.checked import instance
from grasp_core.errors import InputError
from grasp_core.objects.face import FaceKind, PatchLimits
from grasp_core.objects.polyhedron import Polyhedron


def from_trimesh(
    mesh: Any, *, name: str = "object", faces: FaceKind = "auto", patches: PatchLimits | None = None
) -> Polyhedron:
    """Build a polyhedron from a `trimesh.Trimesh`, with the same checks as for a mesh file.

    Args:
        mesh: Any value with `vertices`, (n, 3) [m], and triangles `faces`, (t, 3).
        name: What to call the object.
        faces: See `load_polyhedron`.
        patches: See `load_polyhedron`.

    Raises:
        InputError: The value is not a mesh, or an option is refused.
        MeshError: The mesh is not a solid; its `reason` says why.
    """
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
        raise InputError(
            f"mesh must be a trimesh.Trimesh, got {type(mesh).__name__}; for a trimesh.Scene, "
            "pass scene.to_mesh()"
        )
    return Polyhedron.from_mesh(mesh.vertices, mesh.faces, name=name, faces=faces, patches=patches)


def to_trimesh(body: Polyhedron) -> Any:
    """Return the surface of a polyhedron as a `trimesh.Trimesh` with the same triangles.

    Raises:
        InputError: The value is not a polyhedron.
    """
    instance(body, Polyhedron, "body")
    module: Any = importlib.import_module("trimesh")
    return module.Trimesh(
        vertices=body.vertices, faces=body.triangles, metadata={"name": body.name}, process=False
    )
