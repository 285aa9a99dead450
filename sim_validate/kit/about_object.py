"""Says which object a file is about."""

from dataclasses import dataclass
from typing import Self

from grasp_core.declared import Declared
from grasp_core.objects.polyhedron import Polyhedron


@dataclass(frozen=True, slots=True, repr=False)
class AboutObject(Declared):
    """The object that a file is about."""

    name: str
    source_sha256: str
    """Hash of the file or built-in mesh that the object was read from; empty if there is none."""
    content_sha256: str
    """Hash of its canonical mesh, as in `Polyhedron.content_sha256`."""

    @classmethod
    def of(cls, body: Polyhedron) -> Self:
        """Say which object this is."""
        return cls(body.name, body.source_sha256, body.content_sha256)
