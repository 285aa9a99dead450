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
from dataclasses import astuple, dataclass, replace
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import GraspError, InputError, UndecidedError, about
from grasp_core.files.json_text import json_of
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
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets import learning
from sim_validate.datasets.columns import Cells, figures_in
from sim_validate.datasets.config import CREDITS, SPLITS, DatasetConfig, SplitName, id_beginning
from sim_validate.datasets.open_dataset import mesh_path, mesh_text
from sim_validate.datasets.rows import (
    GIVEN,
    VARIED,
    ExecutionRow,
    GraspRow,
    ObjectRow,
    Rows,
    TrialRow,
)
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import Outcome
from sim_validate.planning.asked_objects import is_mesh_file

NO_FRICTION = 1.0
"""Friction put in for files that state none; it is never used, because a dataset's configuration
has its own."""

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class GivenGrasp:
    """Four contacts made by another tool, in the object's frame."""

    id: str
    """Name that this package gives the grasp, which may be part of a file name."""
    name: str
    """Name that the other tool's file gives the grasp."""
    points: tuple[Triple, ...]
    """Contact points, (4, 3) [m]."""
    normals: tuple[Triple, ...]
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
                {"position_m": point, "normal": normal}
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
        GivenGrasp(f"given-{i:06}", each.id, _rows(each.positions), _rows(each.normals))
        for i, each in enumerate(sets)
    )


def _rows(array: Array) -> tuple[Triple, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in array)


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
    def id(self) -> str:
        """Name of the unit: 32 hexadecimal digits, the same wherever the mesh file lies."""
        table = as_table(self.config)
        settings = {name: value for name, value in table.items() if name not in APART}
        given = json.dumps([astuple(grasp) for grasp in self.given])
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


@dataclass(frozen=True, slots=True)
class Made:
    """The rows and files of one unit of work."""

    rows: Rows
    files: Mapping[str, str]
    """Texts of the files, by their paths in the dataset's folder."""


def made_of(unit: WorkUnit, body: Polyhedron) -> Made:
    """Plan the grasps of a unit or judge the given ones, simulate them, and make their rows."""
    making = _Making(unit, body)
    if unit.given:
        making.judge()
    else:
        making.plan()
    trials, executions = tuple(making.trials), tuple(making.executions)
    rows = Rows((_object_row(body, unit),), tuple(making.grasps), trials, executions)
    return Made(rows, making.files)


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


