"""Writes plans as JSON text with units in the keys, and reads it back, checking every field.

The fields of `Plan`, `Grasp` and the values in them are those of the file. It holds the object's
mesh, so that grasps can be validated from it alone.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from grasp_core.arrays import Array, Indices, Point, Shape
from grasp_core.declared import Declared
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import object_of, shown, text_of
from grasp_core.files.records import from_record, record_of
from grasp_core.files.text_files import read_text, write_text
from grasp_core.kinds import instance, path_of
from grasp_core.mesh_files.limits import MeshLimits, PatchLimits
from grasp_core.objects.build import MeshChoices
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from grasp_core.planning.certify import check_witness, find_critical_frictions
from grasp_core.planning.result import Plan
from grasp_core.provenance import versions
from grasp_core.settings import extended
from grasp_core.values import Grasp

SCHEMA = 2
ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
"""Ids of grasps in files: they also name scene files, so they have no dots or slashes."""
RECORDED = MeshLimits(max_triangles=2_000_000, max_faces=50_000, max_parts=640)
"""Limits for the meshes in grasps files: ten times the usual, for users who raised a limit."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh(Declared):
    """The triangles of an object in a file."""

    vertices_m: Annotated[Array, Shape(None, 3)]
    triangles: Annotated[Indices, Shape(None, 3, whole=True)]


@dataclass(frozen=True, slots=True, eq=False)
class RecordedObject(Declared):
    """What a file says of the object that grasps were planned on."""

    name: str
    source_sha256: str
    content_sha256: str
    mesh: Mesh
    center_of_mass_m: Point
    surface: Surface = field(default_factory=Surface)
    patches: PatchLimits | None = None

    @classmethod
    def of(cls, body: Polyhedron) -> "RecordedObject":
        """Record an object."""
        return cls(
            body.name, body.source_sha256, body.content_sha256, Mesh(body.vertices, body.triangles),
            body.center_of_mass, body.surface, body.patches,
        )  # fmt: skip

    def body(self) -> Polyhedron:
        """Build the object again."""
        faces = "patches" if self.patches else "planar"
        body = polyhedron_from_mesh(
            self.mesh.vertices_m,
            self.mesh.triangles,
            extended(MeshChoices, RECORDED, faces=faces, patches=self.patches or PatchLimits()),
            name=self.name,
            source_sha256=self.source_sha256,
            center_of_mass=self.center_of_mass_m,
            known=self.surface,
        )
        if body.content_sha256 != self.content_sha256:
            raise InputError(
                "object.content_sha256: the hash does not fit the mesh in the file; plan again"
            )
        return body


def plan_to_json(body: Polyhedron, plan: Plan) -> str:
    """Write a plan as the text of a `grasps.json`; equal plans give equal text."""
    find_critical_frictions(plan.grasps)
    said = record_of(plan)
    said["versions"] = said["versions"] or versions()
    said["grasps"] = said.pop("grasps")  # last in the file, a line each
    return text_of({"schema": SCHEMA, "object": record_of(RecordedObject.of(body)), **said})


def grasps_from_json(text: str) -> Plan:
    """Read the text of a `grasps.json` as the plan that was written.

    A file keeps neither times nor what is known of face quadruples without grasps: `absences`,
    `undecided` and `unreached` are empty. Written again, the plan gives the same text.
    """
    found = object_of(text, "grasps.json", schema=SCHEMA)
    del found["schema"]
    body = from_record(RecordedObject, found.pop("object", None), "object").body()
    plan = from_record(Plan, found, body=body)
    if plan.versions is None:
        raise InputError("versions: missing; add those of the packages that made the grasps")
    for place, grasp in enumerate(plan.grasps):
        with about(f"grasps[{place}]"):
            _check_grasp(body, grasp, plan.friction)
    if len({grasp.id for grasp in plan.grasps}) < len(plan.grasps):
        raise InputError("grasps: two grasps have the same id; ids must differ")
    return plan


def _check_grasp(body: Polyhedron, grasp: Grasp, friction: float) -> None:
    """Refuse a grasp of a file that cannot be one of the object, or whose id is no file name."""
    if not ID.fullmatch(grasp.id):
        raise InputError(
            "id: expected up to 100 letters, digits, '_' and '-', as it names files as well, got "
            f"{shown(grasp.id)}"
        )
    check_on_faces(body, grasp)
    check_witness(body, grasp, friction)


def save_grasps(path: str | Path, plan: Plan) -> Path:
    """Write a plan as a `grasps.json`, which `graspproof validate` and all other commands read.

    A slice of a plan, such as `plan[:5]`, what `plan.filter` gives, and grasps of one's own choice,
    `dataclasses.replace(plan, grasps=...)`, can be written as well.

    Args:
        path: Path of the file; missing folders are made.
        plan: A plan, as `gc.plan` or `gc.load_grasps` returns it.

    Returns:
        The path.

    Raises:
        InputError: The value is not a plan.
        OSError: The file cannot be written.
    """
    path = path_of(path, "path")
    instance(plan, Plan, "plan", "gc.plan makes plans")
    return write_text(path, plan_to_json(plan.body, plan))


def load_grasps(path: str | Path) -> Plan:
    """Read a `grasps.json` as a plan, with every grasp checked against the object in the file.

    Each grasp equals the one that was saved. A file keeps neither times nor what is known of face
    quadruples without grasps: `absences`, `undecided` and `unreached` are empty. A plan that is
    loaded and saved again gives the same bytes.

    Args:
        path: A `grasps.json`, as `save_grasps` and `graspproof plan` write it.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    with about(path):
        return grasps_from_json(text)
