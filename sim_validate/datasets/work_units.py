"""Splits a configuration into units of work, each of which can be computed anywhere, in any order.

A unit is one object at one friction. Its name is a hash of all that decides its rows: the bytes of
the mesh, the configuration, the versions of the packages, and this project's own code. So results
of an earlier run count exactly if they would come out the same.

Contacts that other tools made are read here; each set of four is one grasp to judge.

One unit is computed here: grasps are planned or given, simulated, and turned into rows. Rows are of
one object at one friction; its split is chosen by the hash of its mesh.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from grasp_core.arrays import Array, Shape
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.declared import Declared, declared
from grasp_core.errors import GraspError, InputError, UnfaithfulError, about
from grasp_core.files.json_text import json_of
from grasp_core.files.records import record_of
from grasp_core.files.text_files import read_text
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.given_contacts import grasp_of, seat
from grasp_core.planning.planner import plan
from grasp_core.provenance import versions
from grasp_core.records.grasps_json import Overrides, contact_sets_from_json
from grasp_core.settings import as_table
from grasp_core.values import FINGERS, Contact, Grasp
from scenes.example_objects import example_object
from sim_validate.closure.controls import Control, ControlTrial, ControlVerdict, try_control
from sim_validate.closure.validate import tested
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets import learning
from sim_validate.datasets.columns import (
    GIVEN,
    VARIED,
    ExecutionRow,
    GraspRow,
    ObjectRow,
    Rows,
    TrialRow,
    VerdictCells,
)
from sim_validate.datasets.config import CREDITS, SPLITS, DatasetConfig, SplitName, id_beginning
from sim_validate.datasets.open_dataset import mesh_path, mesh_text
from sim_validate.datasets.parquet import Cells
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import Outcome
from sim_validate.planning.asked_objects import is_mesh_file
from sim_validate.processes.own_faults import OWN_FAULTS

NO_FRICTION = 1.0
"""Friction put in for files that state none; it is never used, because a dataset's configuration
has its own."""


@declared
class GivenGrasp(Declared):
    """Four contacts made by another tool, in the object's frame."""

    id: str
    """Name that this package gives the grasp, which may be part of a file name."""
    name: str
    """Name that the other tool's file gives the grasp."""
    points: Annotated[Array, Shape(FINGERS, 3)]
    """Contact points, (4, 3) [m]."""
    normals: Annotated[Array, Shape(FINGERS, 3)]
    """Unit vectors into the object, (4, 3)."""


def read_given(path: Path, *, outward: bool = False) -> tuple[GivenGrasp, ...]:
    """Read contacts made by other tools."""
    text = read_text(path)
    with about(path):
        return given_from_json(text, outward=outward)


def given_text(given: Sequence[GivenGrasp]) -> str:
    """Write given grasps as a contacts file, with normals into the object."""
    grasps = [
        {
            "id": grasp.name,
            "contacts": [
                {"position_m": point.tolist(), "normal": normal.tolist()}
                for point, normal in zip(grasp.points, grasp.normals, strict=True)
            ],
        }
        for grasp in given
    ]
    return json.dumps({"grasps": grasps}, indent=1) + "\n"


def given_from_json(text: str, *, outward: bool = False) -> tuple[GivenGrasp, ...]:
    """Parse contacts to judge from the text of a contacts file."""
    sets = contact_sets_from_json(text, Overrides(NO_FRICTION, outward=outward))
    stated = json_of(text)
    planned = "schema" in stated  # graspproof planned these, and they may be judged at any friction
    remedy = "friction: remove it from the contacts file, because a dataset has its own frictions"
    if not planned and "friction" in stated:
        raise InputError(remedy)
    for row, each in enumerate(sets):
        if not planned and (each.friction != NO_FRICTION).any():
            raise InputError(f"grasps[{row}] ({each.id}): {remedy}")
        if len(each.positions) != FINGERS:
            raise InputError(
                f"grasps[{row}] ({each.id}): expected 4 contacts, got {len(each.positions)}"
            )
    return tuple(
        GivenGrasp(f"given-{i:06}", each.id, each.positions, each.normals)
        for i, each in enumerate(sets)
    )


PART = 25
"""Largest number of given grasps in one unit, which take half a minute."""
PACKAGES = ("grasp_core", "scenes", "sim_validate")
APART = ("objects", "frictions", "contacts", "outward", *CREDITS)
"""Settings that differ between units, or that decide no row."""


class WorkerError(GraspError):
    """Error of a worker process that cannot compute units of work."""


