"""Makes the rows of one object at one friction, and chooses its split by the hash of its mesh."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import Seated
from grasp_core.values import Contact, Grasp
from sim_validate.closure.controls import ControlTrial, ControlVerdict
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets.columns import figures_in
from sim_validate.datasets.figures import Executed, Figures, execution_cells, execution_rows
from sim_validate.datasets.given_contacts import GivenGrasp
from sim_validate.datasets.rows import GIVEN, ExecutionRow, GraspRow, ObjectRow, Rows, TrialRow
from sim_validate.datasets.tables import SPLITS, SplitName, id_beginning
from sim_validate.datasets.units import WorkUnit
from sim_validate.datasets.varied import VARIED, Tried, ratio_of
from sim_validate.engine.traces import Outcome

Begun: TypeAlias = partial[GraspRow]
"""A row with some of its cells, which lacks others."""
PLANNED = "planned"
"""Kind of the grasps that were planned for their friction."""


def split_of(object_id: str, seed: int) -> SplitName:
    """Choose the split of an object by its hash, so that adding objects moves no other object."""
    digest = hashlib.sha256(f"{seed} {object_id}".encode()).digest()
    share = int.from_bytes(digest[:8], "big") / 2.0**64
    return next(name for name, upto in SPLITS if share < upto)


def object_row(body: Polyhedron, unit: WorkUnit) -> ObjectRow:
    """Make the row of a unit's object."""
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


