"""Keeps the shape of the part that a baseline was written on, where it is not the planned one.

A file of grasps holds the shape that they were planned on. Once a baseline is written on a changed
part, that shape is neither the part of the baseline nor, in general, that of the next test. With
the shape of the baseline at hand, moves of faces are measured from where they were when the
baseline was written, which is what a user has accepted.
"""

from dataclasses import dataclass as plain_dataclass
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from grasp_core.errors import InputError
from grasp_core.objects.build import MeshChoices
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.records.grasps_json import RECORDED, surface_of_record, surface_record
from grasp_core.records.grasps_schema import SurfaceRecord
from sim_validate.baselines.executions import STRICT

Finite = Annotated[float, Field(allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0)]


@dataclass(frozen=True, slots=True, config=STRICT)
class RecordedPart:
    """The changed part that a baseline was written on."""

    planned_sha256: str
    """Hash of the mesh that the grasps were planned on."""
    vertices_m: tuple[tuple[Finite, Finite, Finite], ...]
    """Vertices of the changed part [m]."""
    triangles: tuple[tuple[Index, Index, Index], ...]
    surface: SurfaceRecord = SurfaceRecord()
    """What is known of them."""

    def body(self, name: str, content_sha256: str) -> Polyhedron:
        """Build the part, with planar faces."""
        try:
            found = polyhedron_from_mesh(
                self.vertices_m,
                self.triangles,
                MeshChoices(faces="planar", limits=RECORDED),
                name=name,
                known=surface_of_record(self.surface),
            )
        except (ValueError, InputError) as error:
            raise InputError(f"part: expected the mesh of a solid: {error}") from error
        if found.content_sha256 != content_sha256:
            raise InputError(
                "part: the mesh in the baseline is not the one that its content_sha256 says; write "
                "the baseline again with --grasp-bless"
            )
        return found


@plain_dataclass(frozen=True, slots=True)
class RecordedShape:
    """What a baseline says of the part that it was written on."""

    content_sha256: str
    """Hash of its mesh."""
    unit: str | None
    """Unit of length of its file; None if that is not known."""
    part: RecordedPart | None
    """The part; None if it is the one that the grasps were planned on."""


def recorded_part(planned: Polyhedron, tested: Polyhedron) -> RecordedPart | None:
    """Record the part that a baseline is written on; None if it is the planned one."""
    if planned.content_sha256 == tested.content_sha256:
        return None
    rows = tested.vertices.tolist()
    return RecordedPart(
        planned_sha256=planned.content_sha256,
        vertices_m=tuple((x, y, z) for x, y, z in rows),
        triangles=tuple((a, b, c) for a, b, c in tested.triangles.tolist()),
        surface=SurfaceRecord.model_validate(surface_record(tested.surface)),
    )
