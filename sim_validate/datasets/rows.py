"""Makes the row of an object, and chooses its split by the hash of its mesh."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import Seated
from grasp_core.values import Contact, Grasp
from sim_validate.closure.controls import ControlTrial, ControlVerdict
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.datasets.figures import (
    Executed,
    Figures,
    execution_cells,
    execution_rows,
    for_fingers,
)
from sim_validate.datasets.given_contacts import GivenGrasp
from sim_validate.datasets.tables import SPLITS, Name, id_beginning
from sim_validate.datasets.units import WorkUnit
from sim_validate.datasets.varied import VARIED, Tried, ratio_of
from sim_validate.engine.traces import Outcome

Row: TypeAlias = Mapping[str, Any]
Rows: TypeAlias = Mapping[Name, tuple[Row, ...]]
PLANNED = "planned"
"""Kind of the grasps that were planned for their friction."""
GIVEN = "given"
"""Label of grasps that another tool made."""
NOT_TRIED = "not_tried"
"""Outcome of given grasps that cannot be simulated: their `note` says why, and no cell claims
anything else about them."""


def split_of(object_id: str, seed: int) -> str:
    """Choose the split of an object by its hash, so that adding objects moves no other object."""
    digest = hashlib.sha256(f"{seed} {object_id}".encode()).digest()
    share = int.from_bytes(digest[:8], "big") / 2.0**64
    return next(name for name, upto in SPLITS if share < upto)


def object_row(body: Polyhedron, unit: WorkUnit) -> Mapping[str, Any]:
    """Make the row of a unit's object."""
    return {
        "object_id": body.content_sha256,
        "source_name": Path(unit.object).name,
        "source_sha256": unit.source_sha256,
        "split": split_of(body.content_sha256, unit.config.seed),
        "vertices": len(body.vertices),
        "triangles": len(body.triangles),
        "faces": len(body.faces),
        "curved": body.patches is not None,
        "volume_m3": body.volume,
        "volume_source": body.surface.volume_source,
        "radius_m": body.radius,
        "center_of_mass_m": body.center_of_mass.tolist(),
    }


