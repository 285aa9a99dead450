"""Writes an object as the folder in which DexGraspBench looks for it.

DexGraspBench takes all files of `urdf/meshes` as convex pieces, and the mass that an object has at
scale 1 and density 1 from `info/simplified.json`. A convex object is its own only piece; others
must be taken apart by the tool MeshProcess, as pieces that only cover the surface have no mass.

Source: src/util/hand_util.py and src/task/eval_func/base.py of DexGraspBench, see `DexRecord`.
"""

from pathlib import Path

from grasp_core.checked import path_of
from grasp_core.errors import InputError
from grasp_core.files.json_text import text_of
from grasp_core.files.text_files import write_text
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron, is_convex

DENSITY = 1000.0


def write_dex_object(body: Polyhedron, folder: str | Path) -> Path:
    """Write a convex object for DexGraspBench, at scale 1 in metres; return the folder.

    Raises:
        InputError: The object is not convex.
    """
    check_body(body)
    place = path_of(folder, "folder")
    if not is_convex(body):
        raise InputError(
            f"body must be convex, but {body.name} is not: DexGraspBench simulates convex pieces, "
            "which its companion MeshProcess makes; give its folder as the object's path instead"
        )
    mesh = obj_text(body)
    write_text(place / "urdf" / "meshes" / "convex_piece_000.obj", mesh)
    write_text(place / "mesh" / "simplified.obj", mesh)
    facts = {"mass": body.mass_at(DENSITY), "density": DENSITY, "scale": 1.0}
    write_text(place / "info" / "simplified.json", text_of(facts))
    return place


def obj_text(body: Polyhedron) -> str:
    """Return the object as an OBJ file with every digit, corners counted from 1."""
    corners = ("v " + " ".join(map(repr, point)) for point in body.vertices.tolist())
    faces = ("f " + " ".join(map(str, each)) for each in (body.triangles + 1).tolist())
    return "\n".join([*corners, *faces, ""])
