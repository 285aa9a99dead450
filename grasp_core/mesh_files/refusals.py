"""Raises the errors for mesh files that are refused, each with a message of one line."""

from typing import NoReturn

from grasp_core.errors import MeshError, MeshRefusal

LONGEST = 60
"""Largest number of characters of a file that a message quotes."""


def shown(value: object) -> str:
    """Shorten a value for a message, and replace characters that could steer a terminal."""
    text = value.decode("latin-1") if isinstance(value, bytes) else str(value)
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in text[:LONGEST])


def broken(where: str, said: str) -> NoReturn:
    """Refuse a file that breaks the rules of its format."""
    message = f"the file breaks its format at {where}: {said}; export it again"
    raise MeshError(MeshRefusal.UNREADABLE, message)


def unsupported(said: str, remedy: str) -> NoReturn:
    """Refuse a file that uses a feature of its format that is not read."""
    message = f"the file has a feature that is not read: {said}; {remedy}"
    raise MeshError(MeshRefusal.UNSUPPORTED, message)


def not_finite(where: str, said: str, got: object) -> NoReturn:
    """Refuse a number that is infinite or not a number."""
    raise MeshError(MeshRefusal.NON_FINITE, f"{where}: {said}, got {got}; repair the mesh")


def outside(where: str, corner: int, vertices: int) -> NoReturn:
    """Refuse a triangle that refers to a missing vertex."""
    there = f"but the file has {vertices} vertices"
    message = f"{where} refers to vertex {corner}, {there}; export it again"
    raise MeshError(MeshRefusal.INDEX, message)
