"""Makes the rows of one unit of work: grasps are planned or given, then simulated."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.errors import InputError, UnfaithfulError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import grasp_of, seat
from grasp_core.planning.planner import plan
from grasp_core.planning.settings import PlanSettings
from grasp_core.values import Contact, Grasp
from sim_validate.closure.controls import Control, ControlTrial, ControlVerdict, try_control
from sim_validate.closure.validate import tested
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets import learning
from sim_validate.datasets.columns import (
    FROM_TOOL,
    VARIED,
    DatasetRows,
    ExecutionRow,
    GraspRow,
    ObjectRow,
    TrialRow,
    VerdictCells,
)
from sim_validate.datasets.config import HAND, SPLITS, SplitName, id_beginning
from sim_validate.datasets.given_grasps import GraspToJudge
from sim_validate.datasets.hand_files import kept_hand
from sim_validate.datasets.hand_work import hand_cells
from sim_validate.datasets.layout import SCENE_FOLDER
from sim_validate.datasets.open_dataset import mesh_path, mesh_text
from sim_validate.datasets.parquet import RowCells
from sim_validate.datasets.work_units import WorkUnit
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.processes.own_faults import OWN_FAULTS

PLANNED_KIND = "planned"


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
    body: Polyhedron
    contacts: Sequence[Contact]
    proved: Grasp | ClosureCertificate
    verdict: Verdict | ControlVerdict
    executed: learning.Executed = None

    @property
    def cells(self) -> RowCells:
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


def compute_rows(unit: WorkUnit, body: Polyhedron) -> "UnitRows":
    """Plan the grasps of a unit or judge the given ones, simulate them, and make their rows."""
    made = UnitRows(unit, body)
    if unit.given:
        made.add_given()
    else:
        made.add_planned()
    return made


class UnitRows:
    """The rows and files of a unit of work, to which its grasps are added one by one."""

    def __init__(self, unit: WorkUnit, body: Polyhedron) -> None:
        self.unit, self.body, self.config = unit, body, unit.config
        self.hand = None if unit.hand is None else kept_hand(unit.hand)
        self.grasps, self.trials = list[GraspRow](), list[TrialRow]()
        self.executions = list[ExecutionRow]()
        # texts of the files, by their paths in the dataset's folder
        self.files = {mesh_path(Path(), body.content_sha256).as_posix(): mesh_text(body)}
        self.agenda = Agenda(
            random_wrenches=self.config.random_wrenches, limits=self.config.limits,
            seed=self.config.seed,
        )  # fmt: skip

    @property
    def rows(self) -> DatasetRows:
        """The rows of all tables."""
        own = _object_row(self.body, self.unit)
        return DatasetRows((own,), tuple(self.grasps), tuple(self.trials), tuple(self.executions))

    def add_planned(self) -> None:
        """Plan the best grasps of each family separately, and simulate them."""
        config = self.config
        for family in config.families:
            wanted = PlanSettings(
                self.unit.friction, (family,), cones=config.cones, limit=config.limit,
                seed=config.seed,
            )  # fmt: skip
            planned = plan(self.body, settings=wanted)
            for grasp in planned.grasps:
                cells: RowCells = {
                    "grasp_id": self._name(grasp.id), "name": grasp.id,
                    "label": "grasp", "kind": PLANNED_KIND, "family": grasp.family,
                    "faces": grasp.faces, "region_radius_m": grasp.radius,
                }  # fmt: skip
                try:
                    self._add_closed(grasp, self.body, **cells)
                except OWN_FAULTS as error:
                    self._add_untried(grasp.contacts, error, cells)

    def add_given(self) -> None:
        """Judge the given grasps; a grasp that cannot be simulated gets a row with the reason."""
        for given in self.unit.given:
            cells: RowCells = {
                "grasp_id": self._name(given.id), "name": given.name,
                "label": FROM_TOOL, "kind": FROM_TOOL,
            }  # fmt: skip
            try:
                self._add_one_given(given, cells)
            except OWN_FAULTS as error:
                self._add_untried(tuple(map(Contact, given.points, given.normals)), error, cells)

    def _add_untried(self, contacts: Sequence[Contact], error: Exception, cells: RowCells) -> None:
        self.grasps.append(GraspRow(**self._about(contacts), **cells, note=str(error)))

    def _add_one_given(self, given: GraspToJudge, cells: RowCells) -> None:
        """Try a given grasp; one that is not in force closure is a negative control."""
        at = seat(self.body, given.points, given.normals)
        proved = grasp_of(at, self.unit.friction, given.id)
        if isinstance(proved, Grasp):
            self._add_closed(
                proved, at.body, **cells, moved_m=at.moved_m, faces=self._faces(proved)
            )
        else:
            control = Control(FROM_TOOL, self.unit.friction, proved)
            verdict = try_control(at.body, control, self.agenda, Setup())
            tried = _Tried(at.body, at.contacts, proved, verdict)
            self._add_row(tried, **cells, moved_m=at.moved_m)

    def _add_closed(self, grasp: Grasp, body: Polyhedron, **cells: Any) -> None:
        config, friction, name = self.config, self.unit.friction, cells["grasp_id"]
        asked, seed = config.asked, config.seed
        verdict = learning.validated_with(body, grasp, friction, self.agenda, asked.synthetic)
        if config.scenes and verdict.scene is not None:
            self.files[f"{SCENE_FOLDER}/{name}.xml"] = verdict.scene.xml
        executed = learning.executed_by(config, body, grasp.contacts, friction, grasp.id)
        self._add_row(_Tried(body, grasp.contacts, grasp, verdict, executed), **cells)
        varied = chain(
            learning.variants(body, grasp, friction, asked, seed),
            learning.heavier(body, grasp, friction, executed, asked, seed),
        )
        for each in varied:
            try:
                tried = self._tried_variant(each, verdict)
            except InputError:  # fingertips find no room
                continue
            self._add_row(
                tried, **each.cells, grasp_id=f"{name}:{each.name}", name=each.name, label=VARIED,
                made_from=name, faces=self._faces(each.proved),
            )  # fmt: skip

    def _tried_variant(self, variant: learning.Variant, source: Verdict) -> _Tried:
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

    def _about(self, contacts: Sequence[Contact]) -> RowCells:
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
        return id_beginning(self.body.content_sha256, self.unit.friction) + grasp

    def _add_row(self, tried: _Tried, **cells: Any) -> None:
        body, verdict, proved = tried.body, tried.verdict, tried.proved
        cells = {**self._about(tried.contacts), **cells, **tried.cells}
        if isinstance(proved, Grasp):
            cells |= learning.placement_cells(self.config, body, proved, cells["friction"])
            cells |= self._hand_cells(body, proved, cells)
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
            self._add_row(
                _Tried(body, each.control.contacts, proof, each), name=row.name, label=kind,
                grasp_id=f"{row.grasp_id}:{kind}", kind=kind, control_of=row.grasp_id,
            )  # fmt: skip

    def _hand_cells(self, body: Polyhedron, grasp: Grasp, cells: RowCells) -> RowCells:
        """Return what the hand does in a grasp; in varied grasps it only looks for a pose."""
        if self.hand is None:
            return {}
        simulated = cells["label"] != VARIED
        return {HAND: hand_cells(
            self.hand, self.config, body, grasp, cells["friction"], simulated=simulated
        )}  # fmt: skip


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