@dataclass(slots=True)
class GraspRows:
    """Rows of one object at one friction, while they are made."""

    body: Polyhedron
    unit: WorkUnit
    grasps: list[Row] = field(default_factory=list[Row])
    trials: list[Row] = field(default_factory=list[Row])
    executions: list[Row] = field(default_factory=list[Row])

    def add(self, grasp: Grasp, verdict: Verdict, executed: Executed = None) -> None:
        """Add the rows of a planned grasp, its negative controls, and the trials of all."""
        about = {
            "label": "grasp",
            "kind": PLANNED,
            "family": grasp.family,
            "region_radius_m": grasp.radius,
        }
        self._add_closed(grasp, verdict, about, executed, self.body)

    def add_given(
        self, given: GivenGrasp, grasp: Grasp, verdict: Verdict, seated: Seated,
        executed: Executed = None,
    ) -> None:  # fmt: skip
        """Add rows of a force-closed given grasp, its negative controls, and all trials."""
        about: dict[str, Any] = {
            "name": given.name, "label": GIVEN, "kind": GIVEN,
            "moved_m": seated.moved_m,
        }  # fmt: skip
        if self.body.patches is not None:
            # on curved surfaces the contacts' faces are made for this grasp alone
            about["faces"] = None
        self._add_closed(grasp, verdict, about, executed, seated.body)

    def add_varied(self, made_from: str, tried: Tried) -> None:
        """Add the row of a grasp that was varied, with its trials; it may be closed or not."""
        variant, verdict = tried.variant, tried.verdict
        name = f"{self.name(made_from)}:{variant.name}"
        about: dict[str, Any] = {
            "name": variant.name, "label": VARIED, "kind": variant.kind,
            "made_from": self.name(made_from), "displaced_m": variant.displaced_m.tolist(),
            "region_exit_m": list(variant.exits_m), "mass_ratio": variant.mass_ratio,
            "friction": variant.friction, "control_of": None,
            "friction_ratio": variant.friction_ratio,
        }  # fmt: skip
        if not isinstance(verdict, ControlVerdict):
            assert isinstance(variant.proved, Grasp)  # noqa: S101 - only closed ones have verdicts
            if self.body.patches is not None:
                about["faces"] = None
            self._add_closed(
                variant.proved, verdict, about, tried.executed, variant.seated.body, name
            )
            return
        if variant.critical_friction is not None:
            about["critical_friction"] = variant.critical_friction
        self._add_refuted(name, verdict, about, tried.executed)

    def add_open(self, given: GivenGrasp, verdict: ControlVerdict, moved_m: float) -> None:
        """Add rows of a given grasp that is not force-closed; it is a negative control."""
        about = {
            "name": given.name, "label": GIVEN, "kind": GIVEN, "control_of": None,
            "moved_m": moved_m,
        }  # fmt: skip
        self._add_refuted(self.name(given.id), verdict, about)

    def add_untried(self, given: GivenGrasp, why: str) -> None:
        """Add the row of a given grasp that cannot be simulated."""
        contacts = [
            Contact(np.array(point), np.array(normal))
            for point, normal in zip(given.points, given.normals, strict=True)
        ]
        self.grasps.append(
            self._common(self.name(given.id), contacts)
            | {
                "name": given.name,
                "label": GIVEN,
                "kind": GIVEN,
                "control_of": None,
                "outcome": NOT_TRIED,
                "note": why,
                "trials": 0,
                "mismatches": 0,
            }
        )

    def _add_closed(
        self, grasp: Grasp, verdict: Verdict, about: Mapping[str, Any], executed: Executed,
        body: Polyhedron, name: str | None = None,
    ) -> None:  # fmt: skip
        name = self.name(grasp.id) if name is None else name
        figures = self._figures
        friction = verdict.critical_friction
        self.grasps.append(
            self._common(name, grasp.contacts, verdict.friction)
            | {
                "name": grasp.id,
                "control_of": None,
                "faces": list(grasp.faces),
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
                "simulated_critical_friction": friction.simulated,
                "friction_ratio": ratio_of(verdict.friction, grasp.critical_friction),
                **({} if figures is None else figures.of_grasp(body, grasp, verdict.friction)),
                **about,
                **self._of_executed(body, grasp.contacts, verdict.friction, executed),
            }
        )
        self._add_executions(name, executed)
        self._add_trials(name, verdict.wrenches)
        for control in verdict.controls:
            kind = control.control.name
            said = {
                "name": about.get("name", grasp.id), "label": kind, "control_of": name,
                "kind": kind,
            }  # fmt: skip
            self._add_refuted(f"{name}:{kind}", control, said)

    def _add_refuted(
        self, name: str, verdict: ControlVerdict, about: Mapping[str, Any],
        executed: Executed = None,
    ) -> None:  # fmt: skip
        control = verdict.control
        first = next((t for t in verdict.tried if t.hold.outcome is not Outcome.HELD), None)
        self.grasps.append(
            self._common(name, control.contacts, control.friction)
            | {
                "friction": control.friction,
                "force_closed": False,
                "closure_margin": control.certificate.margin,
                "held": first is None,
                "outcome": Outcome.HELD.value if first is None else first.hold.outcome.value,
                "trials": len(verdict.tried),
                "mismatches": int(not verdict.let_go),
                **about,
                **self._of_executed(self.body, control.contacts, control.friction, executed),
            }
        )
        self._add_executions(name, executed)
        self._add_trials(name, verdict.tried)

    def _add_executions(self, name: str, executed: Executed) -> None:
        asked = self.unit.config.execution
        if asked is not None:
            more = () if self._figures is None else self._figures.asked.seeds
            seeds = (asked.settings.seed, *more)
            self.executions += execution_rows(name, executed, seeds, asked.settings.misplacements)

    def _of_executed(
        self, body: Polyhedron, contacts: Sequence[Contact], friction: float, executed: Executed
    ) -> Mapping[str, Any]:
        cells = execution_cells(executed)
        if self._figures is None or cells.get("mass_kg") is None:
            return cells
        return {**cells, **self._figures.of_executed(body, contacts, friction, cells["mass_kg"])}

    @property
    def _figures(self) -> Figures | None:
        config = self.unit.config
        if config.learning is None:
            return None
        return Figures(config.learning, config.execution, config.seed)

    def name(self, grasp: str) -> str:
        """Return the name of a grasp, which no other grasp of the dataset has."""
        return id_beginning(self.body.content_sha256, self.unit.friction) + grasp

    def _common(
        self, name: str, contacts: Iterable[Contact], friction: float | None = None
    ) -> dict[str, Any]:
        listed, figures = list(contacts), self._figures
        friction = self.unit.friction if friction is None else friction
        unexecuted = {} if self.unit.config.execution is None else {"executed": False}
        return {
            **unexecuted,
            "grasp_id": name,
            "object_id": self.body.content_sha256,
            "split": split_of(self.body.content_sha256, self.unit.config.seed),
            "friction": self.unit.friction,
            "note": "",
            "contacts": len(listed),
            "contact_points_m": for_fingers([c.position.tolist() for c in listed], [None] * 3),
            "contact_normals": for_fingers([c.normal.tolist() for c in listed], [None] * 3),
            **({} if figures is None else figures.of_contacts(self.body, listed)),
        }

    def _add_trials(
        self, name: str, tried: Sequence[WrenchVerdict] | Sequence[ControlTrial]
    ) -> None:
        for number, trial in enumerate(tried):
            hold = trial.hold
            row: dict[str, Any] = {
                "grasp_id": name,
                "trial": number,
                "name": trial.name,
                "wrench_n_nm": trial.wrench.tolist(),
                "required_friction": trial.required_friction,
                "outcome": hold.outcome.value,
                "reason": hold.reason,
                "displacement_m": hold.displacement_m,
                "rotation_rad": hold.rotation_rad,
                "slip_m": for_fingers(hold.slip_m.tolist(), None),
                "failed_after_s": hold.failed_after_s,
            }
            if isinstance(trial, WrenchVerdict):
                row["predicted_limit"] = trial.predicted_limit
                row["simulated_limit"] = trial.simulated_limit
            self.trials.append(row)
