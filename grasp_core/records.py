"""Grasps <-> JSON text, with units in the keys; what is read is checked field by field.

The file holds the object's mesh, so that grasps can be validated from it alone.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from grasp_core.certified import check_witness
from grasp_core.errors import InputError
from grasp_core.mesh import polyhedron_from_mesh
from grasp_core.on_faces import check_on_faces
from grasp_core.plans import Plan
from grasp_core.values import (
    Contact,
    ContactRegion,
    Family,
    ForceCone,
    Grasp,
    PatchLimits,
    Polyhedron,
    RegionKind,
    Witness,
    four,
)
from grasp_core.versions import versions

SCHEMA = 1
SAME_DIRECTION = 1e-6
"""How far a witness direction may be from its force's: what six digits in a file keep."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
Triple = tuple[Finite, Finite, Finite]


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class MeshRecord(_Record):
    """Triangles of the object."""

    vertices_m: list[Triple]
    triangles: list[tuple[int, int, int]]


class PatchesRecord(_Record):
    """How flat the patches of a curved surface are, and how many there may be."""

    spread_deg: Finite
    depth: Finite
    most: int


class ObjectRecord(_Record):
    """The object that was planned on."""

    name: str
    source_sha256: str
    content_sha256: str
    mesh: MeshRecord
    center_of_mass_m: Triple
    patches: PatchesRecord | None = None
    """None for exact planar faces."""


class ContactRecord(_Record):
    """Where a fingertip touches."""

    position_m: Triple
    normal: Triple


class ConeRecord(_Record):
    """A force cone of the construction."""

    axis: Triple
    half_angle_deg: Finite


class RegionRecord(_Record):
    """Where a finger may stand."""

    kind: RegionKind
    polygon_m: list[Triple]
    inscribed_radius_m: Finite


class WitnessRecord(_Record):
    """Balanced forces along four lines, normal parts summing to one."""

    points_m: tuple[Triple, Triple, Triple, Triple]
    directions: tuple[Triple, Triple, Triple, Triple]
    forces: tuple[Triple, Triple, Triple, Triple]


class GraspRecord(_Record):
    """One grasp."""

    id: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,99}$")
    """Also the name of the grasp's scene file, hence no dots or slashes."""
    family: Family
    faces: tuple[int, int, int, int]
    contacts: tuple[ContactRecord, ContactRecord, ContactRecord, ContactRecord]
    focus_points_m: list[Triple]
    force_cones: tuple[ConeRecord, ConeRecord, ConeRecord, ConeRecord]
    radius_m: Finite
    regions: tuple[RegionRecord, RegionRecord, RegionRecord, RegionRecord]
    span_angle_deg: Finite
    critical_friction: Finite
    closure_margin: Finite
    ferrari_canny: tuple[Finite, Finite]
    witness: WitnessRecord


class MovedRecord(_Record):
    """How a grasp was moved on its faces, with bounds of its quality."""

    id: str
    moved_from: str
    ferrari_canny_before: tuple[Finite, Finite]
    ferrari_canny_after: tuple[Finite, Finite]
    ferrari_canny_ceiling: Finite | None


class GraspsRecord(_Record):
    """A whole `grasps.json`."""

    schema_version: Literal[1] = Field(alias="schema")
    object: ObjectRecord
    friction: Finite
    theta_deg: Finite
    seed: int
    versions: dict[str, str]
    counts: dict[str, Any]
    outcomes: dict[str, int] = Field(default_factory=dict)
    absence: str | None
    optimization: list[MovedRecord] = []
    grasps: list[GraspRecord]


@dataclass(frozen=True, slots=True, eq=False)
class SavedGrasps:
    """What a `grasps.json` says, as values."""

    body: Polyhedron
    friction: float
    seed: int
    grasps: tuple[Grasp, ...]


@dataclass(frozen=True, slots=True)
class Moved:
    """How optimisation changed the quality of a grasp."""

    id: str
    moved_from: str
    """Id of the planned grasp; the same where it stayed."""
    before: tuple[float, float]
    after: tuple[float, float]
    ceiling: float | None
    """No contacts on the same faces are better; None where that was not asked."""

    @property
    def gain(self) -> float:
        """Ratio of the proved lower bounds."""
        return self.after[0] / self.before[0]


