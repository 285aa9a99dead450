"""Bad input as a catalogue: what is made, which command is given it, and what must come of it."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

GROUPS = (
    "of_files", "of_obj", "of_binary_meshes", "of_topology", "of_physics",
    "of_data_files", "of_surroundings",
)  # fmt: skip
"""Modules; the last three make whole files first, which takes a while."""

Make = Callable[[Path], list[str]]
"""Writes files into an empty folder, which is the working directory, and gives a command line."""


@dataclass(frozen=True, slots=True)
class Case:
    """One bad file or value."""

    group: str
    name: str
    make: Make
    code: int
    """Exit code that docs/commands.md promises."""
    says: tuple[str, ...]
    """In the message: the file or flag, the field, the remedy."""
    environment: tuple[tuple[str, str], ...] = ()


def file_case(
    group: str, name: str, file: str, data: bytes | str, says: str, *, command: str = "inspect"
) -> Case:
    """A file that a command is to refuse, naming it, with words of the message, parted by `|`.

    In the command FILE stands for the file, or it comes last.
    """

    def make(folder: Path) -> list[str]:
        (folder / file).write_bytes(data if isinstance(data, bytes) else data.encode())
        words = command.split()
        if "FILE" not in words:
            words.append("FILE")
        return [file if word == "FILE" else word for word in words]

    return Case(group, name, make, 4, (file, *says.split("|")))


def flag_case(group: str, line: str, says: str, code: int = 2) -> Case:
    """A command line that is to be refused."""
    return Case(group, line, lambda _: line.split(), code, tuple(says.split("|")))


def cases_of(group: str) -> list[Case]:
    """Every case of a group."""
    return import_module(f"tests.bad_input.{group}").cases()
