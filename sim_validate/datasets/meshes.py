"""Writes and reads the meshes of a dataset: files in metres that give exactly the same solid."""

import hashlib
import json
from pathlib import Path

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import object_of
from grasp_core.files.records import from_record, record_of
from grasp_core.mesh_files.limits import FaceKind, MeshChoices
from grasp_core.mesh_files.reading import MeshFile, read_triangles
from grasp_core.objects.build import DEFAULT_LIMITS, content_hash
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from sim_validate.kit.paths import path_inside

FOLDER = "meshes"
SURFACE = "# surface "
"""Beginning of the first line, a comment that says what is known of the triangles."""


def mesh_text(body: Polyhedron) -> str:
    """Write a solid as an OBJ file in metres, whose numbers read back unchanged.

    Its first line is a comment with what is known of its surface, as in a `grasps.json`.
    """
    said = SURFACE + json.dumps(record_of(body.surface), sort_keys=True)
    points = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in body.vertices.tolist()]
    triangles = [f"f {i} {j} {k}\n" for i, j, k in (body.triangles + 1).tolist()]
    return "".join([said, "\n", *points, *triangles])


def mesh_path(folder: Path, object_id: str) -> Path:
    """Return the path of an object's mesh in a dataset."""
    return path_inside(folder, f"{FOLDER}/{object_id}.obj")


def stored_surface(folder: Path, object_id: str) -> MeshFile:
    """Read the triangles of an object of a dataset [m]."""
    path = mesh_path(folder, object_id)
    mesh = read_triangles(path, DEFAULT_LIMITS)
    if (found := content_hash(mesh.vertices, mesh.triangles)) != object_id:
        raise InputError(
            f"{path}: this is the mesh of another object, whose hash is {found}; see `graspproof "
            "dataset verify`"
        )
    return mesh


def stored_body(folder: Path, object_id: str, name: str, faces: FaceKind) -> Polyhedron:
    """Read an object of a dataset from its canonical mesh."""
    path, mesh = mesh_path(folder, object_id), stored_surface(folder, object_id)
    said, known = mesh.data.partition(b"\n")[0].decode("utf-8", "replace"), None
    with about(path):
        if said.startswith(SURFACE):
            with about("first line"):
                known = from_record(Surface, object_of(said.removeprefix(SURFACE), "surface"))
        return polyhedron_from_mesh(
            mesh.vertices, mesh.triangles, MeshChoices(faces=faces), name=name,
            source_sha256=hashlib.sha256(mesh.data).hexdigest(), known=known,
        )  # fmt: skip
