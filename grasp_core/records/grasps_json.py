"""Writes grasps as JSON text with units in the keys, and reads it back, checking every field.

The file holds the object's mesh, so that grasps can be validated from it alone. The schema is
imported only where a file is read: plans are written without it.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grasp_core.checked import instance, path_of
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import text_of
from grasp_core.files.text_files import read_text, write_text
from grasp_core.frames import radians_of
from grasp_core.mesh_files.limits import MeshChoices, MeshLimits, PatchLimits
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from grasp_core.planning.certify import check_witness, find_critical_frictions
from grasp_core.planning.reach import Finger
from grasp_core.planning.result import MethodCounts, Moved, Outcomes, Plan, PlanCounts
from grasp_core.provenance import versions
from grasp_core.settings import extended
from grasp_core.values import Contact, ContactRegion, ForceCone, Grasp, Witness, four

if TYPE_CHECKING:
    from grasp_core.records.grasps_schema import GraspRecord, GraspsRecord, SurfaceRecord

SCHEMA = 1
SAME_DIRECTION = 1e-6
"""Largest distance between the unit vectors of a witness line and of its force: files that keep six
digits stay within it."""

RECORDED = MeshLimits(max_triangles=2_000_000, max_faces=50_000, max_parts=640)
"""Limits for the meshes in grasps files: ten times the usual, for users who raised a limit."""


def plan_to_json(body: Polyhedron, plan: Plan) -> str:
    """Write a plan as the text of a `grasps.json`; equal plans give equal text."""
    find_critical_frictions(plan.grasps)
    document: dict[str, object] = {
        "schema": SCHEMA,
        "object": {
            "name": body.name,
            "source_sha256": body.source_sha256,
            "content_sha256": body.content_sha256,
            "mesh": {"vertices_m": body.vertices.tolist(), "triangles": body.triangles.tolist()},
            "center_of_mass_m": body.center_of_mass.tolist(),
            "surface": surface_record(body.surface),
            "patches": None if body.patches is None else asdict(body.patches),
        },
        "friction": plan.friction,
        "theta_deg": math.degrees(plan.theta),
        "seed": plan.seed,
        "finger": None if plan.finger is None else asdict(plan.finger),
        "versions": versions() if plan.versions is None else dict(plan.versions),
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
            for move in plan.moves
        ],
        "grasps": [_grasp_to_record(grasp) for grasp in plan.grasps],
    }
    return text_of(document)


def surface_record(surface: Surface) -> dict[str, object]:
    """Return what is known of a surface as the fields of a `SurfaceRecord`."""
    return {**asdict(surface), "caps": surface.caps.tolist(), "repairs": list(surface.repairs)}


def surface_of_record(record: "SurfaceRecord") -> Surface:
    """Return what a record says of a surface."""
    fields: dict[str, Any] = record.model_dump()
    fields["repairs"] = tuple(record.repairs)
    return Surface(**fields)


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
        "approach_directions": (
            None if grasp.approach_directions is None else grasp.approach_directions.tolist()
        ),
    }


def grasps_from_json(text: str) -> Plan:
    """Read the text of a `grasps.json` as the plan that was written.

    A file keeps neither times nor what is known of face quadruples without grasps: `absences`,
    `undecided` and `unreached` are empty. Written again, the plan gives the same text.
    """
    from grasp_core.files.json_text import record_of
    from grasp_core.records.grasps_schema import GraspsRecord

    record = record_of(GraspsRecord, text, "grasps.json", schema=SCHEMA)
    body, counts, grasps = _body_of(record), record.counts, list[Grasp]()
    for place, each in enumerate(record.grasps):
        with about(f"grasps[{place}]"):
            grasps.append(_grasp_from_record(body, each, record.friction))
    if len({grasp.id for grasp in grasps}) < len(grasps):
        raise InputError("grasps: two grasps have the same id; ids must differ")
    return Plan(
        body=body,
        grasps=tuple(grasps),
        friction=record.friction,
        theta=radians_of(record.theta_deg),
        seed=record.seed,
        counts=PlanCounts(
            counts.faces,
            counts.quadruples,
            counts.spanning,
            {name: MethodCounts(**each.model_dump()) for name, each in counts.families.items()},
        ),
        outcomes=Outcomes(**record.outcomes.model_dump()),
        absence=record.absence,
        finger=None if record.finger is None else Finger(**record.finger.model_dump()),
        moves=tuple(Moved(*move.model_dump().values()) for move in record.optimization),
        versions=record.versions,
    )


def _body_of(record: "GraspsRecord") -> Polyhedron:
    mesh, patches = record.object.mesh, record.object.patches
    choices = extended(
        MeshChoices,
        RECORDED,
        faces="patches" if patches else "planar",
        patches=PatchLimits(**patches.model_dump()) if patches else PatchLimits(),
    )
    body = polyhedron_from_mesh(
        mesh.vertices_m,
        mesh.triangles,
        choices,
        name=record.object.name,
        source_sha256=record.object.source_sha256,
        center_of_mass=record.object.center_of_mass_m,
        known=surface_of_record(record.object.surface),
    )
    if body.content_sha256 != record.object.content_sha256:
        raise InputError(
            "object.content_sha256: the hash does not fit the mesh in the file; plan again"
        )
    return body


def _grasp_from_record(body: Polyhedron, record: "GraspRecord", friction: float) -> Grasp:
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
            ForceCone(np.array(cone.axis), radians_of(cone.half_angle_deg))
            for cone in record.force_cones
        ),
        regions=four(
            ContactRegion(region.kind, np.array(region.polygon_m), region.inscribed_radius_m)
            for region in record.regions
        ),
        radius=record.radius_m,
        span_angle=radians_of(record.span_angle_deg),
        critical_friction=record.critical_friction,
        closure_margin=record.closure_margin,
        ferrari_canny=record.ferrari_canny,
        witness=Witness(np.array(record.witness.points_m), np.array(record.witness.forces)),
        approach_directions=(
            None if record.approach_directions is None else np.array(record.approach_directions)
        ),
    )
    check_on_faces(body, grasp)
    check_witness(body, grasp, friction)
    off = np.abs(grasp.witness.directions - np.array(record.witness.directions)).max()
    if off > SAME_DIRECTION:
        raise InputError(
            f"grasp {grasp.id}: a witness line does not run along its force; plan again"
        )
    return grasp


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