def plan_to_json(body: Polyhedron, plan: Plan, moves: Sequence[Moved] = ()) -> str:
    """The text of `grasps.json`: the same for the same plan."""
    document: dict[str, object] = {
        "schema": SCHEMA,
        "object": {
            "name": body.name,
            "source_sha256": body.source_sha256,
            "content_sha256": body.content_sha256,
            "mesh": {
                "vertices_m": body.vertices.tolist(),
                "triangles": body.triangles.tolist(),
            },
            "center_of_mass_m": body.center_of_mass.tolist(),
            "patches": None if body.patches is None else asdict(body.patches),
        },
        "friction": plan.friction,
        "theta_deg": math.degrees(plan.theta),
        "seed": plan.seed,
        "versions": versions(),
        "counts": asdict(plan.counts),
        "outcomes": asdict(plan.outcomes),
        "absence": plan.absence,
        "optimization": [
            {
                "id": move.id,
                "moved_from": move.moved_from,
                "ferrari_canny_before": list(move.before),
                "ferrari_canny_after": list(move.after),
                "ferrari_canny_ceiling": move.ceiling,
            }
            for move in moves
        ],
        "grasps": [_grasp_to_record(grasp) for grasp in plan.grasps],
    }
    return json.dumps(document, allow_nan=False, indent=1) + "\n"


def _grasp_to_record(grasp: Grasp) -> Mapping[str, object]:
    return {
        "id": grasp.id,
        "family": grasp.family,
        "faces": list(grasp.faces),
        "contacts": [
            {"position_m": contact.position.tolist(), "normal": contact.normal.tolist()}
            for contact in grasp.contacts
        ],
        "focus_points_m": grasp.focus_points.tolist(),
        "force_cones": [
            {"axis": cone.axis.tolist(), "half_angle_deg": math.degrees(cone.half_angle)}
            for cone in grasp.force_cones
        ],
        "radius_m": grasp.radius,
        "regions": [
            {
                "kind": region.kind,
                "polygon_m": region.polygon.tolist(),
                "inscribed_radius_m": region.inscribed_radius,
            }
            for region in grasp.regions
        ],
        "span_angle_deg": math.degrees(grasp.span_angle),
        "critical_friction": grasp.critical_friction,
        "closure_margin": grasp.closure_margin,
        "ferrari_canny": list(grasp.ferrari_canny),
        "witness": {
            "points_m": grasp.witness.points.tolist(),
            "directions": grasp.witness.directions.tolist(),
            "forces": grasp.witness.forces.tolist(),
        },
    }


def grasps_from_json(text: str) -> SavedGrasps:
    """Read the text of a `grasps.json`.

    Raises:
        InputError: The text is not such a file; the message names the field.
        MeshError: Its mesh is not a solid.
    """
    try:
        record = GraspsRecord.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the document"
        raise InputError(f"grasps file: {where}: {first['msg']}") from error
    mesh, patches = record.object.mesh, record.object.patches
    body = polyhedron_from_mesh(
        mesh.vertices_m,
        mesh.triangles,
        name=record.object.name,
        source_sha256=record.object.source_sha256,
        faces="patches" if patches else "planar",
        patches=PatchLimits(**patches.model_dump()) if patches else None,
        center_of_mass=record.object.center_of_mass_m,
    )
    if body.content_sha256 != record.object.content_sha256:
        raise InputError("grasps file: object.content_sha256 does not match its mesh")
    grasps = tuple(_grasp_from_record(body, grasp, record.friction) for grasp in record.grasps)
    if len({grasp.id for grasp in grasps}) < len(grasps):
        raise InputError("grasps file: two grasps have the same id")
    return SavedGrasps(body, record.friction, record.seed, grasps)


def _grasp_from_record(body: Polyhedron, record: GraspRecord, friction: float) -> Grasp:
    grasp = Grasp(
        id=record.id,
        family=record.family,
        faces=record.faces,
        contacts=four(
            Contact(np.array(contact.position_m), np.array(contact.normal))
            for contact in record.contacts
        ),
        focus_points=np.array(record.focus_points_m).reshape(-1, 3),
        force_cones=four(
            ForceCone(np.array(cone.axis), math.radians(cone.half_angle_deg))
            for cone in record.force_cones
        ),
        regions=four(
            ContactRegion(region.kind, np.array(region.polygon_m), region.inscribed_radius_m)
            for region in record.regions
        ),
        radius=record.radius_m,
        span_angle=math.radians(record.span_angle_deg),
        critical_friction=record.critical_friction,
        closure_margin=record.closure_margin,
        ferrari_canny=record.ferrari_canny,
        witness=Witness(np.array(record.witness.points_m), np.array(record.witness.forces)),
    )
    check_on_faces(body, grasp)
    check_witness(body, grasp, friction)
    off = np.abs(grasp.witness.directions - np.array(record.witness.directions)).max()
    if off > SAME_DIRECTION:
        raise InputError(f"grasp {grasp.id}: a witness direction is not that of its force")
    return grasp