class _Making:
    """The rows and files of a unit of work while they are made."""

    def __init__(self, unit: WorkUnit, body: Polyhedron) -> None:
        self.unit, self.body, self.config = unit, body, unit.config
        self.grasps, self.trials = list[GraspRow](), list[TrialRow]()
        self.executions = list[ExecutionRow]()
        self.files = {mesh_path(Path(), body.content_sha256).as_posix(): mesh_text(body)}
        self.agenda = Agenda(
            random_wrenches=self.config.random_wrenches, limits=self.config.limits,
            seed=self.config.seed,
        )  # fmt: skip

    def plan(self) -> None:
        """Plan the best grasps of each family separately, and simulate them."""
        config = self.config
        for family in config.families:
            planned = plan(
                self.body, self.unit.friction, families=(family,), cones=config.cones,
                limit=config.limit, seed=config.seed,
            )  # fmt: skip
            for grasp in planned.grasps:
                begun = self._begun(
                    grasp.contacts, grasp_id=self._name(grasp.id), name=grasp.id, label="grasp",
                    kind=PLANNED, family=grasp.family, faces=grasp.faces,
                    region_radius_m=grasp.radius,
                )  # fmt: skip
                self._try(begun, grasp, self.body)

    def judge(self) -> None:
        """Judge the given grasps; a grasp that cannot be simulated gets a row with the reason."""
        for given in self.unit.given:
            try:
                self._judge(given)
            except (InputError, UndecidedError) as error:
                contacts = tuple(map(Contact, np.array(given.points), np.array(given.normals)))
                row = GraspRow(**self._begun_given(given, contacts, note=str(error)))
                self.grasps.append(row)

    def _judge(self, given: GivenGrasp) -> None:
        """Try a given grasp; one that is not in force closure is a negative control."""
        seated = seat(self.body, given.points, given.normals)
        proved = grasp_of(seated, self.unit.friction, given.id)
        begun = self._begun_given(given, seated.contacts, moved_m=seated.moved_m)
        if isinstance(proved, Grasp):
            self._try(begun | {"faces": self._faces(proved)}, proved, seated.body)
        else:
            control = Control(GIVEN, self.unit.friction, proved)
            self._add_refuted(begun, try_control(seated.body, control, self.agenda, Setup()))

    def _try(self, begun: Cells, grasp: Grasp, body: Polyhedron) -> None:
        """Simulate a grasp and what is varied of it, and add all rows."""
        config, friction = self.config, self.unit.friction
        verdict = learning.validated_with(body, grasp, friction, self.agenda, config.learning)
        if config.scenes and verdict.scene is not None:
            self.files[f"scenes/{self._name(grasp.id)}.xml"] = verdict.scene.xml
        executed = learning.executed_by(config, body, grasp.contacts, friction, grasp.id)
        self._add_closed(begun, grasp, verdict, executed, body)
        if config.learning is not None:
            varying = learning.Varying(config, config.learning, friction, self.agenda)
            for each in varying.of(body, grasp, verdict, executed):
                self._add_varied(self._name(grasp.id), each)

    def _add_varied(self, made_from: str, tried: learning.Tried) -> None:
        """Add the row of a grasp that was varied, with its trials; it may be closed or not."""
        variant, verdict, proved = tried.variant, tried.verdict, tried.variant.proved
        begun = self._begun(
            variant.seated.contacts,
            grasp_id=f"{made_from}:{variant.name}",
            name=variant.name,
            label=VARIED,
            kind=variant.kind,
            made_from=made_from,
            friction=variant.friction,
            displaced_m=variant.displaced_m,
            region_exit_m=variant.exits_m,
            mass_ratio=variant.mass_ratio,
        )
        if isinstance(verdict, ControlVerdict):
            begun |= {"critical_friction": variant.critical_friction}
            self._add_refuted(begun, verdict, tried.executed)
        else:
            assert isinstance(proved, Grasp)  # noqa: S101 - only closed ones have verdicts
            begun |= {"faces": self._faces(proved)}
            self._add_closed(begun, proved, verdict, tried.executed, variant.seated.body)

    def _begun(self, contacts: Sequence[Contact], **more: Any) -> dict[str, Any]:
        """Return the cells that are known of any contacts, and more."""
        return {
            "object_id": self.body.content_sha256,
            "split": split_of(self.body.content_sha256, self.config.seed),
            "friction": self.unit.friction,
            "contacts": len(contacts),
            "contact_points_m": [contact.position.tolist() for contact in contacts],
            "contact_normals": [contact.normal.tolist() for contact in contacts],
            **learning.contact_cells(self.config, self.body, contacts),
            **more,
        }

    def _begun_given(
        self, given: GivenGrasp, contacts: Sequence[Contact], **more: Any
    ) -> dict[str, Any]:
        more |= {"grasp_id": self._name(given.id), "name": given.name}
        return self._begun(contacts, label=GIVEN, kind=GIVEN, **more)

    def _faces(self, grasp: Grasp) -> tuple[int, ...] | None:
        """Return faces of the object; on curved surfaces contacts have some made for them alone."""
        return None if self.body.patches is not None else grasp.faces

    def _name(self, grasp: str) -> str:
        """Return the name of a grasp, which no other grasp of the dataset has."""
        return id_beginning(self.body.content_sha256, self.unit.friction) + grasp

    def _add_closed(
        self, begun: Cells, grasp: Grasp, verdict: Verdict, executed: learning.Executed,
        body: Polyhedron,
    ) -> None:  # fmt: skip
        """Add the rows of a grasp in force closure, of its negative controls, and of all trials."""
        proved = {
            "force_closed": True,
            "closure_margin": grasp.closure_margin,
            "critical_friction": grasp.critical_friction,
            "region_kind": grasp.regions[0].kind,
            "region_radii_m": [region.inscribed_radius for region in grasp.regions],
            "ferrari_canny_lower_n": grasp.ferrari_canny[0],
            "ferrari_canny_upper_n": grasp.ferrari_canny[1],
            "held": verdict.held,
            "outcome": verdict.outcome.value,
            "trials": len(verdict.wrenches),
            "mismatches": len(verdict.mismatches),
            "verdict": figures_in(GraspRow, "verdict", verdict),
            **learning.closed_cells(self.config, body, grasp, verdict.friction),
        }
        row = self._added(proved | {**begun}, verdict.wrenches, executed, body)
        for each in verdict.controls:
            kind = each.control.name
            refuted = self._begun(
                each.control.contacts, grasp_id=f"{row.grasp_id}:{kind}", name=row.name,
                label=kind, kind=kind, control_of=row.grasp_id,
            )  # fmt: skip
            self._add_refuted(refuted, each)

    def _add_refuted(
        self, begun: Cells, verdict: ControlVerdict, executed: learning.Executed = None
    ) -> None:
        """Add the rows of contacts that are proved not to be in force closure, and their trials."""
        control = verdict.control
        first = next((t for t in verdict.tried if t.hold.outcome is not Outcome.HELD), None)
        refuted = {
            "friction": control.friction,
            "force_closed": False,
            "closure_margin": control.certificate.margin,
            "held": first is None,
            "outcome": (Outcome.HELD if first is None else first.hold.outcome).value,
            "trials": len(verdict.tried),
            "mismatches": int(not verdict.let_go),
        }
        self._added({**begun, **refuted}, verdict.tried, executed, self.body)

    def _added(
        self, cells: Cells, tried: Sequence[WrenchVerdict] | Sequence[ControlTrial],
        executed: learning.Executed, body: Polyhedron,
    ) -> GraspRow:  # fmt: skip
        """Add a row with what its execution found, and the rows of its trials."""
        ratio = learning.ratio_of(cells["friction"], cells.get("critical_friction"))
        row = GraspRow(**cells, **learning.execution_cells(executed), friction_ratio=ratio)
        if row.mass_kg is not None:
            more = learning.squeeze_cells(self.config, body, row.placed, row.friction, row.mass_kg)
            row = replace(row, **more)
        self.grasps.append(row)
        self.trials += [_trial_row(row.grasp_id, number, each) for number, each in enumerate(tried)]
        self.executions += learning.execution_rows(row.grasp_id, executed, self.config)
        return row


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
        verdict=figures_in(TrialRow, "verdict", planned),
    )
