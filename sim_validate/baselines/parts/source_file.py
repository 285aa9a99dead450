"""Finds the mesh file that grasps were planned from, and says whether it has changed since.

A file of grasps holds the mesh that they were planned on, so a part that has been changed since
would pass unnoticed. Therefore its mesh file is searched each time. The file counts as unchanged if
its bytes are those that were planned from, or if it gives the same solid in some unit: comments,
line ends and the order of vertices do not count.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from grasp_core.errors import InputError, MeshError
from grasp_core.files.text_files import read_bytes
from grasp_core.mesh_files.reading import FORMATS
from grasp_core.objects.polyhedron import UNITS_M, Polyhedron, load_polyhedron
from grasp_core.records.grasps_json import RECORDED, SavedGrasps


@dataclass(frozen=True, slots=True)
class Source:
    """The mesh file that grasps were planned from, if it was found."""

    file: Path | None = None
    """Path of the mesh file; None if it was not found, or the grasps come from no file."""
    note: str = ""
    """A sentence that says the mesh file was not found; empty otherwise."""
    changed: bool = False
    """Whether the file holds another solid than the one that was planned on."""
    unit: str = ""
    """Unit in which a file of other bytes holds the same solid; empty where that does not matter.
    """


def source_of(
    saved: SavedGrasps,
    grasps: Path,
    folders: Iterable[Path],
    named: Path | None = None,
    scale: float | None = None,
) -> Source:
    """Find the mesh file that grasps were planned from.

    Of several files with the object's name, an unchanged one is taken, or else the first.
    """
    body = saved.body
    if body.source_sha256 == body.content_sha256:
        if named is not None:
            raise InputError(
                f"{grasps}: these grasps were not planned from a mesh file, so not from {named}; "
                "leave `object` out, or plan from the file"
            )
        return Source()
    found = [named] if named is not None else _beside(body.name, [grasps.parent, *folders])
    for path in found:
        if (unit := _unit_of_same(path, body, scale)) is not None:
            return Source(file=path, unit=unit)
    if found:
        return Source(file=found[0], changed=True)
    return Source(
        note=f"{grasps}: the mesh that it holds was tested; the file it was planned from, "
        f"{body.name!r} with some ending, is not beside it (`object` in a *.grasps.toml says where)"
    )


def _beside(name: str, folders: Iterable[Path]) -> list[Path]:
    """List mesh files with a given name, sorted within their folders."""
    unique = {folder.resolve(): folder for folder in folders}
    return [
        path
        for folder in unique.values()
        for path in _entries(folder)
        if path.stem == name and path.suffix.lower().lstrip(".") in FORMATS and path.is_file()
    ]


def _entries(folder: Path) -> list[Path]:
    """List the contents of a folder, sorted; none if it does not exist or cannot be read."""
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _unit_of_same(path: Path, body: Polyhedron, scale: float | None) -> str | None:
    """Return the unit in which a file holds a body; None if it does not.

    Empty if the body was read from these very bytes, whatever their unit.
    """
    if hashlib.sha256(read_bytes(path)).hexdigest() == body.source_sha256:
        return ""
    return fitting_exactly(path, body, scale)


def fitting_exactly(path: Path, body: Polyhedron, scale: float | None) -> str | None:
    """Return the unit in which a file holds the very solid of a body; None if it does in none."""
    units = (unit for unit in UNITS_M if _content(path, unit, scale, body) == body.content_sha256)
    return next(units, None)


def _content(path: Path, unit: str, scale: float | None, body: Polyhedron) -> str:
    """Hash the solid in a file; empty if the file holds no solid in this unit."""
    faces = "planar" if body.patches is None else "patches"
    try:
        read = load_polyhedron(
            path, unit=unit, scale=scale or 1.0, faces=faces, patches=body.patches, limits=RECORDED
        )
    except MeshError:
        return ""
    return read.content_sha256
