"""Writes plans as JSON text with units in the keys, and reads plans and contacts, all checked.

The fields of `Plan`, `Grasp` and the values in them are those of the file. It holds the object's
mesh, so that grasps can be validated from it alone.

A contacts file is JSON: `{"contacts": [...]}` for one grasp, or `{"grasps": [{"id": ...,
"contacts": [...]}, ...]}`, where a contact is `{"position_m": [3], "normal": [3]}` and perhaps
`"friction"`. Beside the list, `friction`, `center_m` and `torque_scale_m` may be given for all.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from annotated_types import Interval, Len
from pydantic import Field

from grasp_core.allowed_values import (
    FLAT,
    LARGEST,
    LARGEST_FRICTION,
    SMALLEST,
    FrictionOrZero,
    Quantity,
    instance,
    path_of,
)
from grasp_core.arrays import Array, Indices, Point, Shape
from grasp_core.closure.contacts import contact_frictions
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.figures import Shown
from grasp_core.files.file_kinds import CONTACTS_FILE, GRASPS
from grasp_core.files.json_text import json_of, object_of, shown, text_of
from grasp_core.files.records import RecordFile, from_record
from grasp_core.files.text_files import read_text, write_text
from grasp_core.mesh_files.limits import MeshLimits, PatchLimits
from grasp_core.objects.build import MeshChoices
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from grasp_core.planning.certify import check_witness, find_critical_frictions
from grasp_core.planning.result import Plan
from grasp_core.provenance import versions
from grasp_core.settings import extended

SCHEMA = 2
GRASP_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
"""Ids of grasps in files: they also name scene files, so they have no dots or slashes."""
RECORDED = MeshLimits(max_triangles=2_000_000, max_faces=50_000, max_parts=640)
"""Limits for the meshes in grasps files: ten times the usual, for users who raised a limit."""


@declared
class SavedMesh(Declared):
    """The triangles of an object in a file."""

    vertices_m: Annotated[Array, Shape(None, 3)]
    triangles: Annotated[Indices, Shape(None, 3, whole=True)]


@declared
class RecordedObject(Declared):
    """What a file says of the object that grasps were planned on."""

    name: str
    source_sha256: str
    content_sha256: str
    mesh: SavedMesh
    center_of_mass_m: Point
    surface: Surface = field(default_factory=Surface)
    patches: PatchLimits | None = None

    @classmethod
    def of(cls, body: Polyhedron) -> "RecordedObject":
        """Record an object."""
        return cls(
            body.name, body.source_sha256, body.content_sha256,
            SavedMesh(body.vertices, body.triangles), body.center_of_mass, body.surface,
            body.patches,
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


@declared
class SavedGrasps(RecordFile):
    """Grasps of an object, with its mesh and what is known of all sets of its faces."""

    FILE = GRASPS
    SCHEMA = SCHEMA

    object: RecordedObject
    plan: Annotated[Plan, FLAT]


def plan_to_json(body: Polyhedron, plan: Plan) -> str:
    """Write a plan as the text of a `grasps.json`; equal plans give equal text."""
    find_critical_frictions(plan.grasps)
    said = SavedGrasps(RecordedObject.of(body), plan).document()
    said["versions"] = said["versions"] or versions()
    said["grasps"] = said.pop("grasps")  # last in the file, a line each
    return text_of(said)


def grasps_from_json(text: str) -> Plan:
    """Read a `grasps.json` as the plan that was written, without what files do not keep."""
    found = object_of(text, GRASPS, schema=SCHEMA)
    del found["schema"]
    body = from_record(RecordedObject, found.pop("object", None), "object").body()
    plan = from_record(Plan, found, body=body)
    if plan.versions is None:
        raise InputError("versions: missing; add those of the packages that made the grasps")
    for place, grasp in enumerate(plan.grasps):
        with about(f"grasps[{place}]"):
            if not GRASP_ID.fullmatch(grasp.id):
                raise InputError(
                    "id: expected up to 100 letters, digits, '_' and '-', as it names files as "
                    f"well, got {shown(grasp.id)}"
                )
            check_on_faces(body, grasp)
            check_witness(body, grasp, plan.friction)
    if len({grasp.id for grasp in plan.grasps}) < len(plan.grasps):
        raise InputError("grasps: two grasps have the same id; ids must differ")
    return plan


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


FEWEST_CONTACTS = 2
MOST_CONTACTS = 100
"""Most contacts of one grasp: a hundred take seconds, most of them for the hull's volume."""
MOST_GRASPS = 100_000
"""Largest number of grasps in one file: two hours of work for one processor."""
LARGEST_LENGTH_M = 1e6
"""Largest length [m]: longer ones are mistakes, and their squares might overflow."""
LONGEST_ID = 100
NEARLY_UNIT = 1e-3
"""How far the length of a normal may be from 1: rounding of a file with three digits."""
UNIT_ROUNDING = 1e-15
"""How far rounding takes the length of a unit vector from 1."""
SAME_CONTACT_POINT = 1e-9
"""Distance below which contacts are at one point, over the numbers in the file: rounding."""

