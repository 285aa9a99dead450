"""Refusals of mesh files, in one line each."""

from typing import NoReturn

from grasp_core.errors import MeshError, MeshRefusal

LONGEST = 60
"""Characters of a file that a message shows."""


def shown(value: object) -> str:
    """What stands in a file, for a message: short, and without what could steer a terminal."""
    text = value.decode("latin-1") if isinstance(value, bytes) else str(value)
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in text[:LONGEST])


def broken(where: str, said: str) -> NoReturn:
    """The file breaks the rules of its format.

    Raises:
        MeshError: Always.
    """
    raise MeshError(MeshRefusal.UNREADABLE, f"{where}: {said}; export it again")


def unsupported(said: str, remedy: str) -> NoReturn:
    """The file uses a part of its format that is not read, so that geometry would be lost.

    Raises:
        MeshError: Always.
    """
    raise MeshError(MeshRefusal.UNSUPPORTED, f"{said}; {remedy}")


def outside(where: str, corner: int, vertices: int) -> NoReturn:
    """A triangle names a vertex that there is not.

    Raises:
        MeshError: Always.
    """
    message = f"{where}: names vertex {corner}, the file has {vertices}; export it again"
    raise MeshError(MeshRefusal.INDEX, message)