@dataclass(frozen=True, slots=True)
class WorkUnit:
    """One object at one friction, with some of the given grasps if there are any."""

    object: str
    """A mesh file as it was given, or the name of a built-in object."""
    path: Path | None
    """Absolute path of the mesh file; None for built-in objects."""
    source_sha256: str
    """Hash of the mesh file's bytes, or of the built-in object's mesh."""
    friction: float
    config: DatasetConfig
    given: tuple[GivenGrasp, ...] = ()
    """Grasps to judge; empty if grasps are to be planned."""

    @property
    def label(self) -> str:
        """Name of the object in files: as it was given, or the file's name if that is absolute.

        So the files do not depend on where a machine has its meshes.
        """
        return Path(self.object).name if Path(self.object).is_absolute() else self.object

    @property
    def id(self) -> str:
        """Name of the unit: 32 hexadecimal digits, the same wherever the mesh file lies."""
        table = as_table(self.config)
        settings = {name: value for name, value in table.items() if name not in APART}
        given = json.dumps([record_of(grasp) for grasp in self.given])
        digest = hashlib.sha256(given.encode()).hexdigest()
        own = sorted(provenance().items())
        decisive = [self.source_sha256, self.friction, digest, settings, own]
        return hashlib.sha256(json.dumps(decisive).encode()).hexdigest()[:32]


def units_sha256(units: Iterable[WorkUnit]) -> str:
    """Hash the names of units; two hashes are equal only if all rows come out the same."""
    return hashlib.sha256("".join(sorted(unit.id for unit in units)).encode()).hexdigest()


@cache
def provenance() -> Mapping[str, str]:
    """List the versions of all packages, and the hash of this project's own code.

    Apart from these, results depend only on how the processor rounds.
    """
    digest = hashlib.sha256()
    for package in PACKAGES:
        root = Path(str(files(package)))
        for path in sorted(root.rglob("*.py")):
            digest.update(f"{package}/{path.relative_to(root).as_posix()}\n".encode())
            digest.update(path.read_bytes())
    more = {"pyarrow": version("pyarrow"), "code_sha256": digest.hexdigest()}
    return MappingProxyType(versions() | more)


def units_of(config: DatasetConfig) -> list[WorkUnit]:
    """Split a configuration into units of work, each one object at one friction, sorted by name."""
    hashes = {name: _source_sha256(name) for name in config.objects}
    paths = {name: Path(name).resolve() if is_mesh_file(name) else None for name in hashes}
    parts: list[tuple[GivenGrasp, ...]] = [()]
    if config.contacts:
        given = read_given(Path(config.contacts), outward=config.outward)
        parts = [given[i : i + PART] for i in range(0, len(given), PART)]
    units = [
        WorkUnit(
            name, paths[name], hashes[name], friction,
            replace(config, objects=(name,), frictions=(friction,)), part,
        )
        for name in config.objects
        for friction in config.frictions
        for part in parts
    ]  # fmt: skip
    return sorted(units, key=lambda unit: unit.id)


def body_of(unit: WorkUnit) -> Polyhedron:
    """Load the object of a unit."""
    config = unit.config
    if unit.path is None:
        return example_object(unit.object)
    if not unit.path.is_file():
        raise WorkerError(
            f"{unit.path}: a worker process cannot find this mesh; all processes must share a "
            "file system"
        )
    if _source_sha256(str(unit.path)) != unit.source_sha256:
        raise WorkerError(
            f"{unit.path}: this mesh has changed since the build began; start the build again"
        )
    return load_polyhedron(unit.path, unit=config.unit, scale=config.scale, faces=config.faces)


def _source_sha256(name: str) -> str:
    if not is_mesh_file(name):
        return example_object(name).content_sha256
    try:
        with Path(name).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{name}: the mesh file cannot be read ({error.strerror})") from error


PLANNED = "planned"
"""Kind of the grasps that were planned for their friction."""


def split_of(object_id: str, seed: int) -> SplitName:
    """Choose the split of an object by its hash, so that adding objects moves no other object."""
    digest = hashlib.sha256(f"{seed} {object_id}".encode()).digest()
    share = int.from_bytes(digest[:8], "big") / 2.0**64
    return next(name for name, upto in SPLITS if share < upto)