CenterSource: TypeAlias = Literal["file", "mean contact", "center of mass"]
ScaleSource: TypeAlias = Literal["flag", "file", "farthest contact", "object radius"]

Coordinates = Annotated[Array, Shape(3, least=-LARGEST_LENGTH_M, most=LARGEST_LENGTH_M)]
SavedLength = Annotated[float, Interval(gt=0.0, le=LARGEST_LENGTH_M)]


@declared
class GivenContact(Declared):
    """A contact in a file; its normal need not be exactly of length one."""

    position_m: Coordinates
    """Point on the surface, in the object's frame."""
    normal: Coordinates
    """Vector of length one into the object, or out of it with `--outward`."""
    friction: FrictionOrZero | None = None
    """Coulomb coefficient; if not given, that of the file, or of `--friction`."""


GivenContacts = Annotated[tuple[GivenContact, ...], Len(FEWEST_CONTACTS, MOST_CONTACTS)]


@declared
class SavedGrasp(Declared):
    """A grasp in a file."""

    contacts: GivenContacts
    """The contacts of the grasp."""
    id: Annotated[str, Len(1, LONGEST_ID)] | None = None
    """Name of the grasp; if not given, its place in the list, from 0."""


@declared
class ContactsFile(Declared):
    """A contacts file: the contacts of one grasp, or several grasps."""

    contacts: GivenContacts | None = None
    """The contacts of the only grasp, in place of `grasps`."""
    grasps: Annotated[tuple[SavedGrasp, ...], Len(1, MOST_GRASPS)] | None = None
    """Several grasps, in place of `contacts`."""
    friction: FrictionOrZero | None = None
    """Coulomb coefficient of contacts without their own."""
    center_m: Coordinates | None = None
    """Point about which torques are taken; if not given, the mean contact of each grasp."""
    torque_scale_m: SavedLength | None = None
    """Length that makes a torque comparable with a force; if not given, the largest distance of a
    contact from the point about which torques are taken."""

    def _check_together(self) -> None:
        if (self.contacts is None) == (self.grasps is None):
            raise InputError(
                'the file must have either the key "contacts" (one grasp) or "grasps" (several)'
            )


@declared
class ContactSet(Declared):
    """The contacts of one grasp, with the centre and the length by which torques are measured."""

    id: Annotated[str, Shown("grasp")]
    positions: Annotated[Array, Shape("k", 3), Field(alias="positions_m")]
    """Contact points, (k, 3) [m], k >= 2."""
    normals: Annotated[Array, Shape("k", 3, units=True)]
    """Unit vectors into the object, (k, 3)."""
    friction: Annotated[Array, Shape("k", least=0.0, most=LARGEST_FRICTION)]
    """Coulomb coefficients, (k,)."""
    center: Annotated[Array, Shape(3), Field(alias="center_m")]
    """Point about which torques are taken, (3,) [m]."""
    torque_scale: Annotated[Quantity, Field(alias="torque_scale_m")]
    """Length that makes a torque comparable with a force [m]."""
    center_from: CenterSource
    torque_scale_from: ScaleSource


@dataclass(frozen=True, slots=True)
class Overrides:
    """Values that a user gives in place of those in a contacts file."""

    friction: float | None = None
    """Friction of contacts that have no friction of their own, in place of the file's."""
    torque_scale: float | None = None
    """Torque scale [m], in place of the file's or of the object's radius."""
    outward: bool = False  # whether the file's normals point out of the object


def contact_sets_from_json(text: str, overrides: Overrides = Overrides()) -> tuple[ContactSet, ...]:
    """Read the text of a contacts file or of a `grasps.json`.

    Without a centre in the file, torques are taken about the mean contact (about the centre of mass
    for a `grasps.json`). Without a torque scale, the largest distance of a contact from that centre
    makes torques comparable with forces (the object's radius for a `grasps.json`).
    """
    found = json_of(text)
    if isinstance(found, dict) and "schema" in found and "contacts" not in found:
        return _planned(text, overrides)
    return given_contact_sets(object_of(text, CONTACTS_FILE), overrides)


