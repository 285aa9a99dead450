"""Bases of files of results: the object that they are about, and the versions that made them."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, Self, TypeVar

from grasp_core.allowed_values import Friction
from grasp_core.declared import Declared, declared
from grasp_core.figures import scalars
from grasp_core.files.records import RecordFile
from grasp_core.grasp_tables import ById, Named, frame_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions


@declared
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


Item = TypeVar("Item", bound=Named)


@declared
class ResultFile(RecordFile):
    """Base of files that say which versions made them."""

    versions: Mapping[str, str | None] = field(
        default_factory=versions, compare=False, kw_only=True
    )
    """Versions of every package that can change a number."""


@declared
class AboutGrasps(ResultFile, ById[Item]):
    """Base of files about the grasps of an object.

    They are sequences, as a plan is: `len`, iteration, `[0]`, `["c-0-1-2-7"]` and slices.
    """

    object: AboutObject
    friction: Friction
    """Coulomb coefficient at every contact."""
    complete: bool = field(kw_only=True)
    """Whether every grasp that was asked for was dealt with."""

    @property
    def object_sha256(self) -> str:
        """Hash of the object's canonical mesh, as in `Polyhedron.content_sha256`."""
        return self.object.content_sha256

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` with a row for each grasp, indexed by its id.

        It has a column for each figure of a result that is a number or a word; of lists, how many
        items they have. Figures are NaN where there is no result.

        Raises:
            InputError: The library pandas is not installed.
        """
        return frame_of([scalars(each) for each in self], [each.id for each in self])
