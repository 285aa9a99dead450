"""What is fuzzed: every reader of files, as one entry in one list."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

CORPUS = Path(__file__).with_name("corpus")
MEMORY = Path("/dev/shm")  # noqa: S108 - a folder in memory, where there is one
LONGEST_MESSAGE, MOST_LINES = 1000, 4
"""Of a refusal: it is for people."""


class FoundError(Exception):
    """A reader did what it must not."""


@dataclass(frozen=True, slots=True)
class Target:
    """One reader."""

    name: str
    """Also the folder of its inputs."""
    read: Callable[[bytes], Any]
    """Reads the bytes of a file."""
    seeds: Callable[[], Iterable[bytes]]
    """Files that are read; small ones."""
    agrees: Callable[[bytes, Any], None] = lambda _data, _found: None
    """Raises `AssertionError` where what was read is not what is written, by another reading."""
    written: Literal["json", "toml", "npz", "glb", "3mf", "words", "bytes"] = "bytes"
    """How files are mutated: as text of that kind, as members of an archive, or bytewise."""

    def inputs(self) -> Iterator[tuple[str, bytes]]:
        """Seeds, and what was found before, by name."""
        yield from ((f"seed {i}", data) for i, data in enumerate(self.seeds()))
        for path in sorted((CORPUS / self.name).glob("*")):
            yield path.name, path.read_bytes()

    def check(self, data: bytes) -> bool:
        """Read an input; whether it was accepted.

        Raises:
            FoundError: A refusal is no message for people, or what was read is not what is written.
            Exception: Whatever else the reader raises.
        """
        from grasp_core.errors import InputError  # nothing of ours before it can be instrumented

        try:
            found = self.read(data)
        except InputError as error:
            _check_message(str(error))
            return False
        try:
            self.agrees(data, found)
        except Exception as error:
            raise FoundError(f"{self.name}: read is not what is written: {error!r:.500}") from error
        return True


def _check_message(text: str) -> None:
    lines = text.splitlines()
    if not 0 < len(lines) <= MOST_LINES or len(text) > LONGEST_MESSAGE:
        raise FoundError(f"a message of {len(lines)} lines, {len(text)} letters: {text[:200]!r}")
    if not all(line.isprintable() for line in lines):
        raise FoundError(f"a message that cannot be printed: {text[:200]!r}")


def targets() -> dict[str, Target]:
    """All readers, by name."""
    from tests.fuzzing import array_files, data_files, mesh_files

    listed = [*data_files.TARGETS, *array_files.TARGETS, *mesh_files.TARGETS]
    return {target.name: target for target in listed}