def _object_row(body: Polyhedron, unit: WorkUnit) -> ObjectRow:
    return ObjectRow(
        object_id=body.content_sha256,
        source_name=Path(unit.object).name,
        source_sha256=unit.source_sha256,
        split=split_of(body.content_sha256, unit.config.seed),
        vertices=len(body.vertices),
        triangles=len(body.triangles),
        faces=len(body.faces),
        curved=body.patches is not None,
        volume_m3=body.volume,
        volume_source=body.surface.volume_source,
        radius_m=body.radius,
        center_of_mass_m=body.center_of_mass,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Tried:
    """Contacts with their trials and their execution."""

    body: Polyhedron
    contacts: Sequence[Contact]
    proved: Grasp | ClosureCertificate
    verdict: Verdict | ControlVerdict
    executed: learning.Executed = None

    @property
    def cells(self) -> Cells:
        """What proof and trials say in a row."""
        verdict, proved = self.verdict, self.proved
        if isinstance(verdict, Verdict) and isinstance(proved, Grasp):
            return {
                "friction": verdict.friction,
                "force_closed": True,
                "closure_margin": proved.closure_margin,
                "critical_friction": proved.critical_friction,
                "region_kind": proved.regions[0].kind,
                "region_radii_m": [region.inscribed_radius for region in proved.regions],
                "ferrari_canny_lower_n": proved.ferrari_canny[0],
                "ferrari_canny_upper_n": proved.ferrari_canny[1],
                "witness_forces_n": proved.witness.forces,
                "held": verdict.held,
                "outcome": verdict.outcome.value,
                "mismatches": len(verdict.mismatches),
                "verdict": VerdictCells.of(verdict),
            }
        assert isinstance(verdict, ControlVerdict)  # noqa: S101 - only closed ones have verdicts
        ends = [each.hold.outcome for each in verdict.tried]
        outcome = next((end for end in ends if end is not Outcome.HELD), Outcome.HELD)
        return {
            "friction": verdict.control.friction,
            "force_closed": False,
            "closure_margin": verdict.control.certificate.margin,
            "held": outcome is Outcome.HELD,
            "outcome": outcome.value,
            "mismatches": int(not verdict.let_go),
        }


def made_of(unit: WorkUnit, body: Polyhedron) -> "Making":
    """Plan the grasps of a unit or judge the given ones, simulate them, and make their rows."""
    made = Making(unit, body)
    if unit.given:
        made.judge()
    else:
        made.plan()
    return made


class Making:
    """The rows and files of a unit of work, before and after they are made."""

    def __init__(self, unit: WorkUnit, body: Polyhedron) -> None:
        self.unit, self.body, self.config = unit, body, unit.config
        self.grasps, self.trials = list[GraspRow](), list[TrialRow]()
        self.executions = list[ExecutionRow]()
        # texts of the files, by their paths in the dataset's folder
        self.files = {mesh_path(Path(), body.content_sha256).as_posix(): mesh_text(body)}
        self.agenda = Agenda(
            random_wrenches=self.config.random_wrenches, limits=self.config.limits,
            seed=self.config.seed,
        )  # fmt: skip

    @property
    def rows(self) -> Rows:
        """The rows of all tables."""
        own = _object_row(self.body, self.unit)
        return Rows((own,), tuple(self.grasps), tuple(self.trials), tuple(self.executions))

    def plan(self) -> None:
        """Plan the best grasps of each family separately, and simulate them."""
        config = self.config
        for family in config.families:
            planned = plan(
                self.body, self.unit.friction, families=(family,), cones=config.cones,
                limit=config.limit, seed=config.seed,
            )  # fmt: skip
            for grasp in planned.grasps:
                cells: Cells = {
                    "grasp_id": self._name(grasp.id), "name": grasp.id,
                    "label": "grasp", "kind": PLANNED, "family": grasp.family,
                    "faces": grasp.faces, "region_radius_m": grasp.radius,
                }  # fmt: skip
                try:
                    self._try(grasp, self.body, **cells)
                except OWN_FAULTS as error:
                    self._note(grasp.contacts, error, cells)

    def judge(self) -> None:
        """Judge the given grasps; a grasp that cannot be simulated gets a row with the reason."""
        for given in self.unit.given:
            cells: Cells = {
                "grasp_id": self._name(given.id), "name": given.name, "label": GIVEN, "kind": GIVEN,
            }  # fmt: skip
            try:
                self._judge(given, cells)
            except OWN_FAULTS as error:
                self._note(tuple(map(Contact, given.points, given.normals)), error, cells)

    def _note(self, contacts: Sequence[Contact], error: Exception, cells: Cells) -> None:
        """Add the row of contacts that cannot be simulated, with the reason."""
        self.grasps.append(GraspRow(**self._about(contacts), **cells, note=str(error)))

    def _judge(self, given: GivenGrasp, cells: Cells) -> None:
        """Try a given grasp; one that is not in force closure is a negative control."""
        at = seat(self.body, given.points, given.normals)
        proved = grasp_of(at, self.unit.friction, given.id)
        if isinstance(proved, Grasp):
            self._try(proved, at.body, **cells, moved_m=at.moved_m, faces=self._faces(proved))
        else:
            control = Control(GIVEN, self.unit.friction, proved)
            verdict = try_control(at.body, control, self.agenda, Setup())
            tried = _Tried(at.body, at.contacts, proved, verdict)
            self._add(tried, **cells, moved_m=at.moved_m)

    def _try(self, grasp: Grasp, body: Polyhedron, **cells: Any) -> None:
        """Simulate a grasp and what is varied of it, and add all rows."""
        config, friction, name = self.config, self.unit.friction, cells["grasp_id"]
        asked, seed = config.asked, config.seed
        verdict = learning.validated_with(body, grasp, friction, self.agenda, asked.synthetic)
        if config.scenes and verdict.scene is not None:
            self.files[f"scenes/{name}.xml"] = verdict.scene.xml
        executed = learning.executed_by(config, body, grasp.contacts, friction, grasp.id)
        self._add(_Tried(body, grasp.contacts, grasp, verdict, executed), **cells)
        varied = chain(
            learning.variants(body, grasp, friction, asked, seed),
            learning.heavier(body, grasp, friction, executed, asked, seed),
        )
        for each in varied:
            try:
                tried = self.varied(each, verdict)
            except InputError:  # fingertips find no room
                continue
            self._add(
                tried, **each.cells, grasp_id=f"{name}:{each.name}", name=each.name, label=VARIED,
                made_from=name, faces=self._faces(each.proved),
            )  # fmt: skip

    def varied(self, variant: learning.Variant, source: Verdict) -> _Tried:
        """Simulate and execute a varied grasp; where only its mass is another, trials are kept."""
        at, friction, proved = variant.seated, variant.friction, variant.proved
        if variant.mass_kg is not None:
            verdict = replace(source, controls=())
        elif isinstance(proved, Grasp):
            agenda = replace(self.agenda, controls=False, critical_friction=False)
            verdict = tested(at.body, proved, friction, source.gate, agenda, Setup())
        else:
            control = Control(VARIED, friction, proved)
            verdict = try_control(at.body, control, self.agenda, Setup())
        try:
            executed = learning.executed_by(
                self.config, at.body, at.contacts, friction, variant.name, variant.mass_kg
            )
        except UnfaithfulError as error:
            # a varied mass or friction may be beyond what the simulator is faithful for
            executed = str(error)
        return _Tried(at.body, at.contacts, proved, verdict, executed)

    def _about(self, contacts: Sequence[Contact]) -> Cells:
        """Return the cells that are known of any contacts."""
        return {
            "object_id": self.body.content_sha256,
            "split": split_of(self.body.content_sha256, self.config.seed),
            "friction": self.unit.friction,
            "contacts": len(contacts),
            "contact_points_m": [contact.position for contact in contacts],
            "contact_normals": [contact.normal for contact in contacts],
            **learning.contact_cells(self.config, self.body, contacts),
        }

    def _faces(self, proved: Grasp | ClosureCertificate) -> tuple[int, ...] | None:
        """Return faces of the object; on curved surfaces contacts have some made for them alone."""
        planar = self.body.patches is None
        return proved.faces if planar and isinstance(proved, Grasp) else None

    def _name(self, grasp: str) -> str:
        """Return the name of a grasp, which no other grasp of the dataset has."""
        return id_beginning(self.body.content_sha256, self.unit.friction) + grasp

    def _add(self, tried: _Tried, **cells: Any) -> None:
        """Add the rows of contacts, of their trials, and of the negative controls made of them."""
        body, verdict, proved = tried.body, tried.verdict, tried.proved
        cells = {**self._about(tried.contacts), **cells, **tried.cells}
        if isinstance(proved, Grasp):
            cells |= learning.placement_cells(self.config, body, proved, cells["friction"])
            cells |= learning.hand_cells(self.config, body, proved, cells["friction"])
        closed = isinstance(verdict, Verdict)
        trials = verdict.wrenches if closed else verdict.tried
        ratio = learning.ratio_of(cells["friction"], cells.get("critical_friction"))
        executed = learning.execution_cells(tried.executed)
        row = GraspRow(**cells, **executed, trials=len(trials), friction_ratio=ratio)
        row = replace(row, **learning.squeeze_cells(self.config, body, row))
        self.grasps.append(row)
        self.trials += [_trial_row(row.grasp_id, *each) for each in enumerate(trials)]
        self.executions += learning.execution_rows(row.grasp_id, tried.executed, self.config)
        for each in verdict.controls if closed else ():
            kind, proof = each.control.name, each.control.certificate
            self._add(
                _Tried(body, each.control.contacts, proof, each), name=row.name, label=kind,
                grasp_id=f"{row.grasp_id}:{kind}", kind=kind, control_of=row.grasp_id,
            )  # fmt: skip


def _trial_row(grasp_id: str, number: int, tried: WrenchVerdict | ControlTrial) -> TrialRow:
    planned = tried if isinstance(tried, WrenchVerdict) else None
    return TrialRow(
        grasp_id=grasp_id,
        trial=number,
        name=tried.name,
        wrench_n_nm=tried.wrench,
        predicted_limit=planned and planned.predicted_limit,
        required_friction=tried.required_friction,
        hold=tried.hold,
        simulated_limit=planned and planned.simulated_limit,
    )
