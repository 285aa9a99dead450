"""Checks the rows of a dataset against each other and against what is proved of them again.

A row is checked against its contacts and trials, and the grasp that it was made from. The multiple
of the weight that a squeeze carries follows from contacts, squeeze, mass and springs alone, so it
is proved again for every row; what a trial did is only simulated again in a sample. What is said of
a hand is checked in `hand_checks`.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import chain

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError, InputError, UndecidedError
from grasp_core.execution.grips import grip
from grasp_core.execution.loads import any_direction
from grasp_core.execution.squeeze_certificate import survives
from grasp_core.objects.on_faces import SolidSurface
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.datasets.columns import (
    FROM_TOOL,
    ROUNDOFF,
    VARIED,
    DatasetRows,
    GraspRow,
    ObjectRow,
)
from sim_validate.datasets.config import KEYS, REFERENCES, TABLE_NAMES, TableName
from sim_validate.datasets.hand_checks import HandChecks
from sim_validate.datasets.layout import CONFIG
from sim_validate.datasets.learning import (
    VARIED_RATIOS,
    contact_cells,
    ratio_of,
    trial_cells,
)
from sim_validate.datasets.making_rows import PLANNED_KIND
from sim_validate.datasets.open_dataset import Dataset
from sim_validate.datasets.row_faults import disagreements
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.execution.holders import tip_radius
from sim_validate.execution.verdict import ExecutionTrial

ON_MESH, NEAR_MESH = 1e-5, 0.05
"""Largest distance of contacts from the mesh, for grasps and negative controls, relative to the
object's radius. Planar faces are as flat as six digits show. Negative controls are moved in
the planes of patches, from which a curved surface departs."""
RATIO_TOLERANCE = 1e-3
"""Share by which a ratio may leave its band: frictions and masses are rounded to four digits."""
NAMING_COLUMNS: Mapping[tuple[TableName, str], tuple[TableName, str]] = {
    **REFERENCES, ("grasps", "control_of"): ("grasps", "grasp_id"),
}  # fmt: skip
LABELS = {"grasp": PLANNED_KIND, FROM_TOOL: FROM_TOOL}
"""Kind of the rows of a label; other labels but `varied` are kinds themselves."""
UNBALANCED = 1e-9
"""Wrench that balanced forces leave, relative to the forces, at object radius one."""


class RowChecks:
    """Checks of the rows of one object in all tables, by what follows from their cells."""

    def __init__(self, part: Dataset, rows: DatasetRows) -> None:
        self.part, self.config, self.rows = part, part.config, rows
        self.by_name = {row.grasp_id: row for row in rows.grasps}
        self.outcomes = defaultdict[str, list[Outcome]](list)
        self.executions = defaultdict[str, list[ExecutionTrial]](list)
        for row in rows.trials:
            self.outcomes[row.grasp_id].append(row.hold.outcome)
        for row in rows.executions:
            self.executions[row.grasp_id].append(row.tried)

    @cached_property
    def bodies(self) -> Mapping[str, Polyhedron]:
        """The object, or the objects whose names begin alike."""
        rows = self.rows.objects
        return {row.object_id: self.part.body(row.object_id, row.source_name) for row in rows}

    def faults(self) -> Iterator[str]:
        """Yield sentences on what is wrong with the rows of all tables."""
        yield from self._table_faults()
        for row in self.rows.objects:
            yield from self._mesh_faults(row)
        for row in self.rows.grasps:
            own = chain(self._row_faults(row), self._requested_faults(row))
            yield from (f"grasps: {row.grasp_id}: {fault}" for fault in own)

    def _table_faults(self) -> Iterator[str]:
        split = self.part.split
        if any(row.split != split for row in (*self.rows.objects, *self.rows.grasps)):
            yield f"objects or grasps: files of the split {split} have rows of another split"
        for name in TABLE_NAMES:
            rows = self.rows.of(name)
            keys = Counter(tuple(getattr(row, key) for key in KEYS[name]) for row in rows)
            if any(count > 1 for count in keys.values()):
                yield f"{name}: two rows have the same {' and '.join(KEYS[name])}"
        for (name, column), (other, key) in NAMING_COLUMNS.items():
            there = {getattr(row, key) for row in self.rows.of(other)}
            named = {getattr(row, column) for row in self.rows.of(name)} - {None}
            yield from (
                f"{name}: {missing}, named in {column}, has no row in the table of {other}"
                for missing in sorted(named - there)
            )

    def _mesh_faults(self, row: ObjectRow) -> Iterator[str]:
        try:
            mesh = self.part.surface(row.object_id)
        except InputError as error:
            yield str(error)
            return
        surface = SolidSurface(mesh.vertices, mesh.triangles)
        own = (each for each in self.rows.grasps if each.object_id == row.object_id)
        on_it = [on for each in own if each.was_tried
                 for on in _on_surface(surface, each, row.radius_m)]  # fmt: skip
        if off := on_it.count(False):
            yield (
                f"grasps: {off} contacts of {row.source_name} are not on the object, or not "
                "with its normals"
            )

    def _row_faults(self, row: GraspRow) -> Iterator[str]:
        outcomes = self.outcomes[row.grasp_id]
        held = all(one is Outcome.HELD for one in outcomes) if row.was_tried else None
        by_trials = {"trials": len(outcomes), "held": held}
        yield from disagreements(row, by_trials, "the table of trials")
        own = row.control_of is None and row.label != VARIED
        if own and row.friction not in self.config.frictions:
            yield f"friction {row.friction} is not among those of {CONFIG}"
        if row.was_tried:
            yield from _contact_faults(row)

    def _requested_faults(self, row: GraspRow) -> Iterator[str]:
        """Check what a dataset has only on request, of a row whose object is there."""
        executed, learned = self.config.execution is not None, self.config.learning is not None
        asked = executed or learned or self.config.hand is not None
        body = self.bodies.get(row.object_id) if asked else None
        if body is None:
            return
        if executed:
            found = [*self._execution_faults(row)]
            yield from found or self._squeeze_faults(row, body)
        if learned:
            yield from self._learning_faults(row, body)
        if self.part.hand is not None and self.config.hand is not None:
            yield from HandChecks(self.part.hand, self.config.hand, row, body).faults()

    def _learning_faults(self, row: GraspRow, body: Polyhedron) -> Iterator[str]:
        if row.label == VARIED:
            yield from self._variant_faults(row, body)
        else:
            yield from disagreements(row, {"kind": LABELS.get(row.label, row.label)}, "label")
        ratio = {"friction_ratio": ratio_of(row.friction, row.critical_friction)}
        yield from disagreements(row, ratio, "the critical friction")
        if row.was_tried:
            by_contacts = contact_cells(self.config, body, row.placed)
            yield from disagreements(row, by_contacts, "the contacts")
        if row.witness_forces_n is not None:
            yield from _witness_faults(row, row.witness_forces_n, body)

    def _variant_faults(self, row: GraspRow, body: Polyhedron) -> Iterator[str]:
        source = self.by_name.get(row.made_from or "")
        if source is None:
            yield f"{row.made_from}, named in made_from, has no row"
            return
        stated, exits = row.displaced_m, row.region_exit_m
        if stated is None or exits is None or len(row.points) != len(source.points):
            yield "displaced_m or region_exit_m is missing, or contacts of made_from are"
            return
        moves = np.linalg.norm(row.points - source.points, axis=1)
        yield from disagreements(row, {"displaced_m": moves}, "the contacts of made_from")
        if (row.kind == "moved_out") == (not stated.any()):
            yield f"contacts of the kind {row.kind} are not where they must be"
        # where a contact did not move, its exit is NaN, which nothing is below
        if body.patches is None and (stated <= exits * (1.0 - ROUNDOFF)).any():
            yield "a contact was moved, but is still in its region"
        try:
            critical = critical_friction(row.points, row.normals)
        except GraspError as error:
            yield f"the critical friction cannot be computed ({error})"
            return
        yield from disagreements(row, {"critical_friction": critical}, "the contacts")
        if row.kind in VARIED_RATIOS:
            least, most = VARIED_RATIOS[row.kind]
            ratio = row.mass_ratio if row.kind == "mass_near" else row.friction_ratio
            if ratio is None or not least * (1.0 - RATIO_TOLERANCE) <= ratio <= most * (
                1.0 + RATIO_TOLERANCE
            ):
                yield f"the ratio {ratio} is none of the kind {row.kind}"

    def _execution_faults(self, row: GraspRow) -> Iterator[str]:
        trials = self.executions[row.grasp_id]
        if not row.executed:
            if trials:
                yield "the table of executions has trials of it, although none was simulated"
            return
        wanted = trial_cells(trials)
        if self.config.learning is None:
            del wanted["predicted_loss"]
        else:
            carried = (row.load_multiple or 0.0) * (row.mass_kg or 0.0)
            yield from disagreements(row, {"payload_kg": carried}, "load_multiple times the mass")
        yield from disagreements(row, wanted, "the table of executions")

    def _squeeze_faults(self, row: GraspRow, body: Polyhedron) -> Iterator[str]:
        yield from self._load_faults(row, body, "load_multiple")
        if row.least_squeeze_n is not None:
            # it carries the weight itself, with no larger push
            least = replace(row, squeeze_n=row.least_squeeze_n, load_multiple=1.0)
            yield from self._load_faults(least, body, "least_push_n", row.least_push_n)

    def _load_faults(
        self, row: GraspRow, body: Polyhedron, claim: str, push_n: float | None = None
    ) -> Iterator[str]:
        asked, load, mass_kg = self.config.execution, row.load_multiple, row.mass_kg
        if asked is None or row.squeeze_n is None or load is None or mass_kg is None:
            return  # nothing was executed
        try:
            settings = asked.for_body(body)
            if row.mass_ratio is not None:
                settings = replace(settings, mass_kg=mass_kg)
            held = grip(
                row.held_on(body), row.placed, row.friction, row.squeeze_n[: row.contacts],
                stiffness=settings.tip_stiffness_n_per_m,
                tip_radius_m=tip_radius(row.held_on(body), row.placed, settings),
            )  # fmt: skip
        except GraspError as error:
            yield f"the contacts cannot be squeezed as the row says ({error})"
            return
        if faults := list(disagreements(row, {"mass_kg": settings.object_kg}, CONFIG)):
            yield from faults
            return
        most_n = settings.push_n if push_n is None else push_n
        loads = any_direction(settings.object_kg)
        if not survives(held, loads, load * (1.0 - ROUNDOFF), most_n):
            stated = getattr(row, claim)
            yield f"{claim} is {stated:.9g}, but the squeeze is not proved to carry as much"


def _on_surface(surface: SolidSurface, row: GraspRow, radius_m: float) -> Iterator[bool]:
    """Yield for each contact whether it is on the object, with its normal if it is no control's."""
    for point, normal in zip(row.points, row.normals, strict=True):
        if row.control_of is None:
            yield surface.holds(point, normal, ON_MESH * radius_m)
        else:
            yield surface.holds(point, None, NEAR_MESH * radius_m)


def _contact_faults(row: GraspRow) -> Iterator[str]:
    try:
        found = force_closure(row.points, row.normals, row.friction)
    except UndecidedError as error:
        if row.force_closed:
            yield f"force closure of the contacts cannot be decided ({error})"
        return
    except GraspError as error:
        yield f"force closure of the contacts cannot be computed ({error})"
        return
    margin = {"closure_margin": found.margin} if found.closed and row.force_closed else {}
    yield from disagreements(row, {"force_closed": found.closed, **margin}, "the contacts")


def _witness_faults(row: GraspRow, forces: Array, body: Polyhedron) -> Iterator[str]:
    arms = (row.points - body.center_of_mass) / body.radius
    pushes = np.einsum("ki,ki->k", forces, row.normals)
    across = np.linalg.norm(forces - pushes[:, None] * row.normals, axis=1)
    left = np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])
    in_cones = (across <= row.friction * pushes * (1.0 + ROUNDOFF) + UNBALANCED).all()
    if not in_cones or np.abs(left).max() > ROUNDOFF or abs(pushes.sum() - 1.0) > ROUNDOFF:
        yield "witness_forces_n are no balanced forces in the friction cones"