def given_contact_sets(
    found: dict[str, Any], overrides: Overrides = Overrides()
) -> tuple[ContactSet, ...]:
    """Make contact sets of the object in a contacts file (see `contact_sets_from_json`)."""
    file = from_record(ContactsFile, found)
    if file.contacts is not None:
        return (_contact_set(file, file.contacts, "0", "contacts", overrides),)
    listed = file.grasps or ()
    ids = [str(i) if grasp.id is None else grasp.id for i, grasp in enumerate(listed)]
    first: dict[str, int] = {}
    for i, name in enumerate(ids):
        if first.setdefault(name, i) != i:
            raise InputError(
                f"grasps[{i}].id: {name!r} is also that of grasps[{first[name]}]; ids must differ, "
                "and a grasp without one gets its index"
            )
    return tuple(
        _contact_set(file, grasp.contacts, ids[i], f"grasps[{i}].contacts", overrides)
        for i, grasp in enumerate(listed)
    )


def _planned(text: str, overrides: Overrides) -> tuple[ContactSet, ...]:
    if overrides.outward:
        raise InputError("the normals of a grasps.json point into the object: leave out --outward")
    saved = grasps_from_json(text)
    if not saved.grasps:
        raise InputError("grasps: the list is empty; give at least one grasp")
    friction = saved.friction if overrides.friction is None else overrides.friction
    scale, source = _first((overrides.torque_scale, "flag"), (saved.body.radius, "object radius"))
    return tuple(
        ContactSet(
            id=grasp.id,
            positions=grasp.positions,
            normals=grasp.normals,
            friction=contact_frictions(friction, len(grasp.contacts)),
            center=saved.body.center_of_mass,
            torque_scale=scale,
            center_from="center of mass",
            torque_scale_from=source,
        )
        for grasp in saved.grasps
    )


def _contact_set(
    file: ContactsFile, contacts: tuple[GivenContact, ...], name: str, where: str, flags: Overrides
) -> ContactSet:
    positions = np.array([contact.position_m for contact in contacts])
    given = file.center_m
    center = positions.mean(axis=0) if given is None else given
    extent = float(np.linalg.norm(positions - positions.mean(axis=0), axis=1).max())
    largest = float(max(np.abs(positions).max(), np.abs(center).max()))
    if extent <= SAME_CONTACT_POINT * largest:
        raise InputError(
            f"{where}: all contacts lie within {extent:.2g} m of one point, at coordinates of "
            f"{largest:.2g} m; move the contacts apart or the frame's origin nearer"
        )
    farthest = float(np.linalg.norm(positions - center, axis=1).max())
    scale, source = _first(
        (flags.torque_scale, "flag"), (file.torque_scale_m, "file"), (farthest, "farthest contact")
    )
    if not SMALLEST <= scale <= LARGEST:
        raise InputError(
            f"{where}: the contacts are {scale:.2g} m from the point about which torques are "
            f"taken, expected {SMALLEST:g} to {LARGEST:g} m; give torque_scale_m, or other units"
        )
    inward = -1.0 if flags.outward else 1.0
    return ContactSet(
        id=name,
        positions=positions,
        normals=inward * _unit_normals(contacts, where),
        friction=_frictions(file, contacts, where, flags.friction),
        center=center,
        torque_scale=scale,
        center_from="mean contact" if given is None else "file",
        torque_scale_from=source,
    )


def _unit_normals(contacts: tuple[GivenContact, ...], where: str) -> Array:
    normals = np.array([contact.normal for contact in contacts])
    lengths = np.linalg.norm(normals, axis=1)
    worst = int(np.abs(lengths - 1.0).argmax())
    if abs(lengths[worst] - 1.0) > NEARLY_UNIT:
        raise InputError(
            f"{where}[{worst}].normal: its length must be 1 within {NEARLY_UNIT:g}, got "
            f"{lengths[worst]:.6g}; divide it by its length"
        )
    off = np.abs(lengths - 1.0) > UNIT_ROUNDING  # what is a unit vector stays as it is
    return np.where(off[:, None], normals / lengths[:, None], normals)


def _frictions(
    file: ContactsFile, contacts: tuple[GivenContact, ...], where: str, flag: float | None
) -> Array:
    common = file.friction if flag is None else flag
    values = [common if contact.friction is None else contact.friction for contact in contacts]
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        raise InputError(
            f"{where}[{values.index(None)}].friction: the key is missing; give it there, as a key "
            '"friction" of the file, or with --friction'
        )
    return contact_frictions(known, len(known))


def _first(*given: tuple[float | None, ScaleSource]) -> tuple[float, ScaleSource]:
    """Return the first of several values that is given, and its source."""
    return next((value, source) for value, source in given if value is not None)
