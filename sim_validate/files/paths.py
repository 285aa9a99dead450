"""A path that a file names -> a path that stays in the folder of that file."""

from pathlib import Path, PurePosixPath

from grasp_core.errors import InputError
from grasp_core.files.strict_json import shown

LONGEST = 500
"""Letters of a path in a file."""


def require_inside(name: object, field: str) -> str:
    """A relative path without ways up.

    Args:
        name: As a file has it, with slashes.
        field: Where it stands, for messages.

    Raises:
        InputError: It is none, or leads elsewhere.
    """
    if not isinstance(name, str) or not name or len(name) > LONGEST:
        raise InputError(f"{field}: expected the path of a file, got {shown(name)}")
    parts = PurePosixPath(name).parts
    if name.startswith("/") or ".." in parts or not parts or not _plain(name):
        raise InputError(f"{field}: expected a path inside the folder, got {shown(name)}")
    return name


def path_inside(folder: Path, name: str) -> Path:
    """The path of a file in a folder, out of which no link leads.

    Raises:
        InputError: It leads elsewhere.
    """
    path = folder / require_inside(name, "path")
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{path}: leads out of {folder}; copy the file into it")
    return path


def _plain(name: str) -> bool:
    return name.isprintable() and "\\" not in name and ":" not in name
