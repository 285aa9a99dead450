"""Checks paths that files name: they must stay in the file's folder."""

from pathlib import Path, PurePosixPath

from grasp_core.errors import InputError
from grasp_core.files.json_text import shown

LONGEST = 500
"""Largest number of characters of a path in a file."""


def require_inside(name: object, field: str) -> str:
    """Check that a path is relative and has no `..`."""
    if not isinstance(name, str) or not name or len(name) > LONGEST:
        raise InputError(f"{field}: expected the path of a file, got {shown(name)}")
    parts = PurePosixPath(name).parts
    plain = name.isprintable() and "\\" not in name and ":" not in name
    if name.startswith("/") or ".." in parts or not parts or not plain:
        raise InputError(
            f"{field}: expected a relative path that stays in the file's folder, got {shown(name)}"
        )
    return name


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder, after a check that no link leads out of it."""
    path = folder / require_inside(name, "path")
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{path}: this link leads out of {folder}; copy the file into the folder")
    return path