@dataclass(slots=True)
class MakingRows:
    """Rows of one object at one friction, while they are made."""

    body: Polyhedron
    unit: WorkUnit
    grasps: list[GraspRow] = field(default_factory=list[GraspRow])
    trials: list[TrialRow] = field(default_factory=list[TrialRow])
    executions: list[ExecutionRow] = field(default_factory=list[ExecutionRow])

    @property
    def made(self) -> Rows:
        """The rows, with that of the object."""
        row = object_row(self.body, self.unit)
        return Rows((row,), tuple(self.grasps), tuple(self.trials), tuple(self.executions))

    def add(self, grasp: Grasp, verdict: Verdict, executed: Executed = None) -> None:
        """Add the rows of a planned grasp, its negative controls, and the trials of all."""
        begun = self._begun(grasp.contacts, name=grasp.id, label="grasp", kind=PLANNED)
        begun = partial(
            begun,
            grasp_id=self.name(grasp.id),
            family=grasp.family,
            faces=grasp.faces,
            region_radius_m=grasp.radius,
        )
        self._add_closed(begun, grasp, verdict, executed, self.body)

    def add_given(
        self, given: GivenGrasp, grasp: Grasp, verdict: Verdict, seated: Seated,
        executed: Executed = None,
    ) -> None:  # fmt: skip
        """Add rows of a force-closed given grasp, its negative controls, and all trials."""
        begun = self._begun_given(given, grasp.contacts, moved_m=seated.moved_m)
        begun = partial(begun, faces=self._faces(grasp))
        self._add_closed(begun, grasp, verdict, executed, seated.body)

    def add_varied(self, made_from: str, tried: Tried) -> None:
        """Add the row of a grasp that was varied, with its trials; it may be closed or not."""
        variant, verdict = tried.variant, tried.verdict
        begun = self._begun(
            variant.seated.contacts, name=variant.name, label=VARIED, kind=variant.kind
        )
        begun = partial(
            begun,
            grasp_id=f"{self.name(made_from)}:{variant.name}",
            made_from=self.name(made_from),
            friction=variant.friction,
            friction_ratio=variant.friction_ratio,
            displaced_m=variant.displaced_m,
            region_exit_m=variant.exits_m,
            mass_ratio=variant.mass_ratio,
        )
        if isinstance(verdict, ControlVerdict):
            begun = partial(begun, critical_friction=variant.critical_friction)
            self._add_refuted(begun, verdict, tried.executed)
        else:
            assert isinstance(variant.proved, Grasp)  # noqa: S101 - only closed ones have verdicts
            begun = partial(begun, faces=self._faces(variant.proved))
            self._add_closed(begun, variant.proved, verdict, tried.executed, variant.seated.body)

    def add_open(self, given: GivenGrasp, verdict: ControlVerdict, moved_m: float) -> None:
        """Add rows of a given grasp that is not force-closed; it is a negative control."""
        begun = self._begun_given(given, verdict.control.contacts, moved_m=moved_m)
        self._add_refuted(begun, verdict)

    def add_untried(self, given: GivenGrasp, why: str) -> None:
        """Add the row of a given grasp that cannot be simulated."""
        contacts = [
            Contact(np.array(point), np.array(normal))
            for point, normal in zip(given.points, given.normals, strict=True)
        ]
        self.grasps.append(self._begun_given(given, contacts, note=why)())

    def _begun(self, contacts: Sequence[Contact], **more: Any) -> Begun:
        """Begin a row with what is known of any contacts."""
        figures = self._figures
        return partial(
            GraspRow,
            object_id=self.body.content_sha256,
            split=split_of(self.body.content_sha256, self.unit.config.seed),
            friction=self.unit.friction,
            contacts=len(contacts),
            contact_points_m=[contact.position.tolist() for contact in contacts],
            contact_normals=[contact.normal.tolist() for contact in contacts],
            **({} if figures is None else figures.of_contacts(self.body, contacts)),
            **more,
        )

    def _begun_given(self, given: GivenGrasp, contacts: Sequence[Contact], **more: Any) -> Begun:
        names = {"grasp_id": self.name(given.id), "name": given.name}
        return self._begun(contacts, label=GIVEN, kind=GIVEN, **names, **more)

    def _faces(self, grasp: Grasp) -> tuple[int, ...] | None:
        """Return faces of the object; on curved surfaces contacts have some made for them alone."""
        return None if self.body.patches is not None else grasp.faces

    def _add_closed(
        self, begun: Begun, grasp: Grasp, verdict: Verdict, executed: Executed, body: Polyhedron
    ) -> None:
        figures = self._figures
        proved = partial(
            GraspRow,
            force_closed=True,
            closure_margin=grasp.closure_margin,
            critical_friction=grasp.critical_friction,
            region_kind=grasp.regions[0].kind,
            region_radii_m=[region.inscribed_radius for region in grasp.regions],
            ferrari_canny_lower_n=grasp.ferrari_canny[0],
            ferrari_canny_upper_n=grasp.ferrari_canny[1],
            held=verdict.held,
            outcome=verdict.outcome.value,
            trials=len(verdict.wrenches),
            mismatches=len(verdict.mismatches),
            verdict=figures_in(GraspRow, "verdict", verdict),
            friction_ratio=ratio_of(verdict.friction, grasp.critical_friction),
            **({} if figures is None else figures.of_grasp(body, grasp, verdict.friction)),
        )
        row = self._added(partial(proved, **begun.keywords), verdict.wrenches, executed, body)
        for control in verdict.controls:
            kind = control.control.name
            refuted = self._begun(control.control.contacts, name=row.name, label=kind, kind=kind)
            grasp_id = f"{row.grasp_id}:{kind}"
            refuted = partial(refuted, grasp_id=grasp_id, control_of=row.grasp_id)
            self._add_refuted(refuted, control)

    def _add_refuted(
        self, begun: Begun, verdict: ControlVerdict, executed: Executed = None
    ) -> None:
        control = verdict.control
        first = next((t for t in verdict.tried if t.hold.outcome is not Outcome.HELD), None)
        begun = partial(
            begun,
            friction=control.friction,
            force_closed=False,
            closure_margin=control.certificate.margin,
            held=first is None,
            outcome=(Outcome.HELD if first is None else first.hold.outcome).value,
            trials=len(verdict.tried),
            mismatches=int(not verdict.let_go),
        )
        self._added(begun, verdict.tried, executed, self.body)

    def _added(
        self, begun: Begun, tried: Sequence[WrenchVerdict] | Sequence[ControlTrial],
        executed: Executed, body: Polyhedron,
    ) -> GraspRow:  # fmt: skip
        """Add a row with what its execution found, and the rows of its trials."""
        row = begun(**execution_cells(executed))
        figures = self._figures
        if figures is not None and row.mass_kg is not None:
            row = replace(row, **figures.of_executed(body, row.placed, row.friction, row.mass_kg))
        self.grasps.append(row)
        self.trials += [_trial_row(row.grasp_id, number, each) for number, each in enumerate(tried)]
        asked = self.unit.config.execution
        if asked is not None:
            more = () if figures is None else figures.asked.seeds
            seeds = (asked.seed, *more)
            self.executions += execution_rows(row.grasp_id, executed, seeds, asked.misplacements)
        return row

    @property
    def _figures(self) -> Figures | None:
        config = self.unit.config
        if config.learning is None:
            return None
        return Figures(config.learning, config.execution, config.seed)

    def name(self, grasp: str) -> str:
        """Return the name of a grasp, which no other grasp of the dataset has."""
        return id_beginning(self.body.content_sha256, self.unit.friction) + grasp


def _trial_row(grasp_id: str, number: int, tried: WrenchVerdict | ControlTrial) -> TrialRow:
    planned = isinstance(tried, WrenchVerdict)
    return TrialRow(
        grasp_id=grasp_id,
        trial=number,
        name=tried.name,
        wrench_n_nm=tried.wrench,
        predicted_limit=tried.predicted_limit if planned else None,
        required_friction=tried.required_friction,
        hold=tried.hold,
        simulated_limit=tried.simulated_limit if planned else None,
        verdict=figures_in(TrialRow, "verdict", tried if planned else None),
    )
