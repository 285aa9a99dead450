"""Finds the objects that records name: in a folder, in one mesh file, or among the built-in ones.

A folder is searched for the mesh files and folders of public sets (`LAYOUTS`), of which nothing is
read that lies outside of the folder that the user gave. Records often name an object by its path
where they were made, so the longest ending of it counts that the folder holds.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path, PureWindowsPath
from typing import NamedTuple

import numpy as np

from grasp_core.allowed_values import Quantity, path_of, value_of
from grasp_core.errors import InputError, about
from grasp_core.files.text_files import read_bytes
from grasp_core.mesh_files.limits import MESH_FORMATS
from grasp_core.mesh_files.polygons import too_many
from grasp_core.mesh_files.reading import read_triangles
from grasp_core.messages import shown
from grasp_core.objects.build import DEFAULT_LIMITS
from grasp_core.objects.convex_pieces import PiecedObject, convex_solids, parts_of, pieced_object
from grasp_core.objects.polyhedron import UNITS_M, Polyhedron, load_polyhedron
from grasp_core.objects.surface import Mesh
from scenes.example_objects import example_object

LAYOUTS = (
    ("coacd/decomposed.obj", True), ("urdf/meshes/*.obj", True), ("mesh/coacd.obj", True),
    ("mesh/simplified.obj", False), ("mesh/*.obj", False),
)  # fmt: skip
"""Mesh files in the folder of an object, the first that exist count, and whether they hold convex
pieces: those of DexGraspNet, then those of DexGraspBench, which MeshProcess writes."""
MOST_PARTS = 64
"""Largest number of parts of a path that names an object."""
KEPT = 16
"""Number of objects that are kept, each in one scale."""


class ObjectFiles(NamedTuple):
    """The mesh files of an object, none for a built-in one, and whether they hold its pieces."""

    name: str
    files: tuple[Path, ...]
    pieced: bool = False

    @property
    def sha256(self) -> str:
        """Return the hash of the file's bytes, of several files' hashes, or of a built-in mesh."""
        if not self.files:
            return example_object(self.name).source_sha256
        each = [hashlib.sha256(read_bytes(file)).hexdigest() for file in self.files]
        return each[0] if len(each) == 1 else hashlib.sha256("".join(each).encode()).hexdigest()


def recorded_object(name: str, scale: float, objects: str | Path) -> PiecedObject:
    """Find and load the object of a record.

    Args:
        name: Object as the record names it: a name in the folder, or a path that ends in one.
        scale: Factor on the lengths of the mesh; the result is in metres, in the mesh's frame.
        objects: Folder with the objects, or one mesh file or the name of a built-in object that
            stands for the objects of all records.

    Raises:
        InputError: No such object is found, its name leads out of the folder, or its mesh cannot
            be taken.
    """
    value_of(str, name, "object")
    factor = value_of(Quantity, scale, "scale")
    found = _kept(name, factor, path_of(objects, "objects"))
    if isinstance(found, InputError):
        raise found.with_traceback(None)
    return found


@lru_cache(maxsize=KEPT)
def _kept(name: str, scale: float, objects: Path) -> PiecedObject | InputError:
    """Return an object, or the error with which it is refused, so that neither is read twice."""
    try:
        found = object_files(name, objects)
        return _loaded(found, scale) if found.files else _built_in(found.name, scale)
    except InputError as error:
        return error


def object_files(name: str, objects: Path) -> ObjectFiles:
    """Find the files of an object, as `recorded_object` does.

    Raises:
        InputError: No such object is found, or its name leads out of the folder.
    """
    try:
        if objects.is_file():
            return ObjectFiles(objects.stem, (objects,))
        if objects.is_dir():
            return _in_folder(objects.resolve(), name)
    except (OSError, RuntimeError) as error:  # pathlib raises the latter where links make circles
        raise InputError(
            f"object {shown(name)} cannot be looked for in {objects}: {error}"
        ) from error
    none = "expected a folder with objects, a mesh file or the name of a built-in object"
    return _named(str(objects), f"{objects}: {none}, but it is none of them")


def _in_folder(folder: Path, name: str) -> ObjectFiles:
    for ending in _endings(name):
        own = folder / ending
        files = [own, *(own.with_name(f"{own.name}.{kind}") for kind in MESH_FORMATS)]
        for file in files:
            if file.suffix.lower().lstrip(".") in MESH_FORMATS and file.is_file():
                return ObjectFiles(file.stem, (_inside(folder, file),))
        for pattern, pieced in LAYOUTS:
            place, _, wanted = pattern.rpartition("/")
            found = sorted(_inside(folder, own / place).glob(wanted))
            if len(found) > 1 and not pieced:
                raise InputError(
                    f"object {shown(name)}: expected one mesh in {own / place}, got {len(found)}; "
                    "leave one there, or give it in place of the folder"
                )
            if found:
                inside = tuple(_inside(folder, file) for file in found)
                return ObjectFiles(own.name, inside, pieced)
    layouts = ", ".join(f"NAME/{pattern}" for pattern, _ in LAYOUTS)
    return _named(
        name,
        f"object {shown(name)}: expected it in {folder} as NAME.({'|'.join(MESH_FORMATS)}), "
        f"{layouts}, where NAME may be any ending of the path, or as a built-in object, but found "
        "none; give the folder that holds the objects of the records",
    )  # fmt: skip


def _endings(name: str) -> Iterator[Path]:
    """Yield the endings of a path, the longest first; a path that may lead elsewhere is refused."""
    path = PureWindowsPath(name)  # takes both kinds of slashes
    leads_out = path.anchor or ".." in path.parts
    if leads_out or not name.isprintable() or not 0 < len(path.parts) <= MOST_PARTS:
        raise InputError(
            f"object {shown(name)}: expected a name, or a path of at most {MOST_PARTS} parts below "
            "the folder of the objects, without .. and without a drive or / at its start"
        )
    yield from (Path(*path.parts[start:]) for start in range(len(path.parts)))


def _inside(folder: Path, path: Path) -> Path:
    """Return a path with its links resolved; one that leads out of the folder is refused."""
    found = (folder / path).resolve()
    if not found.is_relative_to(folder):
        raise InputError(
            f"{folder / path}: a link leads out of the folder of the objects; give the folder that "
            "it leads to, or a copy"
        )
    return found


def _loaded(found: ObjectFiles, scale: float) -> PiecedObject:
    """Load an object: convex pieces if the files hold them, else one solid as everywhere."""
    name, files, pieced = found
    parts, count = list[Mesh](), 0
    for file in files:
        read = read_triangles(file, DEFAULT_LIMITS)
        mesh = Mesh(UNITS_M[read.unit or "m"] * read.vertices, read.triangles)
        with about(file):
            if (count := count + len(read.triangles)) > DEFAULT_LIMITS.max_triangles:
                too_many(count, DEFAULT_LIMITS.max_triangles)
            pieces = parts_of(mesh) if pieced else convex_solids(mesh)
        if pieces is None:
            return PiecedObject(replace(load_polyhedron(file, scale=scale), name=name))
        parts += pieces
    with about(files[0] if len(files) == 1 else files[0].parent):
        return pieced_object(parts, scale=scale, name=name)


def _named(name: str, otherwise: str) -> ObjectFiles:
    """Return a built-in object by its name; another name is refused in other words."""
    try:
        example_object(name)
    except InputError as error:
        raise InputError(otherwise) from error
    return ObjectFiles(name, ())


def _built_in(name: str, scale: float) -> PiecedObject:
    body = example_object(name)
    if scale == 1.0:
        return PiecedObject(body)
    points = np.multiply(body.vertices, scale)
    return PiecedObject(Polyhedron.from_mesh(points, body.triangles, name=body.name))
